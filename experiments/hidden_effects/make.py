"""Data sets as planned: the material, the effects sized in σ, and the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import torch
from hidden_effects import braids
from hidden_effects.smooth import WORD, smooth

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows, loads_of
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.fitting.problem import Problem
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import literature, total_energy, truths
from freelearn.testing.reference.laboratory import Laboratory, Measured, measure, random_actuators

NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
SILENT = dict.fromkeys(NOISE, 0.0)
NO_SLIPS = pd.DataFrame(columns=["row", "load", "kind", "sensor_sigmas"])
# Rounds of sizing, and by how much one may change the amount.
ROUNDS, STRIDE = 6, 1e3


@dataclass(frozen=True)
class Made:
    """A data set. material: C1, C2 [Pa]. fx: what is hidden, in the parameters of its form. reached: size of each
    hidden effect in σ. told: the accuracy that the search is told. actuators: number → what is known of its design."""

    measured: Measured
    material: tuple[float, float]
    fx: dict[str, dict[str, float]]
    reached: list[float]
    told: Accuracy
    actuators: Mapping[int, tuple[float, ...]]


def make(job: dict) -> Made:
    """The data set of a plan's entry."""
    generator = np.random.default_rng(job["seed"])
    material = float(1e6 * 2 ** generator.uniform(-1, 1)), float(3e7 * 2 ** generator.uniform(-1, 1))
    true = {name: value * job["noise"] for name, value in NOISE.items()}
    laboratory = None
    if "laboratory" in job:
        laboratory = Laboratory(**{k: tuple(v) if k == "kinds" else v for k, v in job["laboratory"].items()})
    actuators: Mapping[int, tuple[float, ...]]
    if "tubes" in job:
        actuators, plan = braids.planned(job["tubes"], job["bed"], generator)
    else:
        actuators = (
            random_actuators(2, generator) if laboratory else {n: total_energy.SAMPLES[n] for n in job["samples"]}
        )

    def measured(fx: dict, noise: dict, extra: total_energy.Extra | None, quiet: bool = False) -> Measured:
        if "tubes" in job:
            return Measured(braids.measure(job["bed"], plan, *material, fx, job["seed"], noise), NO_SLIPS)
        if laboratory:
            how = replace(laboratory, slipped=0.0) if quiet else laboratory
            return measure(how, actuators, *material, fx, noise, job["seed"], extra)
        table = total_energy.measure(job["samples"], *material, fx, noise, job["seed"], extra=extra)
        return Measured(table, NO_SLIPS)

    forms = laboratory.forms if laboratory else "literature" if "tubes" in job else "package"
    grown = literature.grown if forms == "literature" else truths.grown
    outside = job["kind"] == "outside"
    # Filled from none: contacts rub in the first row too.
    vented = {"vented": 1.0} if laboratory and laboratory.begins else {}

    def hidden(name: str, amount: float) -> dict[str, float]:
        return grown(name, amount) | (vented if name == "friction_hysteresis" else {})

    fx, extra, reached = {}, None, []
    for name in job["hidden"]:

        def loads(a: float, name: str = name) -> pd.DataFrame:
            if outside:
                return measured({}, SILENT, _outside(name, a), quiet=True).table
            return measured({name: hidden(name, a)} if a else {}, SILENT, None, quiet=True).table

        amount, size = sized(loads, job["size"], material, true, laboratory.growth if laboratory else 0.0)
        reached.append(size)
        if outside:
            extra = _outside(name, amount)
        else:
            fx[name] = hidden(name, amount)
    told = Accuracy.engineering(**(laboratory.told(true) if laboratory else true))
    return Made(measured(fx, true, extra), material, fx, reached, told, actuators)


def _outside(name: str, amount: float) -> total_energy.Extra:
    return smooth(name)(amount) if name.startswith(WORD) else truths.outside(name, amount)


def sized(
    table: Callable[[float], pd.DataFrame], size: float, material: tuple[float, float], noise: dict, growth: float
) -> tuple[float, float]:
    """Units of an effect that make it `size` σ large after refitting C1 and C2, and the size that they really give.

    table: amount → measurement table without noise. Physical bounds may keep an effect from the size. growth: as in
    Laboratory; σ then is the root mean square of the load cell's over the rows.
    """
    plain = table(0.0)
    rows = Rows.from_table(plain)
    usable = torch.as_tensor(plain["buckled"].to_numpy() == 0)
    known = dict(noise)
    for name in (quantity.column for quantity in rows.states.bed.measured):
        share = plain[name].abs()[plain["buckled"] == 0]
        known[name] *= float(np.sqrt(((1 + growth * share / share.max()) ** 2).mean()))
    model = build_model("continuum", {"C1": material[0], "C2": material[1]})
    told = usable[:, None] & rows.readings.present
    known_of = Accuracy.engineering(**known)
    state = torch.as_tensor(rows.state)
    whiten = Whitener(sensitivities(model, rows.states), state, known_of, None, rows.states.bed, rows.readings.present)
    jacobian = Problem(model, rows, torch.ones(2).double()).jacobians(model.vector()[None].detach())[0]
    seen = torch.where(told[:, :, None], jacobian.reshape(len(rows), 2, -1), 0.0)
    span = orthonormal(whiten(seen).flatten(0, 1))

    def size_of(a: float) -> float:
        # Far too large an amount may have no loads at all: what is left of them is no number.
        with np.errstate(over="ignore", invalid="ignore"):
            change: Any = loads_of(table(a)) - rows.loads
        white = whiten(torch.where(told, change, 0.0)).reshape(-1)
        return float((white - span @ (span.T @ white)).norm())

    a, now = 1.0, size_of(1.0)
    for _ in range(ROUNDS):
        # A mount too soft to settle gives no number: a smaller amount does.
        a *= min(max(size / max(now, 1e-9), 1 / STRIDE), STRIDE) if np.isfinite(now) else 0.1
        now = size_of(a)
        if abs(now / size - 1) < 0.02:
            break
    return a, now
