"""Logs of a wall that relaxes in several times, by small steps of integration."""

import numpy as np
import pandas as pd

from freelearn.testing.reference.numpy_peer import continuum
from freelearn.testing.reference.simulated_logs import C1, C2, log
from freelearn.testing.reference.total_energy import state_of

# Steps of integration between two rows.
STEPS = 10


def relaxing_log(arms, seed, recordings, rate, seconds, noise=(0.0, 0.0)):
    """A measurement table. arms: τ [s] → share of the wall's stiffness at rest; rate: rows a second; noise: of the
    force [N] and of the moment [N·mm]."""
    dt, generator, parts = 1 / (rate * STEPS), np.random.default_rng(seed), []
    for _, own in log({}, seed, recordings=recordings, rate=rate * STEPS, seconds=seconds, noise=0.0).groupby("run"):
        s = state_of(own)
        size = (s["gamma"], s["reference"], s["inner"], s["outer"], s["length"], s["twist"])
        elastic = continuum(*size, balanced(s["pressure"], arms, dt), C1, C2)
        force, moment = (x + overstress(x, arms, dt) for x in elastic)
        own = own.assign(force_n=force, moment_nmm=1e3 * moment)[::STEPS]
        own[["force_n", "moment_nmm"]] += generator.normal(size=(len(own), 2)) * noise
        parts.append(own)
    return pd.concat(parts, ignore_index=True)


def overstress(signal, arms, dt):
    """Σ g h (n,), h' = x' − h/τ of arms τ → g, by the trapezoidal rule."""
    found = np.zeros_like(signal)
    for tau, share in arms.items():
        h = 0.0
        for n in range(1, len(signal)):
            h = (h * (1 - dt / (2 * tau)) + signal[n] - signal[n - 1]) / (1 + dt / (2 * tau))
            found[n] += share * h
    return found


def balanced(pressure, arms, dt):
    """x (n,) with x + Σ g h[x] = P, step by step."""
    taus, shares = np.array(list(arms)), np.array(list(arms.values()))
    above, h, x = 1 + dt / (2 * taus), np.zeros(len(arms)), np.array(pressure)
    for n in range(1, len(pressure)):
        kept = (h * (1 - dt / (2 * taus)) - x[n - 1]) / above
        x[n] = (pressure[n] - (shares * kept).sum()) / (1 + (shares / above).sum())
        h = kept + x[n] / above
    return x
