"""Logs of a bed apart from the package: effects of the history by small steps of explicit integration, NumPy only.

The loads of every instant are those of `numpy_peer.continuum`; what has a memory goes on by STEPS small steps between
two rows of the log, element by element. Nothing of freelearn's scans or closed forms is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import erf
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference.numpy_peer import continuum
from freelearn.testing.reference.total_energy import SAMPLES
from freelearn.testing.reference.total_energy import severity as tube_severity

Array = np.ndarray[Any, Any]
Effects = Mapping[str, Mapping[str, float]]

DEG, MM, KPA = np.pi / 180, 1e-3, 1e3
# Small steps from one row of the log to the next; elements of a distribution of friction.
STEPS, ELEMENTS = 40, 60
# Arms of the wall's relaxation, each beside the others.
ARMS = ("creep", "second_creep", "third_creep")
# What fits the paper's samples [Pa].
C1, C2 = 1e6, 4e7
# One standard deviation of the paper's bed: once for each recording [mm, °], and in each row [kPa, N, N·mm].
POSITION, SENSORS = (0.073, 0.175), (0.15, 0.03, 0.6)
# Noticeable effects, SI.
UNIT: dict[str, dict[str, float]] = {
    "maxwell_slip": {"share": 0.5, "force": 2.0, "moment": 0.01, "asymmetry": 0.0},
    "contact_slip": {"share": 0.5, "force": 0.01, "moment": 0.01},
    "creep": {"share": 0.2, "time": 3.0},
    "supply_lag": {"time": 0.15},
    "dead_time": {"delay": 0.15},
    "sensor_lag": {"force": 0.15, "moment": 0.15},
    "valve_flow": {"squared_resistance": 1e10, "critical": 0.3},
    "gas_warming": {"time": 0.3, "cooling": 1.0},
    "inertia": {"force": 0.5, "moment": 0.5, "damping": 0.2},
    "stress_softening": {"depth": 0.2, "severity": 0.02},
}
# Noticeable effects without a memory, and what is in no library: a wall that softens as it is worked, by a share where
# the pressure has changed by RATE [kPa/s] for long, and gets over it in COOLS [s].
STATIC: dict[str, dict[str, float]] = {
    "pressure_gain": {"gain": 0.02},
    "length_offset": {"length": 2e-4},
    "force_offset": {"force": 0.1},
    "force_gain": {"gain": 0.02},
    "moment_gain": {"gain": 0.02},
}
UNKNOWN: dict[str, dict[str, float]] = {"warming": {"share": 0.1}}
RATE, COOLS = 20.0, 4.0
# What drifts over a session, by how it does: an amount times a function of the share of the session that is over.
SHAPES: dict[str, Callable[[Array], Array]] = {
    "linear": lambda u: u,
    "settling": lambda u: 1 - np.exp(-5 * u),
    "step": lambda u: np.where(u < 0.5, 0.0, 1.0),
    "wave": lambda u: np.sin(2 * np.pi * u),
}
DRIFTING: dict[str, dict[str, float]] = {
    f"{what}, {shape}": {amount: value}
    for what, (amount, value) in {
        "drifting force gain": ("gain", 0.02),
        "drifting force zero": ("force", 0.1),
        "drifting stiffness": ("share", 0.05),
    }.items()
    for shape in SHAPES
}


def log(
    effects: Effects,
    seed: int,
    samples: tuple[int, ...] = (4,),
    recordings: int = 10,
    rate: float = 5.0,
    seconds: float = 20.0,
    noise: float = 1.0,
    memory: float = 0.0,
    moves: bool = True,
) -> pd.DataFrame:
    """A measurement table of recordings in which the pressure ramps, holds and turns, at a held length and twist or,
    in every other one, while these move too.

    effects: hidden ones by name with their parameters, SI. rate: rows a second. noise: times the paper's. memory:
    correlation of the noise of two rows that follow each other. moves: whether length and twist move in any.
    """
    generator = np.random.default_rng(seed)
    parts = []
    for sample in samples:
        worst = 0.0
        for run in range(1, recordings + 1):
            count = int(rate * seconds)
            fine = np.arange((count - 1) * STEPS + 1) / (rate * STEPS)
            shown = pressures(fine, seconds, generator)
            place = (
                bent(fine, seconds, 4.0, moves and run % 2 == 0, generator),
                bent(fine, seconds, 90.0, moves and run % 2 == 0, generator),
            )
            over = (run - 1 + fine / seconds) / recordings
            part, worst = _recorded(sample, run, place, fine, shown, effects, worst, over, noise, memory, generator)
            parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _recorded(
    sample: int,
    run: int,
    place: tuple[Array, Array],
    fine: Array,
    shown: Array,
    effects: Effects,
    worst: float,
    over: Array | float,
    noise: float,
    memory: float,
    generator: np.random.Generator,
) -> tuple[pd.DataFrame, float]:
    """The rows of one recording as the sensors read them, and the largest severity by its end. place, shown: elongation
    [mm] and twist [°], and pressure [kPa], at the fine instants."""
    gamma, length, inner, outer = SAMPLES[sample]
    time = fine[::STEPS]
    loads, worst = carried(sample, place, fine, shown * KPA, effects, worst, over)
    loads = loads[::STEPS]
    errors = [_noise(len(time), memory, generator) * noise * size for size in SENSORS]
    off = [noise * size * generator.normal() for size in POSITION]
    part = pd.DataFrame(
        {
            "sample": sample, "gamma_deg": gamma, "length_mm": length, "inner_radius_mm": inner,
            "outer_radius_mm": outer, "step": np.arange(len(time)), "elongation_mm": place[0][::STEPS] + off[0],
            "twist_deg": place[1][::STEPS] + off[1], "pressure_kpa": shown[::STEPS] + errors[0],
            "force_n": loads[:, 0] + errors[1], "moment_nmm": 1e3 * loads[:, 1] + errors[2],
            "buckled": 0, "time_s": time, "run": run,
        }
    )  # fmt: skip
    return part, worst


def measured(planned: pd.DataFrame, effects: Effects, seed: int, noise: float = 1.0) -> pd.DataFrame:
    """A log that somebody planned, as the bed then measures it: straight from row to row, at even times."""
    generator, parts = np.random.default_rng(seed), []
    for run, rows in planned.groupby("run", sort=False):
        time = rows["time_s"].to_numpy()
        fine = np.linspace(time[0], time[-1], (len(time) - 1) * STEPS + 1)
        first, second, shown = (
            np.interp(fine, time, rows[name].to_numpy()) for name in ("elongation_mm", "twist_deg", "pressure_kpa")
        )
        sample = int(rows["sample"].iloc[0])
        part, _ = _recorded(sample, int(run), (first, second), fine, shown, effects, 0.0, 0.0, noise, 0.0, generator)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def pressures(time: Array, seconds: float, generator: np.random.Generator) -> Array:
    """Ramps of several rates with holds between them, from rest: (n,) kPa."""
    corners, values, now = [0.0, 0.5], [0.0, 0.0], 0.5
    while now < seconds:
        ramp = float(generator.choice([0.4, 1.0, 2.5]))
        hold = float(generator.choice([0.0, 0.5, 2.0]))
        level = float(generator.uniform(0.0, 70.0))
        corners += [now + ramp, now + ramp + hold + 1e-6]
        values += [level, level]
        now += ramp + hold + 1e-6
    found: Array = np.interp(time, corners, values)
    return found


def bent(time: Array, seconds: float, most: float, moves: bool, generator: np.random.Generator) -> Array:
    """A length or twist (n,), held or going to another one and back on slow ramps, within ± most."""
    one, other = generator.uniform(-most, most, 2)
    corners = np.sort(generator.uniform(0.1, 0.9, 4)) * seconds
    found: Array = np.interp(time, corners, [one, other, other, one] if moves else [one] * 4)
    return found


def carried(
    sample: int,
    place: tuple[Array, Array],
    time: Array,
    pressure: Array,
    effects: Effects,
    worst: float = 0.0,
    over: Array | float = 0.0,
) -> tuple[Array, float]:
    """Force and moment, (n, 2) N, N·m, that the sensors show at fine instants, from the pressure shown (n,) Pa; and the
    largest severity that the rubber has been through by then. worst: by the time that the recording begins. over: share
    of the session that is over, (n,)."""
    gamma, length, inner, outer = SAMPLES[sample]
    dt = float(time[1] - time[0])

    def known(effect: str, p: str) -> float:
        return effects.get(effect, {}).get(p, 0.0)

    def drifted(what: str, p: str) -> Array | float:
        return sum(known(f"drifting {what}, {name}", p) * shape(np.asarray(over)) for name, shape in SHAPES.items())

    pressure = pressure * (1 + known("pressure_gain", "gain"))
    place = place[0] + known("length_offset", "length") / MM, place[1]
    if "supply_lag" in effects:
        pressure = late(pressure, effects["supply_lag"]["time"], dt)
    if "dead_time" in effects:
        pressure = np.interp(time - effects["dead_time"]["delay"], time, pressure)
    if "valve_flow" in effects:
        volume = np.pi * (inner * MM) ** 2 * length * MM
        p = effects["valve_flow"]
        pressure = _through_a_valve(pressure, p["squared_resistance"] ** 0.5 * volume, p["critical"], dt)
    if "gas_warming" in effects:
        pressure = _warmed(pressure, effects["gas_warming"]["time"], effects["gas_warming"]["cooling"], dt)
    arms = [(effects[name]["share"], effects[name]["time"]) for name in ARMS if name in effects]
    balanced = _crept(pressure, arms, dt) if arms else pressure
    same = np.ones_like(pressure)
    left = same
    if "stress_softening" in effects:
        left, worst = _worked(sample, place, pressure, worst, **effects["stress_softening"])
    force, moment = continuum(
        gamma * DEG * same, length * MM * same, inner * MM * same, outer * MM * same,
        (length + place[0]) * MM, place[1] * DEG, balanced, C1 * left * (1 + drifted("stiffness", "share")), C2 * left,
    )  # fmt: skip
    elastic = np.stack([force, moment], axis=1)
    loads = elastic + sum(share * _overstress(elastic, tau, dt) for share, tau in arms)
    if "maxwell_slip" in effects:
        p = effects["maxwell_slip"]
        mean = np.array([p["force"], p["moment"]])
        up, down = mean * (1 - p["asymmetry"]), mean * (1 + p["asymmetry"])
        loads = loads - p["share"] * _sticking(loads, np.tile(-down, (len(time), 1)), np.tile(up, (len(time), 1)))
    if "contact_slip" in effects:
        p = effects["contact_slip"]
        turn = place[1] * DEG + length / outer * np.tan(gamma * DEG)
        fiber = length / np.cos(gamma * DEG)
        radius = np.sqrt(fiber**2 - (length + place[0]) ** 2) / turn * MM
        pressed = pressure * 2 * np.pi * radius * (length + place[0]) * MM
        bound = np.stack([p["force"] * pressed, p["moment"] * pressed * radius], axis=1)
        loads = loads - p["share"] * _sticking(loads, -bound, bound)
    gain = np.array([known("force_gain", "gain"), known("moment_gain", "gain")])
    loads = loads * (1 + gain) + np.array([known("force_offset", "force"), 0.0])
    loads[:, 0] = loads[:, 0] * (1 + drifted("force gain", "gain")) + drifted("force zero", "force")
    if "warming" in effects:
        worked = np.abs(np.gradient(pressure, dt)) / (RATE * KPA)
        loads = loads * (1 - effects["warming"]["share"] * (late(worked, COOLS, dt) - worked[0]))[:, None]
    if "inertia" in effects:
        p = effects["inertia"]
        each = p["force"], p["moment"]
        loads = np.stack([swung(x, period, p["damping"], dt) for x, period in zip(loads.T, each, strict=True)], axis=1)
    if "sensor_lag" in effects:
        each = effects["sensor_lag"]["force"], effects["sensor_lag"]["moment"]
        loads = np.stack([late(x, tau, dt) for x, tau in zip(loads.T, each, strict=True)], axis=1)
    return loads, worst


def _worked(
    sample: int, place: tuple[Array, Array], pressure: Array, worst: float, depth: float, severity: float
) -> tuple[Array, float]:
    """What is left of the wall's stresses (n,), and the largest severity then: η = 1 − d erf((S_max − S)/m) of Ogden &
    Roxburgh (1999), their equation for 1/r = d, with the severity of a thin tube in the place of the energy; instant by
    instant."""
    gamma, length, inner, outer = SAMPLES[sample]
    same = np.ones_like(pressure)
    now, _ = tube_severity(
        {
            "sample": same, "gamma": gamma * DEG * same, "reference": length * MM * same, "inner": inner * MM * same,
            "outer": outer * MM * same, "length": (length + place[0]) * MM, "twist": place[1] * DEG,
            "pressure": pressure,
        }
    )  # fmt: skip
    found = np.empty_like(pressure)
    for n, severe in enumerate(now):
        worst = max(worst, float(severe))
        found[n] = 1 - depth * erf((worst - severe) / severity)
    return found, worst


def late(signal: Array, tau: float, dt: float) -> Array:
    """τ y' = x − y by Heun's method, in as many steps as a short lag needs."""
    y, found = float(signal[0]), np.empty_like(signal)
    found[0] = y
    parts = max(int(np.ceil(2 * dt / tau)), 1)
    h = dt / parts
    for n in range(1, len(signal)):
        for k in range(parts):
            x0, x1 = (signal[n - 1] + (signal[n] - signal[n - 1]) * (k + i) / parts for i in (0, 1))
            slope = (x0 - y) / tau
            there = (x1 - (y + h * slope)) / tau
            y += h * (slope + there) / 2
        found[n] = y
    return found


def swung(signal: Array, period: float, damping: float, dt: float) -> Array:
    """y with y'' + 2 ζ ω y' + ω² (y − x) = 0, by Heun's method in as many steps as a swing needs."""
    omega = 2 * np.pi / period
    parts = int(np.ceil(dt / (0.01 * period)))
    h = dt / parts
    y, v, found = float(signal[0]), 0.0, np.empty_like(signal)
    found[0] = y
    for n in range(1, len(signal)):
        for k in range(parts):
            x0, x1 = (signal[n - 1] + (signal[n] - signal[n - 1]) * (k + i) / parts for i in (0, 1))
            a0 = omega**2 * (x0 - y) - 2 * damping * omega * v
            y1, v1 = y + h * v, v + h * a0
            a1 = omega**2 * (x1 - y1) - 2 * damping * omega * v1
            y, v = y + h * (v + v1) / 2, v + h * (a0 + a1) / 2
        found[n] = y
    return found


def _through_a_valve(command: Array, time: float, critical: float, dt: float) -> Array:
    """Gauge pressure behind a valve with the flow of ISO 6358, by the midpoint rule. time: r V [s]."""
    air = 101_325.0

    def rate(p: float, u: float) -> float:
        high, low = max(p, u), min(p, u)
        sonic = max(low / high - critical, 0.0) / (1 - critical)
        return float(np.sign(u - p) * high * np.sqrt(max(1 - sonic**2, 0.0)) / time)

    parts = max(int(np.ceil(dt / (0.02 * time))), 1)
    h = dt / parts
    p, found = float(command[0]) + air, np.empty_like(command)
    found[0] = command[0]
    for n in range(1, len(command)):
        for k in range(parts):
            u = float(command[n - 1] + (command[n] - command[n - 1]) * (k + 0.5) / parts) + air
            p += h * rate(p + h / 2 * rate(p, u), u)
        found[n] = p - air
    return found


def _warmed(command: Array, time: float, cooling: float, dt: float) -> Array:
    """Gauge pressure of an ideal gas in a closed volume behind a line, by Heun's method on its mass and temperature.

    What comes in has the wall's temperature T₀, what goes out the gas's own; the flow is as u − p, and the gas is as
    warm as the wall but for 1/e after the cooling time."""
    gamma, air = 1.4, 101_325.0

    def rates(mass: float, warm: float, u: float) -> tuple[float, float]:
        # Mass in units of p V/(R T₀) [Pa], temperature in units of T₀: d(m T)/dt = γ m' T of what flows, less the heat.
        flow = (u - mass * warm) / time
        brought = flow * (1.0 if flow > 0 else warm)
        return flow, (gamma * brought - flow * warm) / mass - (warm - 1.0) / cooling

    parts = max(int(np.ceil(4 * dt / time)), 1)
    h = dt / parts
    mass, warm, found = float(command[0]) + air, 1.0, np.empty_like(command)
    found[0] = command[0]
    for n in range(1, len(command)):
        for k in range(parts):
            u0, u1 = (command[n - 1] + (command[n] - command[n - 1]) * (k + i) / parts + air for i in (0, 1))
            one = rates(mass, warm, float(u0))
            two = rates(mass + h * one[0], warm + h * one[1], float(u1))
            mass, warm = mass + h * (one[0] + two[0]) / 2, warm + h * (one[1] + two[1]) / 2
        found[n] = mass * warm - air
    return found


def _overstress(signal: Array, tau: float, dt: float) -> Array:
    """h' = x' − h/τ by the trapezoidal rule."""
    h, found = np.zeros_like(signal[0]), np.zeros_like(signal)
    for n in range(1, len(signal)):
        h = (h * (1 - dt / (2 * tau)) + signal[n] - signal[n - 1]) / (1 + dt / (2 * tau))
        found[n] = h
    return found


def _crept(pressure: Array, arms: list[tuple[float, float]], dt: float) -> Array:
    """The pressure x that an elastic wall balances: P = x + Σ g h[x], solved step by step. arms: g and τ."""
    x, found = float(pressure[0]), np.empty_like(pressure)
    found[0] = x
    each = [(share, 1 - dt / (2 * tau), 1 + dt / (2 * tau)) for share, tau in arms]
    h, stiff = [0.0] * len(arms), 1 + sum(share / above for share, _, above in each)
    for n in range(1, len(pressure)):
        kept = [(own * below - x) / above for own, (_, below, above) in zip(h, each, strict=True)]
        x = (pressure[n] - sum(share * own for own, (share, _, _) in zip(kept, each, strict=True))) / stiff
        h = [own + x / above for own, (_, _, above) in zip(kept, each, strict=True)]
        found[n] = x
    return found


def _sticking(loads: Array, low: Array, high: Array) -> Array:
    """Mean of ELEMENTS sliders on springs whose thresholds are exponentially distributed about these means."""
    ratio = -np.log(1 - (np.arange(ELEMENTS) + 0.5) / ELEMENTS)[:, None]
    z, found = np.zeros((ELEMENTS, 2)), np.zeros_like(loads)
    for n in range(1, len(loads)):
        z = np.clip(z + loads[n] - loads[n - 1], ratio * low[n], ratio * high[n])
        found[n] = z.mean(0)
    return found


def _noise(count: int, memory: float, generator: np.random.Generator) -> Array:
    """Normal noise of unit size (n,), of which two neighbors have this correlation."""
    white = generator.normal(size=count)
    for n in range(1, count):
        white[n] = memory * white[n - 1] + np.sqrt(1 - memory**2) * white[n]
    return white
