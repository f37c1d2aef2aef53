"""Twist under a hung torque: how well it repeats, what each tube says alone, and the pressure for a twist."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from left_out import fit
from rich.table import Table
from sets import RealSet

from freelearn.data.rows import Rows
from freelearn.fitting.starts import starts
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model

DEGREES = 180 / np.pi
MODELS = ((), ("end_clamps",), ("fiber_misalignment", "end_clamps"))
# Pressures at which an inverse looks [Pa], and how near two readings count as a repeat [Pa].
SEARCHED, NEAR = np.linspace(0.0, 1.1e5, 23), 1e3
# A tube alone has several places to end a fit in.
STARTS = 4


def hung_torque_table(chosen: RealSet, out: Path) -> Table:
    """One column an angle. Root mean square errors in degrees (parameters, SI), or kPa (degrees) of an inverse."""
    rows = Rows.from_table(chosen.read(out))
    angle = (rows.states.fiber_angle * DEGREES).round().numpy()
    angles = np.unique(angle)
    shown = Table("", *(f"{a:g}°" for a in angles), title=f"{chosen.recipe}: degrees of twist")
    shown.add_row("repeats", *(f"{_repeats(rows[torch.as_tensor(angle == a)]):.1f}" for a in angles))
    for effects in MODELS:
        name = " + ".join(["continuum", *effects])
        model = build_model("continuum", effects=effects)
        alone, unseen, inverse = [], [], []
        for a in angles:
            own, others = rows[torch.as_tensor(angle == a)], rows[torch.as_tensor(angle != a)]
            error, values = _alone(model, own)
            told = ", ".join(f"{name.split('.')[-1]} {value:.2g}" for name, value in values.items())
            alone.append(f"{error:.1f} ({told})")
            unseen.append(f"{_error(_fitted(model, others), own):.1f}")
            inverse.append(_inverse(model, own))
        shown.add_row(f"{name}, fitted to this tube's twist alone", *alone)
        shown.add_row(f"{name}, fitted to the others", *unseen)
        shown.add_row("    pressure that gives the twist", *inverse)
    return shown


def _fitted(model: Model, rows: Rows) -> Model:
    fit(model, rows, starts(model, rows, 1, torch.Generator())[0])
    return model


def _alone(model: Model, rows: Rows) -> tuple[float, dict[str, float]]:
    """The least error in twist that fits to the twist alone end with, and the parameters of that fit."""
    present = rows.readings.present.clone()
    present[:, 0] = False
    twists = replace(rows, readings=replace(rows.readings, present=present))
    ends = []
    for start in [*starts(model, twists, STARTS, torch.Generator()), _fitted(model, rows).vector().detach().clone()]:
        fit(model, twists, start)
        ends.append((_error(model, twists), model.scalars()))
    return min(ends, key=lambda end: end[0])


def _twist(model: Model, rows: Rows, pressure: float | None = None) -> np.ndarray:
    states = rows.states
    if pressure is not None:
        states = states.replace(pressure=torch.full_like(states.pressure, pressure))
    with torch.no_grad():
        twist: np.ndarray = model(states).loads[:, 1].numpy() * DEGREES
    return twist


def _error(model: Model, rows: Rows) -> float:
    missed = _twist(model, rows) - rows.readings.value[:, 1].numpy() * DEGREES
    return float(np.sqrt(np.square(missed).mean()))


def _hangings(rows: Rows) -> list[np.ndarray]:
    """The places of the rows of each tube under each torque."""
    key = np.stack([rows.states.sample.numpy(), rows.states.moment.numpy().round(6)], axis=1)
    _, group = np.unique(key, axis=0, return_inverse=True)
    return [np.flatnonzero(group == g) for g in range(group.max() + 1)]


def _repeats(rows: Rows) -> float:
    """σ of twists read at one torque and nearly one pressure, less what a cubic in the pressure makes of the rest."""
    pressure, twist = rows.states.pressure.numpy(), rows.readings.value[:, 1].numpy() * DEGREES
    differences: list[float] = []
    for at in _hangings(rows):
        left = twist[at] - np.polyval(np.polyfit(pressure[at] / 1e5, twist[at], 3), pressure[at] / 1e5)
        i, j = np.triu_indices(len(at), 1)
        near = np.abs(pressure[at][i] - pressure[at][j]) < NEAR
        differences.extend((left[i] - left[j])[near])
    return float(np.sqrt(np.square(differences).mean() / 2))


def _inverse(model: Model, rows: Rows) -> str:
    """What the pressure errs by that the model gives for a twist that was read, and what is out of its reach."""
    pressure, twist = rows.states.pressure.numpy(), rows.readings.value[:, 1].numpy() * DEGREES
    curves = np.stack([_twist(model, rows, p) for p in SEARCHED.tolist()], axis=1)
    slope = np.empty(len(twist))
    for at in _hangings(rows):
        slope[at] = np.polyfit(pressure[at], twist[at], 1)[0]
    # The twist falls with the pressure; where it does not, the first pressure that gives it counts.
    falling = np.minimum.accumulate(curves, axis=1)
    inside = (twist <= falling[:, 0]) & (twist >= falling[:, -1])
    asked = [np.interp(-t, -curve, SEARCHED) for t, curve in zip(twist[inside], falling[inside], strict=True)]
    missed = np.array(asked) - pressure[inside]
    kpa, degrees = (float(np.sqrt(np.square(e).mean())) for e in (missed / 1e3, missed * slope[inside]))
    return f"{kpa:.1f} kPa ({degrees:.1f}°); {100 * (1 - inside.mean()):.0f} % out of reach"
