"""What a table of specimen tests must hold, the faults of one that does not, and numbers that look wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

import numpy as np
import pandas as pd

from freelearn.measurements.faults import Fault, Rule, faults_by_rules, no_number
from freelearn.measurements.specimen_modes import MODE_NAMES

COLUMNS = ("mode", "stretch", "stress_mpa")
# No rubber carries this much nominal stress [MPa]; soft silicones in kPa do exceed it.
LARGEST_MPA = 100.0
# Rubber tears before it is ten times its length.
LARGEST_STRETCH = 12.0
# Stresses beyond this share of the largest have a sign that noise does not turn.
CLEAR = 0.1

RULES = (
    Rule("stretch", ("stretch",), no_number("stretch"), ""),
    Rule("stress_mpa", ("stress_mpa",), no_number("stress_mpa"), ""),
    Rule("mode", ("mode",), lambda t: t["mode"].isna(), f"is no mode: write {', '.join(MODE_NAMES)}"),
    Rule(
        "stretch",
        ("stretch",),
        lambda t: t["stretch"] <= 0,
        "is not positive: give the length over the unloaded length, 1 at rest (strain + 1)",
    ),
)


def find_faults(table: pd.DataFrame, text: Mapping[str, Sequence[str]], line: int, mode: str | None) -> list[Fault]:
    """Every fault of a file's columns and rows, at most one for each cell, in the order of the file.

    table: those of COLUMNS that exist, None or NaN where a cell is no mode or no number; its index is the line in
    the file. text: every column's cells as they stand in the file. line: the header's. mode: what all rows must have.
    """
    rules = list(RULES)
    if mode is not None and "mode" in text:
        problem = f"is not {mode}, the mode that the command gives this file: correct one of the two"
        rules.append(Rule("mode", ("mode",), lambda t: t["mode"] != mode, problem))
    columns: dict[str, tuple[str | None, bool]] = {c: (None if c == "mode" else "float64", True) for c in COLUMNS}
    return faults_by_rules(table, text, line, rules, columns, _missing)


def _missing(name: str, header: Sequence[str]) -> str:
    """What to do about a missing column: names the one that was probably meant."""
    spare = {column.lower(): column for column in header if column not in COLUMNS}
    near = get_close_matches(name, spare, n=1, cutoff=0.6)
    if near:
        return f"column is missing: rename {spare[near[0]]!r} to it"
    if name == "mode":
        return "column is missing: add it, or give the file as UT=FILE, ET=FILE or PS=FILE"
    return "column is missing: add it"


def suspicions(table: pd.DataFrame) -> list[str]:
    """A sentence for each mode whose numbers suggest another unit or sign; nothing is converted."""
    sentences = []
    for mode, rows in table.groupby("mode", sort=False):
        stretch, stress = rows["stretch"], rows["stress_mpa"]
        largest = stress.abs().max()
        if largest > LARGEST_MPA:
            unit, factor = ("Pa", 1e-6) if largest > 1e4 else ("kPa", 1e-3)
            sentences.append(
                f"stress_mpa of mode {mode} looks like {unit} (largest {largest:.4g}, more than rubber carries): "
                f"in MPa it would be {factor * largest:.4g}."
            )
        if stretch.max() > LARGEST_STRETCH:
            sentences.append(
                f"stretch of mode {mode} looks like percent (largest {stretch.max():.4g}): at rest it is 1."
            )
        wrong = (np.sign(stretch - 1) * stress < -CLEAR * largest).sum()
        if wrong:
            sentences.append(
                f"{wrong} rows of mode {mode} are in tension below stretch 1 or in compression above it: "
                "look whether stretch holds strains, or the stress has the other sign."
            )
    return sentences
