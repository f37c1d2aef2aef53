"""By how much each combination of energy effects brings the error down, fitted and held out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from freelearn.fitting.rubber_fit import fit_rubber
from freelearn.physics.models.rubber import Rubber, isotropic_effects

NEO_HOOKEAN = "neo-Hookean"
# Errors that differ by less than this share are as good as each other.
CLOSE = 0.1
# Most effects together: of three and more, fitted to two or three modes, none has predicted another mode better.
MOST_TERMS = 2
# How many of those that predict worse are told.
TOLD = 3


def compare(table: pd.DataFrame, modes: Sequence[str]) -> pd.DataFrame:
    """Fits the neo-Hookean rubber with each isotropic effect and each pair of them, to all modes and to all but one.

    One row for each combination, held-out mode ("" for none) and mode: effects, held_out, mode, error, fitted, n;
    error as in ModeError. Nothing is held out where there is one mode only.
    """
    names = isotropic_effects()
    wanted = [list(c) for size in range(MOST_TERMS + 1) for c in combinations(names, size)]
    rows = []
    for effects in wanted:
        for held_out in ["", *modes] if len(modes) > 1 else [""]:
            fitted = fit_rubber(Rubber(effects), table, [held_out] if held_out else [])
            for mode, e in fitted.modes.items():
                row = {"effects": " ".join(effects) or NEO_HOOKEAN, "held_out": held_out, "mode": mode}
                rows.append({**row, "error": e.error, "fitted": e.fitted, "n": e.n})
    return pd.DataFrame(rows)


def held_out_errors(compared: pd.DataFrame) -> pd.Series:
    """Error over modes held out by combination of effects: root mean square, each mode counting alike.

    compared: of `compare`. Empty where nothing was held out.
    """
    apart = compared[compared["held_out"] == compared["mode"]]
    return apart.groupby("effects", sort=False)["error"].agg(lambda e: float((e**2).mean() ** 0.5))


def asked_for(error: pd.Series) -> pd.Series:
    """The errors, least first, of the combinations that tests ask for: those with the fewest effects of the good ones.

    error: of `held_out_errors`. Good are those within a tenth of the least: more terms always fit better.
    """
    good = error[error <= (1 + CLOSE) * error.min()]
    count = _effects(good)
    return good[count == count.min()].sort_values()


def conclusion(compared: pd.DataFrame) -> str:
    """Which energy terms the tests ask for, in a sentence: those that predict modes which they were not fitted to."""
    error = held_out_errors(compared)
    if not len(error):
        return "One mode alone cannot tell energy terms apart: add tests in another mode."
    chosen, plain = asked_for(error), error[NEO_HOOKEAN]
    if NEO_HOOKEAN in chosen:
        return f"These tests ask for no more than the neo-Hookean wall: {100 * plain:.1f} % on modes held out."
    names = " or ".join(f"{' + '.join(name.split())} ({100 * e:.1f} %)" for name, e in chosen.items())
    said = f"These tests ask for {names}: on modes held out the error falls from {100 * plain:.1f} % to that."
    worse = error[(_effects(error) > _effects(chosen).min()) & (error > (1 + CLOSE) * error.min())]
    if len(worse):
        some = ", ".join(f"{' + '.join(name.split())} {100 * e:.1f} %" for name, e in worse.nsmallest(TOLD).items())
        said += f" More terms fit better and predict worse: {some}."
    return said


def best_effects(compared: pd.DataFrame) -> tuple[str, ...]:
    """The effects that the tests ask for most, () for the neo-Hookean wall, or where one mode alone was measured."""
    error = held_out_errors(compared)
    if not len(error):
        return ()
    chosen = asked_for(error)
    return () if NEO_HOOKEAN in chosen else tuple(str(chosen.index[0]).split())


def _effects(error: pd.Series) -> np.ndarray:
    """How many effects each combination has."""
    return np.array([0 if name == NEO_HOOKEAN else len(str(name).split()) for name in error.index])
