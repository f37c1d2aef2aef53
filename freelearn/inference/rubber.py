"""By how much each combination of energy effects brings the error down, fitted and held out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import pandas as pd

from freelearn.fit.rubber import fit_rubber
from freelearn.models.rubber import Rubber, isotropic_effects

NEO_HOOKEAN = "neo-Hookean"
# Errors that differ by less than this share are as good as each other.
CLOSE = 0.1


def compare(table: pd.DataFrame, modes: Sequence[str]) -> pd.DataFrame:
    """Fits the neo-Hookean rubber and every combination of the isotropic effects, to all modes and to all but one.

    One row for each combination, held-out mode ("" for none) and mode: effects, held_out, mode, error, fitted, n;
    error as in ModeError. Nothing is held out where there is one mode only.
    """
    names = isotropic_effects()
    wanted = [list(c) for size in range(len(names) + 1) for c in combinations(names, size)]
    rows = []
    for effects in wanted:
        for held_out in ["", *modes] if len(modes) > 1 else [""]:
            fitted = fit_rubber(Rubber(effects), table, [held_out] if held_out else [])
            for mode, e in fitted.modes.items():
                row = {"effects": " ".join(effects) or NEO_HOOKEAN, "held_out": held_out, "mode": mode}
                rows.append({**row, "error": e.error, "fitted": e.fitted, "n": e.n})
    return pd.DataFrame(rows)


def conclusion(compared: pd.DataFrame) -> str:
    """Which energy terms the tests ask for, in a sentence: those that predict modes which they were not fitted to.

    Of the combinations within a tenth of the least error over held-out modes (root mean square, each mode counting
    alike), those with the fewest effects. A better fit alone proves nothing: more terms always fit better.
    """
    apart = compared[compared["held_out"] == compared["mode"]]
    if not len(apart):
        return "One mode alone cannot tell energy terms apart: add tests in another mode."
    error = apart.groupby("effects", sort=False)["error"].agg(lambda e: float((e**2).mean() ** 0.5))
    count = error.index.map(lambda name: 0 if name == NEO_HOOKEAN else len(name.split()))
    good = error <= (1 + CLOSE) * error.min()
    fewest = count[good].min()
    chosen = error[good & (count == fewest)].sort_values()
    plain = error[NEO_HOOKEAN]
    if not fewest:
        return f"These tests ask for no more than the neo-Hookean wall: {100 * plain:.1f} % on modes held out."
    names = " or ".join(f"{' + '.join(name.split())} ({100 * e:.1f} %)" for name, e in chosen.items())
    said = f"These tests ask for {names}: on modes held out the error falls from {100 * plain:.1f} % to that."
    worse = error[(count > fewest) & ~good]
    if len(worse):
        said += " More terms fit better and predict worse: " + ", ".join(
            f"{' + '.join(name.split())} {100 * e:.1f} %" for name, e in worse.items()
        )
        said += "."
    return said
