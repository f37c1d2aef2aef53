"""The simulated bed: the paper's samples and whole protocol, and effects hidden in it. Nothing here was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.common.errors import UserError
from freelearn.data.beds import KINEMATIC, KPA, MM, NMM
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.models.continuum import Continuum

# The virtual bed: the paper's eight samples and whole protocol, simulated. Nothing here was measured.

# The paper's Table of fiber angles and dimensions: Γ [deg], L, R_i, R_o [mm].
DESIGNS = (
    (15.0, 90.48, 4.77, 6.13),
    (25.0, 120.52, 4.77, 6.62),
    (36.0, 98.42, 4.77, 6.74),
    (40.0, 90.48, 4.77, 6.13),
    (50.0, 120.40, 4.77, 6.41),
    (62.0, 99.00, 4.77, 6.36),
    (73.0, 128.90, 4.77, 6.40),
    (76.0, 103.22, 4.77, 6.18),
)
ELONGATIONS_MM = np.arange(-5.0, 6.0)
TWISTS_DEG = np.concatenate([np.arange(-120, 0, 10), [-1, 1], np.arange(10, 130, 10)]).astype(float)
# Eight steps up to 72.5 kPa and two back down to the atmosphere.
PRESSURES_KPA = np.concatenate([np.linspace(0, 72.5, 8), [72.5 / 2, 0.0]])


def protocol() -> pd.DataFrame:
    """The nominal 22,880 configurations: the measurement table's columns without loads, `buckled` all 0."""
    samples, elongation, twist, step = np.meshgrid(
        np.arange(len(DESIGNS)), ELONGATIONS_MM, TWISTS_DEG, np.arange(len(PRESSURES_KPA)), indexing="ij"
    )
    samples, step = samples.ravel(), step.ravel()
    design = np.array(DESIGNS)[samples]
    return pd.DataFrame(
        {
            "sample": samples + 1,
            "gamma_deg": design[:, 0],
            "length_mm": design[:, 1],
            "inner_radius_mm": design[:, 2],
            "outer_radius_mm": design[:, 3],
            "step": step,
            "elongation_mm": elongation.ravel(),
            "twist_deg": twist.ravel(),
            "pressure_kpa": PRESSURES_KPA[step],
            "force_n": 0.0,
            "moment_nmm": 0.0,
            "buckled": 0,
            # 20 readings at 1 Hz make a row; each sample has a run of its own.
            "time_s": 20.0 * (np.arange(len(samples)) % (len(samples) // len(DESIGNS))),
        }
    )


def simulate(
    truth: Mapping[str, float | Sequence[float]],
    effects: Mapping[str, Mapping[str, float | Sequence[float]]],
    accuracy: Mapping[str, float],
    buckled_share: float,
    seed: int,
) -> pd.DataFrame:
    """A measurement table of the whole protocol, from a seed.

    truth: C1, C2 [Pa]. effects: the physics beyond the continuum model, {effect: {parameter: SI value}}. A list of
    values is one per sample.
    accuracy: one standard deviation of elongation_mm, twist_deg (one error per kinematic state), pressure_kpa,
    force_n, moment_nmm (each row), as in `accuracy`. buckled_share: share of all rows marked as buckled.
    """
    generator = np.random.default_rng(seed)
    table = protocol()
    per_state = len(PRESSURES_KPA)
    states_count = len(table) // per_state

    def shared(deviation: float) -> np.ndarray:
        return np.repeat(generator.normal(0, deviation, states_count), per_state)

    actual = table.copy()
    actual["elongation_mm"] += shared(accuracy["elongation_mm"])
    actual["twist_deg"] += shared(accuracy["twist_deg"])
    # The sensor errs, not the bed: the table shows a reading of the pressure that really acted.
    table["pressure_kpa"] += generator.normal(0, accuracy["pressure_kpa"], len(table))

    loads, status = _true_loads(actual, truth, effects)
    table["force_n"] = loads[:, 0].numpy() + generator.normal(0, accuracy["force_n"], len(table))
    table["moment_nmm"] = loads[:, 1].numpy() / NMM + generator.normal(0, accuracy["moment_nmm"], len(table))

    table["buckled"] = _buckled(actual, loads.numpy(), buckled_share, generator).astype(int)
    # A ballooned tube gives no measurement: like a buckled one it never counts.
    table.loc[(status != Status.OK).numpy(), "buckled"] = 1
    return table


def _true_loads(
    actual: pd.DataFrame,
    truth: Mapping[str, float | Sequence[float]],
    effects: Mapping[str, Mapping[str, float | Sequence[float]]],
) -> Prediction:
    """Loads of every row at its actual state, sample by sample (the parameters may differ between samples)."""
    model = Continuum(effects=make_effects(list(effects), "continuum"))
    named = dict(truth)
    for effect, parameters in effects.items():
        named |= {f"{effect}.{name}": value for name, value in parameters.items()}
    parts = []
    for number in range(len(DESIGNS)):
        model.set_values({n: float(v if isinstance(v, int | float) else v[number]) for n, v in named.items()})
        with torch.no_grad():
            parts.append(model(States.from_table(actual[actual["sample"] == number + 1])))
    return Prediction(torch.cat([p.loads for p in parts]), torch.cat([p.status for p in parts]))


def _buckled(actual: pd.DataFrame, loads: np.ndarray, share: float, generator: np.random.Generator) -> np.ndarray:
    """Rows in which the tube buckles: the given share, in a different pattern for each sample.

    A thin tube buckles where its wall is pushed or twisted too hard. The rule's drive is the wall's own axial
    compression (fluid thrust taken off) and the moment's size, each in units of its spread over the sample, plus
    a smooth imperfection of each sample's own over length, twist and pressure, since the paper found no common
    pattern. It is a rule to make realistic gaps, not a stability analysis.
    """
    thrust = np.pi * (actual["inner_radius_mm"].to_numpy() * MM) ** 2 * actual["pressure_kpa"].to_numpy() * KPA
    compression = loads[:, 0] - thrust
    x = actual["elongation_mm"].to_numpy() / 5
    y = actual["twist_deg"].to_numpy() / 120
    z = actual["pressure_kpa"].to_numpy() / 72.5 * 2 - 1
    drive = np.empty(len(actual))
    for sample in np.unique(actual["sample"]):
        rows = (actual["sample"] == sample).to_numpy()
        push, turn = compression[rows], np.abs(loads[rows, 1])
        drive[rows] = 0.6 * (push - push.mean()) / push.std() + 0.3 * (turn - turn.mean()) / turn.std()
        tilt = generator.normal(size=3) * (0.5, 0.5, 0.7)
        wave = generator.normal(size=3)
        phase = generator.uniform(0, 2 * np.pi)
        drive[rows] += tilt @ np.stack([x[rows], y[rows], z[rows]])
        drive[rows] += 0.4 * np.sin(2 * (wave @ np.stack([x[rows], y[rows], z[rows]])) + phase)
        drive[rows] += 0.3 * generator.normal()
    return drive > np.quantile(drive, 1 - share)


# Effects hidden in the simulated bed, by name or drawn at random, for blind tests.

# A drawn effect is between half and twice as large as a noticeable one.
SMALLEST, LARGEST = 0.5, 2.0
# Share of draws that hide one effect; the others hide two.
ONE = 0.6
# What is seen of braids, or of several actuators on one end block: the simulated bed has one helix each.
ELSEWHERE = ("bladder_slack", "strand_jamming", "block_tilt")

Hidden = dict[str, dict[str, float]]


def hidden_effects(hidden: Any, seed: int) -> Hidden:
    """Effects with their parameters, SI, from `data.hidden`: a list of names, {name: {parameter: value}} or "random".

    Named effects have the size that their parameters declare as noticeable. Raises UserError.
    """
    if hidden == "random":
        return _drawn(seed)
    if isinstance(hidden, Mapping):
        chosen = {str(name): dict(values or {}) for name, values in hidden.items()}
    elif isinstance(hidden, list):
        chosen = {str(name): {} for name in hidden}
    else:
        raise UserError(f"data.hidden = {hidden!r}: give a list of effect names, for example [end_clamps], or random.")
    sizes = {}
    for effect in make_effects(list(chosen), "continuum"):
        known = [p.name for p in effect.declared_parameters()]
        for name in chosen[effect.name]:
            if name not in known:
                raise UserError(f"Effect {effect.name!r} has no parameter {name!r}: it has {', '.join(known)}.")
        sizes[effect.name] = {
            p.name: float(chosen[effect.name].get(p.name, _noticeable(p))) for p in effect.declared_parameters()
        }
    return sizes


def _noticeable(p: Parameter) -> float:
    assert p.scale is not None
    return p.scale if p.none is not None else p.start


def _drawn(seed: int) -> Hidden:
    generator = np.random.default_rng([seed, 4242])
    count = 1 if generator.random() < ONE else 2
    able = [n for n, effect in EFFECTS.items() if "continuum" in effect.families() and _shows(n)]
    names = generator.choice(able, count, replace=False)
    return {str(name): _sized(EFFECTS[str(name)], generator) for name in names}


def _shows(name: str) -> bool:
    """Whether an effect shows in the simulated bed, a kinematic one whose samples are of one stock: of the history
    nothing does in plateaus."""
    effect = EFFECTS[name]
    elsewhere = effect.port == "history" or effect.compares or name in ELSEWHERE
    return not elsewhere and not effect.untold(KINEMATIC.name)


def _sized(effect: type[Effect[Any]], generator: np.random.Generator) -> dict[str, float]:
    values = {}
    for p in effect.declared_parameters():
        factor = SMALLEST * (LARGEST / SMALLEST) ** generator.random()
        sign = -1.0 if p.none is not None and p.lower < p.none and generator.random() < 0.5 else 1.0
        values[p.name] = float(np.clip(sign * factor * _noticeable(p), p.lower, p.upper))
    return values
