"""Whether the model fits far better where a column is read otherwise: signs, columns, units and lengths."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from freelearn.common.formats import error_in_words, in_words, number
from freelearn.data.beds import DEG, bed_of
from freelearn.data.columns import SECOND, Columns, design_column, members_in
from freelearn.discovery.checks.plain_fit import Plain, PlainFit
from freelearn.discovery.checks.table_check import FAIL, PASS, TableCheck, actuator

# How a table's columns might have been meant: another sign, another unit, or one in the place of another.

Change = Callable[[pd.DataFrame], pd.DataFrame]
# Units that laboratories write: name → how many of the table's unit one of it is.
PRESSURES = {"psi": 6.894757, "bar": 100.0, "MPa": 1000.0, "Pa": 1e-3, "mbar": 0.1}
FORCES = {"kgf": 9.80665, "lbf": 4.448222, "gf": 9.80665e-3, "mN": 1e-3, "kN": 1e3}
MOMENTS = {"N·m": 1e3, "N·cm": 10.0, "kgf·cm": 98.0665, "lbf·in": 112.985, "ozf·in": 7.06155}
LENGTHS = {"m": 1e3, "cm": 10.0, "inch": 25.4}
ANGLES = {"rad": 1 / DEG, "turns": 360.0}
ABSOLUTE_KPA = 101.325
SIGN, SWAP, UNIT, LENGTH = "signs", "columns", "units", "lengths and angles"
# What there is to say of a table where no reading of a kind fits far better.
KINDS = {
    SIGN: "No sign turned makes the model fit far better.",
    SWAP: "No two columns exchanged make the model fit far better.",
    UNIT: "No other unit makes the model fit far better.",
    LENGTH: "No other length, radius or angle that is usually mistaken makes the model fit far better.",
}


@dataclass(frozen=True)
class Reading:
    """kind: of KINDS. says: how the columns may be meant, as a clause; cure: what to do about it.
    change: the table as it would be."""

    kind: str
    says: str
    cure: str
    change: Change


def readings(table: pd.DataFrame) -> list[Reading]:
    """All ways to read a table that make a difference to it."""
    return [*_signs(table), *_swaps(table), *_units(table), *_lengths(table)]


def _varies(table: pd.DataFrame, name: str) -> bool:
    return name in table and bool((table[name].abs() > 0).any())


def _loads(table: pd.DataFrame) -> list[str]:
    bed = bed_of(table)
    names = [q.column for q in (*bed.state, *bed.measured) if q.column in ("force_n", "moment_nmm")]
    return [name for name in names if _varies(table, name)]


def _places(table: pd.DataFrame) -> list[str]:
    return [name for name in ("elongation_mm", "twist_deg") if _varies(table, name)]


def _design(table: pd.DataFrame, *names: str) -> list[str]:
    """Columns of these quantities of the design, of every actuator."""
    every = members_in(table.columns)
    each = [design_column(name, number) for number in every for name in names] if every else list(names)
    return [name for name in each if name in table]


def _times(names: list[str], factor: float) -> Change:
    return lambda table: table.assign(**{name: factor * table[name] for name in names})


def _signs(table: pd.DataFrame) -> Iterator[Reading]:
    turned = [*_loads(table), *_places(table)]
    for count in (1, 2):
        for names in combinations(turned, count):
            if count == 2 and set(names) == {"moment_nmm", "twist_deg"}:
                continue
            said = " and ".join(names)
            signs = f"{said} {'has its' if count == 1 else 'have their'} sign turned"
            cure = f"write sign: -1 for {said} in the recipe of intake.py"
            yield Reading(SIGN, signs, cure, _times(list(names), -1.0))
    pressures = [name for name in Columns.from_table(table).pressures if name in table]
    if any((table[name] < 0).mean() > 0.5 for name in pressures):
        yield Reading(
            SIGN, "the pressure has its sign turned", "write sign: -1 for the pressure in the recipe of intake.py",
            _times(pressures, -1.0),
        )  # fmt: skip
    angles = _design(table, "gamma_deg", SECOND)
    if {"moment_nmm", "twist_deg"} & set(turned):
        yield Reading(
            SIGN, "gamma_deg has its sign turned, or twist_deg and moment_nmm both have",
            "turn the sign of gamma_deg, or of both others", _times(angles, -1.0),
        )  # fmt: skip


def _swapped(one: str, other: str) -> Change:
    return lambda table: table.assign(**{one: table[other], other: table[one]})


def _swaps(table: pd.DataFrame) -> Iterator[Reading]:
    pairs = [("force_n", "moment_nmm"), ("elongation_mm", "twist_deg")]
    pairs += list(combinations(Columns.from_table(table).pressures, 2))
    for one, other in pairs:
        # A column without a reading is none that another was taken for.
        there = all(name in table and table[name].notna().any() for name in (one, other))
        if there and (_varies(table, one) or _varies(table, other)):
            yield Reading(SWAP, f"{one} and {other} are exchanged", f"exchange {one} and {other}", _swapped(one, other))


def _units(table: pd.DataFrame) -> Iterator[Reading]:
    pressures = [name for name in Columns.from_table(table).pressures if name in table]
    pressed = "pressure_kpa" if len(pressures) == 1 else "the pressures"
    groups: list[tuple[list[str], str, dict[str, float]]] = [(pressures, pressed, PRESSURES)]
    for name, units in (("force_n", FORCES), ("moment_nmm", MOMENTS)):
        groups += [([name], name, units)] if name in _loads(table) else []
    for name, units in (("elongation_mm", LENGTHS), ("twist_deg", ANGLES)):
        groups += [([name], name, units)] if name in _places(table) else []
    for names, said, units in groups:
        for unit, factor in units.items():
            be = "are" if said.startswith("the ") else "is"
            yield Reading(UNIT, f"{said} {be} in {unit}", f"say unit: {unit} in the recipe", _times(names, factor))
    if all(table[name].min() > 0.5 * ABSOLUTE_KPA for name in pressures):
        yield Reading(
            UNIT, f"{pressed}: absolute, not gauge", "take the atmosphere's 101.3 kPa off",
            lambda t: t.assign(**{name: t[name] - ABSOLUTE_KPA for name in pressures}),
        )  # fmt: skip


def _lengths(table: pd.DataFrame) -> Iterator[Reading]:
    """Of the design and of the elongation that goes by it."""
    length, radii = _design(table, "length_mm"), _design(table, "inner_radius_mm", "outer_radius_mm")
    for unit, factor in LENGTHS.items():
        yield Reading(LENGTH, f"length_mm is in {unit}", f"say unit: {unit} in the recipe", _times(length, factor))
        yield Reading(LENGTH, f"the radii are in {unit}", f"say unit: {unit} in the recipe", _times(radii, factor))
        every = [*length, *radii, *(["elongation_mm"] if "elongation_mm" in _places(table) else [])]
        yield Reading(LENGTH, f"all lengths are in {unit}", f"say unit: {unit} in the recipe", _times(every, factor))
    yield Reading(LENGTH, "the radii are diameters", "halve them", _times(radii, 0.5))
    angles = _design(table, "gamma_deg", SECOND)
    yield Reading(
        LENGTH, "gamma_deg is measured from the circumference, not from the axis", "give 90° less the angle",
        lambda t: t.assign(**{name: np.sign(t[name]) * 90 - t[name] for name in angles}),
    )  # fmt: skip
    yield Reading(
        LENGTH, "gamma_deg is in radians", "say unit: rad in the recipe",
        lambda t: t.assign(**{name: t[name] / DEG for name in angles}),
    )  # fmt: skip
    if "elongation_mm" in _places(table) and len(length) == 1:
        yield from _elongations(length[0])


def _elongations(length: str) -> Iterator[Reading]:
    yield Reading(
        LENGTH, "elongation_mm is the total length", f"take {length} off",
        lambda t: t.assign(elongation_mm=t["elongation_mm"] - t[length]),
    )  # fmt: skip
    yield Reading(
        LENGTH, "elongation_mm is a strain", f"multiply it by {length}",
        lambda t: t.assign(elongation_mm=t["elongation_mm"] * t[length]),
    )  # fmt: skip
    yield Reading(
        LENGTH, "elongation_mm is in percent", f"multiply it by {length} / 100",
        lambda t: t.assign(elongation_mm=t["elongation_mm"] * t[length] / 100),
    )  # fmt: skip
    yield Reading(
        LENGTH, f"{length} and the elongation belong to the longest tube, not to the one at rest",
        "give the length at rest without pressure",
        lambda t: _from_the_longest(t, length),
    )  # fmt: skip


def _from_the_longest(table: pd.DataFrame, length: str) -> pd.DataFrame:
    """With the length of the longest state for that at rest."""
    most = float(table["elongation_mm"].max())
    return table.assign(**{length: table[length] + most, "elongation_mm": table["elongation_mm"] - most})


# E from which a table is read otherwise at all: library effects of the sizes that real actuators have leave less; or
# how many times stiffer than any rubber or thread the fit is. So many times less than the table as it stands another
# reading must leave, and no more than this share.
DOUBTED, STIFF, SEVERAL, FITS = 0.1, 2.0, 2.5, 0.35
# What noise leaves of any fit, and how much worse one counts for each e-fold that its C1 or C2 is out of what is known.
LEAST, WORSE, MOST_SOFT = 0.02, 2.0, 10.0
# Readings that are fitted with care, of those that a rough look promises most; those within this ratio of the best are
# told beside it, so many at most. Pressures that no bed has [kPa].
CAREFUL, ALIKE, TOLD, USUAL_PRESSURES = 6, 1.3, 3, (1.0, 5000.0)


@dataclass(frozen=True)
class Meant:
    """A reading, the E that it leaves, and E with what is known of C1 and C2."""

    reading: Reading
    E: float
    score: float


def meant(plain: Plain) -> Iterator[TableCheck]:
    """A check of each kind."""
    itself = plain.itself
    own = max(itself.E, LEAST) * (1 + WORSE * math.log(itself.stiff))
    tried = _tried(plain) if itself.E >= DOUBTED or itself.stiff >= STIFF else []
    best = tried[0] if tried else None
    # A fault of one kind makes readings of other kinds fit better too: only the best is told.
    for kind, fine in KINDS.items():
        of_kind = [m.score for m in tried if m.reading.kind == kind]
        figure = own / min(of_kind) if of_kind else None
        if best is None or best.reading.kind != kind or best.score > own / SEVERAL or best.E > FITS:
            yield TableCheck(kind, PASS, figure, SEVERAL, fine)
            continue
        alike = [m.reading for m in tried if m.score <= ALIKE * best.score][:TOLD]
        why = f"E falls from {number(100 * itself.E, 3)} to {error_in_words(best.E)}"
        if itself.stiff >= STIFF:
            why += f", and the wall is no longer {in_words(itself.stiff, 2)} times stiffer than any rubber or thread"
        says = f"It looks as if {', or '.join(r.says for r in alike)}: {why}; {', or '.join(r.cure for r in alike)}."
        yield TableCheck(kind, FAIL, figure, SEVERAL, says)


def _tried(plain: Plain) -> list[Meant]:
    """The most promising ways to read the table, the best first."""
    changed = [(reading, reading.change(plain.some)) for reading in readings(plain.some)]
    changed = [(reading, table) for reading, table in changed if _possible(table)]
    rough = [(_score(plain.of(table, roughly=True)), number) for number, (_, table) in enumerate(changed)]
    hopeful = [changed[number] for _, number in sorted(rough)[:CAREFUL]]
    fits = [(reading, plain.of(table)) for reading, table in hopeful]
    return sorted([Meant(reading, fit.E, _score(fit)) for reading, fit in fits], key=lambda m: m.score)


def _score(fit: PlainFit) -> float:
    return max(fit.E, LEAST) * (1 + WORSE * math.log(fit.stiff * min(fit.soft, MOST_SOFT)))


def _possible(table: pd.DataFrame) -> bool:
    """Whether there are such actuators, and such pressures."""
    largest = max(float(table[name].abs().max()) for name in Columns.from_table(table).pressures)
    return actuator(table).status == PASS and USUAL_PRESSURES[0] <= largest <= USUAL_PRESSURES[1]
