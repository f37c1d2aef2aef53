"""A second test bed, written apart from the package: total energy, complex-step derivatives, bisection.

It exists to judge the discovery on data that were not made by the code that fits them. Nothing of freelearn's mechanics
is used: the wall's energy is integrated with its own quadrature, the inner radius is found by bisection on the
derivative of the total potential Π = W − P V, and the loads are F = −∂Π/∂l, M = −∂Π/∂φ by complex steps (Squire & Trapp
1998). NumPy only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference.braided import (
    BLUNT,
    bent,
    beyond_threshold,
    contact,
    jammed,
    liner_energy,
    tapered,
    unfilled,
)
from freelearn.testing.reference.lagging_walls import moved_on, moves
from freelearn.testing.reference.leaning import leaned, on_the_block

DEG, MM, KPA = np.pi / 180, 1e-3, 1e3
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
STEP = 1e-30
BISECTIONS = 46
# Radii at which a tube is looked at that carries more than the pressure at a small one.
GRID = 60
BALLOON = 2.5
# Places on either side of a band of play at which the moment's sign is looked at.
SCANNED = 4

Array = np.ndarray[Any, Any]
Effects = Mapping[str, Mapping[str, float]]
# What an effect outside the library does: (state dictionary in SI, loads (N, 2)) → loads (N, 2).
Extra = Callable[[dict[str, Array], Array], Array]
# What a mounted actuator hands on: (states in SI, C1, C2, effects) → loads (N, 2), whether it has an equilibrium (N,).
Rig = Callable[[dict[str, Array], float, float, Effects], tuple[Array, Array]]

# Γ [deg], L, R_i, R_o [mm] of the paper's eight samples (its table of dimensions).
SAMPLES = {
    1: (15.0, 90.48, 4.77, 6.13),
    2: (25.0, 120.52, 4.77, 6.62),
    3: (36.0, 98.42, 4.77, 6.74),
    4: (40.0, 90.48, 4.77, 6.13),
    5: (50.0, 120.40, 4.77, 6.41),
    6: (62.0, 99.00, 4.77, 6.36),
    7: (73.0, 128.90, 4.77, 6.40),
    8: (76.0, 103.22, 4.77, 6.18),
}


def rubber_energy(i1: Array, i2: Array, c1: float, fx: Effects) -> Array:
    """The rubber's part of Ψ [Pa]."""

    def get(name: str, p: str) -> float:
        return fx.get(name, {}).get(p, 0.0)

    beta = get("limited_extensibility", "beta")
    psi = c1 / 2 * (i1 - 3) if beta == 0 else -c1 / (2 * beta) * np.log(1 - beta * (i1 - 3))
    psi = psi + get("second_invariant", "C01") / 2 * (i2 - 3) + get("wall_stiffening", "C20") * (i1 - 3) ** 2
    if logarithmic := get("second_invariant_log", "modulus"):
        psi = psi + 1.5 * logarithmic * np.log(i2 / 3)
    if lost := get("small_strain_stiffness", "modulus"):
        decay = get("small_strain_stiffness", "decay")
        psi = psi + lost / (2 * decay) * (1 - np.exp(-decay * (i1 - 3)))
    return psi


def fiber_energy(i1: Array, i4: Array, c2: float, fx: Effects) -> Array:
    """The part of Ψ [Pa] that belongs to one family of fibers."""

    def get(name: str, p: str) -> float:
        return fx.get(name, {}).get(p, 0.0)

    k2, kappa = get("fiber_stiffening", "k2"), get("fiber_dispersion", "kappa")
    stretch = kappa * (i1 - 3) + (1 - 3 * kappa) * (i4 - 1)
    psi = c2 / 2 * stretch**2 if k2 == 0 else c2 / (2 * k2) * (np.exp(k2 * stretch**2) - 1)
    slack = np.where(i4.real < 1, i4 - 1, 0)
    return psi - get("fiber_tension_only", "share") * c2 / 2 * slack**2


def wall_energy(
    length: Array,
    twist: Array,
    u: Array,
    gammas: Sequence[Array],
    reference: Array,
    inner: Array,
    outer: Array,
    left: Array,
    c1: float,
    c2: float,
    fx: Effects,
) -> Array:
    """W [J] of N tubes of inner radius √u, (N,), complex. gammas: of each family of fibers, NaN where a tube lacks it;
    left: share of its stresses that the wall still has."""
    half = (outer - inner) / 2
    radius = inner[:, None] + half[:, None] * (1 + NODES)
    axial, rate = (length / reference)[:, None], (twist / reference)[:, None]
    square = (radius**2 - inner[:, None] ** 2) / axial + u[:, None]
    rr = (radius / axial) ** 2 / square
    hoop = square * (1 / radius**2 + rate**2)
    i1 = rr + hoop + axial**2
    # I₂ = (I₁² − tr B²)/2, written out.
    theta_z = square * rate**2 * axial**2
    i2 = (i1**2 - (rr**2 + hoop**2 + axial**4 + 2 * theta_z)) / 2
    # Past the chains' full extension (Gent) the energy does not exist: bisection takes NaN for too far out.
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        psi = rubber_energy(i1, i2, c1, fx)
        for gamma in gammas:
            sine, cosine = np.sin(gamma)[:, None], np.cos(gamma)[:, None]
            i4 = square * (sine / radius + rate * cosine) ** 2 + (axial * cosine) ** 2
            psi = psi + np.where(np.isnan(gamma)[:, None], 0.0, fiber_energy(i1, i4, c2, fx))
        wall = reference * half * ((psi * 2 * np.pi * radius) @ WEIGHTS)
    bladder = liner_energy(length, twist, u, reference, inner, fx.get("bladder_stiffness", {}).get("stiffness", 0.0))
    return np.asarray(left * (wall + bladder))


def ideal_loads(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array]:
    """Loads (N, 2) of the bare actuator and whether it has an equilibrium, (N,)."""
    u, balanced, design = inflated(s, c1, c2, fx)
    s = built(s, fx)
    length, twist, pressure = s["length"], s["twist"], s["pressure"]

    def potential(at_length: Array, at_twist: Array) -> Array:
        return wall_energy(at_length, at_twist, u + 0j, *design) - pressure * np.pi * u * at_length

    force = -potential(length + 1j * STEP, twist).imag / STEP
    moment = -potential(length + 0j, twist + 1j * STEP).imag / STEP
    return np.stack([force, moment], axis=1), balanced


def inflated(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array, tuple[Any, ...]]:
    """Inner radius squared (N,) m², whether it is an equilibrium (N,), and what `wall_energy` asks of the design."""
    s = built(s, fx)
    length = s["length"]
    gammas = [s[name] for name in ("gamma", "gamma2") if name in s]
    design = (gammas, s["reference"], s["inner"], s["outer"], wall_share(s, fx), c1, c2, fx)
    twist, pressure = s["twist"], s["pressure"]
    low, high = (0.3 * s["inner"]) ** 2, (BALLOON * s["inner"]) ** 2

    def excess(u: Array) -> Array:
        slope = wall_energy(length, twist, u + 1j * STEP, *design).imag / STEP
        return slope / (np.pi * length) - pressure

    below = excess(low) < 0
    if not below.all():
        # Pushed together, a tube carries least somewhere in between, and rests outward of there.
        tried = np.linspace(low, high, GRID)
        carried = np.nan_to_num([excess(u) for u in tried], nan=np.inf)
        low = np.where(below, low, tried[carried.argmin(axis=0), np.arange(len(low))])
    balanced = (excess(low) < 0) & ~(excess(high) <= 0)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        above = ~(excess(middle) <= 0)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return (low + high) / 2, balanced, design


def outer_diameter(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> Array:
    """Outer diameter (N,) m: the wall keeps its volume."""
    u, _, _ = inflated(s, c1, c2, fx)
    s = built(s, fx)
    return np.asarray(2 * np.sqrt(u + (s["outer"] ** 2 - s["inner"] ** 2) * s["reference"] / s["length"]))


def built(s: dict[str, Array], fx: Effects) -> dict[str, Array]:
    """The actuators as they really were made and clamped."""
    clamped = 2 * fx.get("end_clamps", {}).get("clamp_length", 0.0)
    turned = fx.get("fiber_misalignment", {}).get("angle", 0.0)
    # A braid's families stay mirror images of each other.
    second = {"gamma2": s["gamma2"] + np.sign(s["gamma"] * s["gamma2"]) * turned} if "gamma2" in s else {}
    return s | {
        "gamma": s["gamma"] + turned,
        **second,
        "outer": s["outer"] + fx.get("wall_thickness", {}).get("outer_radius", 0.0),
        "reference": s["reference"] - clamped,
        "length": s["length"] - clamped,
    }


def wall_share(s: dict[str, Array], fx: Effects) -> Array:
    """Share of the stresses that relaxation and stress softening leave the wall, (N,). The fluid keeps its pressure."""
    left = np.ones(len(s["length"]))
    if "relaxation" in fx:
        left -= fx["relaxation"]["share"] * (1 - np.exp(-s["dwell"] / fx["relaxation"]["time"]))
    if "stress_softening" in fx:
        below = (s["past_severity"] - s["severity"]) / fx["stress_softening"]["severity"]
        left *= 1 - fx["stress_softening"]["depth"] * np.tanh(below)
    return left


def handed_on(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array]:
    """Loads (N, 2) that actuators hand on at the states that they take, their ends and friction included, and
    equilibrium, (N,)."""
    loads, balanced = ideal_loads(s, c1, c2, fx)
    rub = fx.get("friction_hysteresis", {})
    friction = s["direction"][:, None] * np.array([rub.get("force", 0.0), rub.get("moment", 0.0)])
    ends = tapered(s, fx, BLUNT) + unfilled(s, fx) + jammed(s, fx)
    return loads + ends - friction - driven(s, fx) - contact(s, fx, s["direction"]), balanced


def driven(s: dict[str, Array], fx: Effects) -> Array:
    """Friction (N, 2) of threads that slide as the bed drives them, until the pressure does."""
    p = fx.get("motion_friction")
    if p is None:
        return np.zeros(2)
    way = np.sign(np.stack([s["moved_length"], s["moved_twist"]], axis=1)) * (s["direction"] == 0)[:, None]
    return np.asarray(way * [p["force"], p["moment"]])


def at_rest(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> Array:
    """Twist (N,) at which actuators rest that may turn freely by ±w about the rig's: where |M| is least.

    The band is scanned outwards from its middle, first the way the moment drives, for a change of the moment's sign,
    which is then bisected; without one it is the end with the smaller moment.
    """
    w = fx["twist_slack"]["angle"]

    def moment(twist: Array, rows: Array) -> Array:
        part = {name: value[rows] for name, value in s.items()}
        return handed_on(part | {"twist": twist}, c1, c2, fx)[0][:, 1]

    everyone = np.arange(len(s["twist"]))
    middle = moment(s["twist"], everyone)
    side = np.where(middle >= 0, 1.0, -1.0)
    low = np.full(len(side), np.nan)
    high, ends = low.copy(), []
    for way in (side, -side):
        before, at = middle, s["twist"]
        for part in np.linspace(0, 1, SCANNED + 1)[1:]:
            place = s["twist"] + part * w * way
            value = moment(place, everyone)
            new = (before * value <= 0) & np.isnan(low)
            low, high = np.where(new, at, low), np.where(new, place, high)
            before, at = value, place
        ends.append(np.abs(before))
    rest = s["twist"] + w * np.where(ends[1] < ends[0], -side, side)
    rows = np.flatnonzero(~np.isnan(low))
    low, high, sign = low[rows], high[rows], np.sign(moment(low[rows], rows))
    for _ in range(BISECTIONS - 10):
        half = (low + high) / 2
        same = sign * moment(half, rows) > 0
        low, high = np.where(same, half, low), np.where(same, high, half)
    rest[rows] = (low + high) / 2
    return rest


def on_the_rig(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array]:
    """Loads (N, 2) of actuators that have taken up the play of their mount, and equilibrium, (N,)."""
    s = beyond_threshold(moved_on(s, fx), fx)
    taken = s | {"twist": at_rest(s, c1, c2, fx)} if "twist_slack" in fx else s
    loads, balanced = handed_on(taken, c1, c2, fx)
    return bent(loads, s, fx), balanced


def bed_loads(
    s: dict[str, Array], c1: float, c2: float, fx: Effects, extra: Extra | None = None, rig: Rig = on_the_rig
) -> tuple[Array, Array]:
    """Loads that the sensors show without noise (N, 2), with all effects, and whether there is an equilibrium.

    rig: how mounted actuators behave; here in the package's formulas, see `literature` for the literature's forms.
    """

    def get(name: str, p: str) -> float:
        return fx.get(name, {}).get(p, 0.0)

    t = dict(s)
    t["length"] = s["length"] + get("length_offset", "length")
    t["twist"] = s["twist"] + get("twist_offset", "angle")
    t["pressure"] = s["pressure"] * (1 + get("pressure_gain", "gain")) + get("pressure_offset", "pressure")
    t["pressure"] = t["pressure"] - get("pressure_hysteresis", "pressure") * s["direction"]

    def carried() -> tuple[Array, Array]:
        loads, balanced = rig(leaned(t, fx), c1, c2, fx)
        return on_the_block(loads, t, fx), balanced

    soft_l, soft_t = get("length_compliance", "compliance"), get("twist_compliance", "compliance")
    loads, balanced = carried()
    if soft_l or soft_t:
        length, twist = t["length"], t["twist"]
        for _ in range(60):
            t["length"], t["twist"] = length + soft_l * loads[:, 0], twist + soft_t * loads[:, 1]
            before = loads
            loads, balanced = carried()
            if np.abs(loads - before).max() < 1e-9:
                break
    if extra:
        loads = extra(s, loads)
    force, moment = loads.T
    shown = (
        force + get("sensor_crosstalk", "moment_into_force") * moment,
        moment + get("sensor_crosstalk", "force_into_moment") * force,
    )
    force = shown[0] * (1 + get("force_gain", "gain")) + get("force_offset", "force")
    moment = shown[1] * (1 + get("moment_gain", "gain")) + get("moment_offset", "moment")
    force = force + get("sensor_drift", "force_rate") * s["clock"]
    moment = moment + get("sensor_drift", "moment_rate") * s["clock"]
    return np.stack([force, moment], axis=1), balanced


def nominal(samples: Sequence[int], share: float, generator: np.random.Generator) -> pd.DataFrame:
    """The paper's protocol for some samples; about `share` of each one's kinematic states, in random order."""
    elongation, twist = np.meshgrid(np.arange(-5.0, 6.0), np.r_[-120:0:10, -1, 1, 10:130:10].astype(float))
    places = np.stack([elongation.ravel(), twist.ravel()], axis=1)
    pressure = np.r_[np.linspace(0, 72.5, 8), 36.25, 0.0]
    parts = []
    for n in samples:
        chosen = generator.permutation(len(places))[: max(4, int(share * len(places)))]
        gamma, reference, inner, outer = SAMPLES[n]
        part = pd.DataFrame(
            {
                "sample": n,
                "gamma_deg": gamma,
                "length_mm": reference,
                "inner_radius_mm": inner,
                "outer_radius_mm": outer,
                "step": np.tile(np.arange(10), len(chosen)),
                "elongation_mm": np.repeat(places[chosen, 0], 10),
                "twist_deg": np.repeat(places[chosen, 1], 10),
                "pressure_kpa": np.tile(pressure, len(chosen)),
            }
        )
        # 20 readings at 1 Hz a row, and a pause of 10 s between kinematic states.
        part["time_s"] = 20.0 * np.arange(len(part)) + 10.0 * np.repeat(np.arange(len(chosen)), 10)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def state_of(table: pd.DataFrame) -> dict[str, Array]:
    """SI arrays of a table of whole kinematic states, in time order; each state begins with its row of step 0."""

    def column(name: str, factor: float = 1.0) -> Array:
        return np.asarray(table[name], dtype=float) * factor

    step, time = column("step"), column("time_s")
    change = np.diff(column("pressure_kpa"), prepend=0.0)
    s = {
        "sample": column("sample"),
        "gamma": column("gamma_deg", DEG),
        **({"gamma2": column("gamma2_deg", DEG)} if "gamma2_deg" in table else {}),
        "reference": column("length_mm", MM),
        "inner": column("inner_radius_mm", MM),
        "outer": column("outer_radius_mm", MM),
        "length": column("length_mm", MM) + column("elongation_mm", MM),
        "twist": column("twist_deg", DEG),
        "pressure": column("pressure_kpa", KPA),
        "direction": np.where(step == 0, 0.0, np.sign(change)),
        "clock": time,
        "dwell": time - time[np.maximum.accumulate(np.where(step == 0, np.arange(len(step)), 0))],
    }
    s["severity"], s["past_severity"] = severity(s)
    s["moved_length"], s["moved_twist"] = moves(s)
    return s


def severity(s: dict[str, Array]) -> tuple[Array, Array]:
    """How hard each row works the wall, and the largest value so far on its sample: a definition, so shared with the
    package's States. The energy of a thin tube of the mean radius, over half its shear modulus (1 MPa, the fibers 30
    times stiffer), at the hoop stretch where it balances the pressure, which is found by bisection."""
    radius, wall = (s["inner"] + s["outer"]) / 2, s["outer"] - s["inner"]
    axial, shear = s["length"] / s["reference"], radius * s["twist"] / s["reference"]

    def energy(square: Array) -> Array:
        stored = 1 / (axial**2 * square) + square * (1 + shear**2) + axial**2 - 3
        for gamma in (s[name] for name in ("gamma", "gamma2") if name in s):
            fiber = square * (np.sin(gamma) + shear * np.cos(gamma)) ** 2 + (axial * np.cos(gamma)) ** 2
            stored = stored + np.where(np.isnan(gamma), 0.0, 30 * (fiber - 1) ** 2)
        return np.asarray(stored)

    low, high = np.full(len(radius), 0.05), np.full(len(radius), 9.0)
    for _ in range(BISECTIONS + 10):
        middle = (low + high) / 2
        pull = energy(middle + 1j * STEP).imag / STEP - s["pressure"] * radius * axial / wall / 1e6
        low, high = np.where(pull < 0, middle, low), np.where(pull < 0, high, middle)
    now = energy((low + high) / 2)
    past = np.concatenate([np.maximum.accumulate(now[s["sample"] == n]) for n in dict.fromkeys(s["sample"])])
    return now, past


def measure(
    samples: Sequence[int],
    c1: float,
    c2: float,
    fx: Effects,
    accuracy: Mapping[str, float],
    seed: int,
    share: float = 0.5,
    extra: Extra | None = None,
) -> pd.DataFrame:
    """A measurement table with noise; rows without an equilibrium are marked as buckled."""
    generator = np.random.default_rng(seed)
    table = nominal(samples, share, generator)
    actual = table.copy()
    states = len(table) // 10
    actual["elongation_mm"] += np.repeat(generator.normal(0, accuracy["elongation_mm"], states), 10)
    actual["twist_deg"] += np.repeat(generator.normal(0, accuracy["twist_deg"], states), 10)
    s = state_of(table) | {n: v for n, v in state_of(actual).items() if n in ("length", "twist")}
    loads, balanced = bed_loads(s, c1, c2, fx, extra)
    table["pressure_kpa"] += generator.normal(0, accuracy["pressure_kpa"], len(table))
    table["force_n"] = loads[:, 0] + generator.normal(0, accuracy["force_n"], len(table))
    table["moment_nmm"] = loads[:, 1] / MM + generator.normal(0, accuracy["moment_nmm"], len(table))
    table["buckled"] = (~balanced).astype(int)
    return table
