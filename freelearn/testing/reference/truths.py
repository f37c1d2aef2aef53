"""What is hidden in the benchmark's data: every effect of the library, and some that are not in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from freelearn.testing.reference.total_energy import Extra

# Direction in which each effect's parameters grow; the size is set in σ afterwards. A parameter that is undefined
# without the effect keeps its value, named after the bar.
UNIT: dict[str, dict[str, float]] = {
    "second_invariant": {"C01": 1e5},
    "wall_stiffening": {"C20": 1e5},
    "limited_extensibility": {"beta": 0.3},
    "fiber_stiffening": {"k2": 30.0},
    "fiber_tension_only": {"share": 0.1},
    "fiber_dispersion": {"kappa": 0.005},
    "fiber_misalignment": {"angle": 0.01},
    "wall_thickness": {"outer_radius": 1e-4},
    "end_clamps": {"clamp_length": 1e-3},
    "length_offset": {"length": 2e-4},
    "twist_offset": {"angle": 0.02},
    "twist_slack": {"angle": 0.02},
    "length_compliance": {"compliance": 5e-6},
    "twist_compliance": {"compliance": 0.05},
    "pressure_offset": {"pressure": 1e3},
    "pressure_gain": {"gain": 0.02},
    "friction_hysteresis": {"force": 0.05, "moment": 1e-3},
    "relaxation": {"share": 0.02},
    "stress_softening": {"depth": 0.02},
    "force_offset": {"force": 0.05},
    "moment_offset": {"moment": 1e-3},
    "force_gain": {"gain": 0.02},
    "moment_gain": {"gain": 0.02},
    "sensor_crosstalk": {"moment_into_force": 1.0, "force_into_moment": 3e-4},
    "sensor_drift": {"force_rate": 2e-6, "moment_rate": 5e-8},
}
# As UNIT: what braided muscles taught, hidden in data sets of their own.
BRAIDED: dict[str, dict[str, float]] = {
    "second_invariant_log": {"modulus": 1e5},
    "small_strain_stiffness": {"modulus": 1e5},
    "bladder_stiffness": {"stiffness": 300.0},
    "end_taper": {"ratio": 1.0},
    "threshold_pressure": {"pressure": 2e3},
    "contact_friction": {"force": 1e-3, "moment": 1e-3},
}
# As UNIT: of how the bed moves, in data sets of their own. Actuators beside the axis; walls that lag behind.
MOVED: dict[str, dict[str, float]] = {
    "off_axis": {"squared_distance": 1e-5},
    "viscoelasticity": {"share": 0.05},
}
# As UNIT: what only some actuators can show, braids that are pulled long, or have a bladder, and several on one block
# or one after another; or one bed, which measures no moment.
APART: dict[str, dict[str, float]] = {
    "block_tilt": {"compliance": 2e-6},
    "wall_modulus": {"log_ratio": 0.02},
    "fiber_modulus": {"log_ratio": 0.02},
    "own_force_gain": {"gain": 0.02},
    "own_moment_gain": {"gain": 0.02},
    "own_pressure_gain": {"gain": 0.02},
    "bladder_slack": {"stiffness": 50.0},
    "strand_jamming": {"stiffness": 500.0},
    "buckling": {"flexibility": 30.0},
}
# As UNIT: of what goes by the direction of the pressure, or of the bed, in data sets of its own.
DIRECTED: dict[str, dict[str, float]] = {
    "pressure_hysteresis": {"pressure": 500.0},
    "motion_friction": {"force": 0.05, "moment": 1e-3},
}
FIXED = {
    "relaxation": {"time": 45.0},
    "viscoelasticity": {"time": 60.0},
    "stress_softening": {"severity": 0.02},
    "small_strain_stiffness": {"decay": 5.0},
    "bladder_slack": {"gap": 0.15},
    "strand_jamming": {"room": 0.05},
}
# Where a physical bound ends the growth.
MOST = {"share": 0.9, "depth": 0.9, "kappa": 0.3, "squared_distance": 1e-2}


def grown(effect: str, amount: float) -> dict[str, float]:
    """The effect's parameters at `amount` times their unit, at most at their physical bound."""
    values = {p: amount * v for p, v in (UNIT | BRAIDED | MOVED | APART | DIRECTED)[effect].items()}
    return {p: min(v, MOST.get(p, v)) for p, v in values.items()} | FIXED.get(effect, {})


def _force(change: Extra) -> Callable[[float], Extra]:
    return lambda amount: lambda s, loads: loads + amount * np.stack([change(s, loads), 0 * loads[:, 0]], axis=1)


def _moment(change: Extra) -> Callable[[float], Extra]:
    return lambda amount: lambda s, loads: loads + amount * np.stack([0 * loads[:, 0], change(s, loads)], axis=1)


# Not in the library: amount → what happens to the loads. Each is a plausible flaw of a bed or an actuator.
OUTSIDE: dict[str, Callable[[float], Extra]] = {
    # A load cell that saturates: its reading bends with the square of the load.
    "bent_force_cell": _force(lambda s, loads: 1e-4 * loads[:, 0] * np.abs(loads[:, 0])),
    # A sheath that catches at one twist and lets go a little later.
    "sheath_catch": _moment(lambda s, loads: 1e-3 * np.exp(-(((s["twist"] - 0.9) / 0.25) ** 2))),
    # A cable beside the actuator: it pulls only when stretched past its slack.
    "slack_cable": _force(lambda s, loads: np.maximum(s["length"] - s["reference"] - 2e-3, 0) * 50.0),
    # A motor's cogging: the moment ripples with the angle.
    "cogging": _moment(lambda s, loads: 1e-3 * np.sin(8 * s["twist"])),
    # Room temperature that swings twice during a sample's run.
    "temperature_swing": _force(lambda s, loads: 0.05 * np.sin(4 * np.pi * s["clock"] / s["clock"].max())),
    # End caps that bulge: their thrust rises with the square of the pressure, and only with the tube twisted.
    "bulging_caps": _force(lambda s, loads: 0.1 * (s["pressure"] / 7e4) ** 2 * np.cos(3 * s["twist"])),
    # A load cell whose zero jumps once, in the middle of a sample's run.
    "zero_jump": _force(lambda s, loads: 0.05 * (s["clock"] > s["clock"].max() / 2)),
    # Gears that lean to one side whichever way they are turned.
    "gear_bias": _moment(lambda s, loads: 1e-3 * np.sign(s["twist"])),
}


def outside(name: str, amount: float) -> Extra:
    """The named flaw at this many times its unit."""
    return OUTSIDE[name](amount)
