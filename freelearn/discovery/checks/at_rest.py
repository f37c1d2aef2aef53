"""Loads that are not zero where nothing pulls: the cell was not tared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from freelearn.common.formats import in_words
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import DEAD_LOAD, DEG, FORCE, MOMENT, bed_of
from freelearn.data.columns import SLACK, Columns
from freelearn.discovery.checks.plain_fit import Plain, PlainFit
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck

NAME = "loads at rest"
# Shares of the ranges within which a row counts as at rest, standard deviations, and the share of the largest load
# that a cell's zero, a mount and a length do not make; under a dead load the share of the length.
NEAR, SIGMAS, LARGE, LONG = 0.01, 5.0, 0.1, 0.08
# Without rows at rest: E that is worth a look, and how many times less it is with an offset.
DOUBTED, SEVERAL = 0.02, 1.8
# What a mount may be off by, SI, and in which unit it is told, a factor beside; and how many times the error of the one
# a rival may leave that is as good.
MOUNTED, ALIKE = {"length_offset": (2e-3, "mm", 1e3), "twist_offset": (0.2, "°", 1 / DEG)}, 1.05
EFFECTS = {"force_n": "force_offset", "moment_nmm": "moment_offset"}


def at_rest(plain: Plain, accuracy: Accuracy, better: float = 1.0) -> TableCheck:
    """Whether what was measured at the length and the angle of rest, without pressure, is zero. better: how many times
    less the model errs where a column is read otherwise: what that explains is no zero of the loads."""
    table, bed = plain.table, bed_of(plain.table)
    offered = [EFFECTS[q.column] for q in bed.measured if q.column in EFFECTS and table.get(q.column) is not None]
    if offered and set(offered) <= set(plain.given):
        return TableCheck(NAME, PASS, None, LARGE, "The loads' zeros are fitted.")
    rest = _resting(table, accuracy)
    if bed is DEAD_LOAD:
        return _places(table, rest)
    shares, parts, counts = [], [], [0]
    for quantity in bed.measured:
        if quantity not in (FORCE, MOMENT) or quantity.column not in table:
            continue
        values = table[quantity.column].to_numpy(np.float64)
        # A tube that hangs loose pulls at nothing either.
        loose = _slack(table) if quantity is FORCE else np.zeros(len(table), dtype=bool)
        there = values[(rest | loose) & np.isfinite(values)]
        if not len(there):
            continue
        zero, largest = float(np.median(there)), float(np.nanmax(np.abs(values)))
        sigma = getattr(accuracy, quantity.error) / quantity.factor
        share = abs(zero) / largest if largest > 0 else 0.0
        shares.append(share)
        counts.append(len(there))
        if share > LARGE and abs(zero) > SIGMAS * sigma:
            parts.append(f"{in_words(zero)} {quantity.unit} ({100 * share:.0f} % of the largest, stated {sigma:.2g})")
    if not shares:
        return _by_fit(plain, offered, better)
    if not parts:
        return TableCheck(NAME, PASS, max(shares), LARGE, "At rest the loads are next to nothing.")
    return TableCheck(
        NAME, FAIL, max(shares), LARGE, _untared(" and ".join(parts), max(counts)), _option(plain.given, offered)
    )


def _untared(read: str, count: int) -> str:
    rows = f"in {count} row{'' if count == 1 else 's'} at rest" if count else "by the fit"
    return (
        f"The load cell was not tared: it reads {read} {rows}, where nothing pulls; take that off every row, or let it "
        "be fitted."
    )


def _option(given: Sequence[str], offered: Sequence[str]) -> str:
    return f"effects=[{','.join(dict.fromkeys([*given, *offered]))}]"


def _resting(table: pd.DataFrame, accuracy: Accuracy) -> np.ndarray:
    """Rows with next to nothing imposed, (N,) bool."""
    stated = {"elongation_mm": 1e3 * accuracy.length, "twist_deg": np.degrees(accuracy.twist)}
    stated |= {"force_n": accuracy.force, "moment_nmm": 1e3 * accuracy.moment}
    rest: np.ndarray = np.ones(len(table), dtype=bool)
    for name in Columns.from_table(table).imposed:
        values = table[name].to_numpy(np.float64)
        within = max(
            NEAR * float(np.nanmax(np.abs(values), initial=0.0)), 3 * stated.get(name, 1e-3 * accuracy.pressure)
        )
        rest &= np.abs(values) <= within
    resting: np.ndarray = rest & ~_slack(table)
    return resting


def _slack(table: pd.DataFrame) -> np.ndarray:
    none = np.zeros(len(table), dtype=bool)
    marked: np.ndarray = table[SLACK].to_numpy(np.float64) == 1 if SLACK in table else none
    return marked


def _places(table: pd.DataFrame, rest: np.ndarray) -> TableCheck:
    """Under a dead load: a place at rest that is far from the length that was given."""
    if not rest.any() or "elongation_mm" not in table or table["elongation_mm"][rest].isna().all():
        return TableCheck(NAME, CANNOT, None, LONG, "No row is at rest: measure one without load and pressure.")
    zero, length = float(table["elongation_mm"][rest].median()), float(table.filter(like="length_mm").iloc[0, 0])
    share = abs(zero) / length
    if share <= LONG:
        return TableCheck(NAME, PASS, share, LONG, "At rest the tube is about as long as was said.")
    says = (
        f"At rest elongation_mm is {in_words(zero)} in {int(rest.sum())} rows, {100 * share:.0f} % of the length: its "
        "zero is not the length at rest; take it off, or correct length_mm."
    )
    return TableCheck(NAME, FAIL, share, LONG, says)


def _by_fit(plain: Plain, offered: Sequence[str], better: float) -> TableCheck:
    """Without rows at rest: whether an offset makes the model fit far better, and is far larger than a cell's."""
    why = "No row is at rest: measure one at the tube's own length, without twist and pressure."
    if not offered or plain.itself.E < DOUBTED:
        return TableCheck(NAME, PASS if plain.itself.E < DOUBTED else CANNOT, None, LARGE, why)
    found = plain.of(plain.table, offered)
    parts, shares = [], []
    for column, effect in EFFECTS.items():
        each = _of_each(found.values, f"{effect}.{'force' if column == 'force_n' else 'moment'}")
        if each:
            value = max(each, key=abs) * (1e3 if column == "moment_nmm" else 1.0)
            shares.append(abs(value) / max(float(_largest(plain.table, column)), 1e-300))
            if shares[-1] > LARGE:
                parts.append(f"{in_words(value)} {'N·mm' if column == 'moment_nmm' else 'N'}")
    # An offset above every reading, or a wall softer than any rubber, is a model that stands for something else.
    apt = max(shares, default=0.0) <= 1 and found.soft == 1.0
    if not parts or not apt or plain.itself.E / max(SEVERAL, better) < found.E:
        return TableCheck(NAME, CANNOT, max(shares, default=None), LARGE, why)
    says = _untared(" and ".join(parts), 0)
    if places := _mounted_elsewhere(plain, found):
        says += f" Or it was, and the mount is off by {places}, which does as well in these rows: measure one at rest."
    # Which of both it is the search tells better than errors of two fits do, where the rows tell at all.
    status = CANNOT if places else FAIL
    return TableCheck(NAME, status, max(shares), LARGE, says, _option(plain.given, offered))


def _mounted_elsewhere(plain: Plain, found: PlainFit) -> str:
    """By how much the place of rest would have to be off, in words, to do as well as the loads' zeros that were found,
    if mounts are off by so much: of stiff actuators a millimeter is a newton."""
    places = [name for name in MOUNTED if name not in plain.given]
    rival = plain.of(plain.table, places)
    if not places or rival.E > ALIKE * found.E:
        return ""
    parts = []
    for name, (most, unit, factor) in MOUNTED.items():
        each = _of_each(rival.values, f"{name}.")
        if max(map(abs, each), default=0.0) > most:
            return ""
        if each:
            parts.append(f"{in_words(factor * max(each, key=abs), 2)} {unit}")
    return " and ".join(parts)


def _of_each(values: Mapping[str, float], begins: str) -> list[float]:
    """A parameter's values: of several samples, which have their own, one for each."""
    return [value for label, value in values.items() if label.startswith(begins)]


def _largest(table: pd.DataFrame, column: str) -> float:
    """Largest size in a column."""
    return float(np.nanmax(np.abs(table[column].to_numpy(np.float64))))
