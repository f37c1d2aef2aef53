"""The rows worth measuring next, and what is expected of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from freelearn.data.beds import Bed, bed_of
from freelearn.data.columns import SECOND, Columns
from freelearn.data.logs import RUN, TIME, is_log

# The column of what each row is expected to add.
EXPECTED = "expected_z"
# An interval that a plan narrows to more than this share of its width is as wide as before.
UNCHANGED = 0.995


@dataclass(frozen=True)
class Expected:
    """What is told of one thing, in σ. name: the effect that is there and the one that it is told from, or an effect,
    or a parameter. before: by what is measured already; after: with the plan. chances: what a rival's χ² exceeds that
    of the truth by is normal with the square of `after` for a mean and twice `after` for a standard deviation."""

    name: tuple[str, ...]
    before: float
    after: float

    @property
    def added(self) -> float:
        """σ that the plan adds."""
        return float(max(self.after**2 - self.before**2, 0.0) ** 0.5)

    def plain(self) -> dict[str, Any]:
        """The entry in plan.json."""
        named = {"true": self.name[0], "rival": self.name[1]} if len(self.name) == 2 else {"of": self.name[0]}
        return named | {"before_z": self.before, "after_z": self.after, "expected_z": self.added}


@dataclass(frozen=True)
class Certificate:
    """What no plan of as many rows and mountings can exceed: bound; value: what this one adds, in the same measure, the
    information of what is told least. Information is in squares of σ."""

    value: float
    bound: float

    @property
    def efficiency(self) -> float:
        """Of the best that is possible at most: this share at least, a fraction."""
        return self.value / self.bound if self.bound > 0 else 0.0

    def sentence(self, visit: str = "mounting") -> str:
        """In words; visit: what rows are read in."""
        share = 100 * self.efficiency
        if share > 100.5:
            return f"This tells {share:.0f} % of what the best plan on the grid of candidates can tell."
        among = "of as many rows and mountings" if visit == "mounting" else f"of as many {visit}s of these kinds"
        return f"This tells at least {share:.0f} % of what any plan {among} can tell."


@dataclass(frozen=True)
class Narrowed:
    """A parameter in its unit (SI): value, and its standard error by what is measured and with the plan. untold:
    whether the measured rows say nothing of it."""

    name: str
    unit: str
    value: float
    before: float
    after: float
    untold: bool = False

    @property
    def factor(self) -> float:
        """Width of the interval with the plan, as a share of what it is."""
        return self.after / self.before if self.before > 0 else float("nan")

    def plain(self) -> dict[str, Any]:
        """The entry in plan.json."""
        return {
            "name": self.name,
            "unit": self.unit,
            "value": self.value,
            "stderr_before": self.before,
            "stderr_after": self.after,
            "interval_factor": self.factor,
        }


@dataclass(frozen=True)
class Plan:
    """table: the rows, in the order of measuring, in the columns of plan.csv. measured: the rows that there are, in the
    measurement table's. goal: discriminate, detect or narrow. parameters: of the latter two. rows_needed: about how
    many rows reach the goal, infinite where none do. notes: sentences. about: what else plan.json holds."""

    goal: str
    table: pd.DataFrame
    measured: pd.DataFrame
    expected: tuple[Expected, ...]
    parameters: tuple[Narrowed, ...]
    certificate: Certificate
    mountings: int
    rows_needed: float
    notes: tuple[str, ...]
    about: dict[str, Any]

    @property
    def bed(self) -> Bed:
        """What imposes and measures."""
        return bed_of(self.measured)

    @property
    def visit(self) -> str:
        """What rows are read in: a mounting, or a recording."""
        return "recording" if is_log(self.table) else "mounting"

    @property
    def weakest(self) -> Expected:
        """What is told least."""
        return min(self.expected, key=lambda e: e.added)

    def says(self) -> str:
        """What is expected, in one sentence."""
        rows, states = len(self.table), self.mountings
        many = f"{rows} row{'s' if rows > 1 else ''} in {states} {self.visit}{'s' if states > 1 else ''}"
        weak = self.weakest
        if self.goal == "discriminate":
            return f"{many}: {weak.name[0]} is told from {weak.name[1]} by {weak.after:.1f} σ at least, if it is there."
        if self.goal == "narrow":
            (one,) = self.parameters
            if one.factor > UNCHANGED:
                return f"{many}: the interval of {one.name} stays as wide as it is."
            return f"{many}: the interval of {one.name} becomes {one.factor:.2g} times as wide as it is."
        size = "as large as it is fitted" if any(p.value for p in self.parameters) else "of a noticeable size"
        return f"{many}: {weak.name[0]}, {size}, shows by {weak.after:.1f} σ."

    def content(self) -> dict[str, Any]:
        """Everything in plan.json."""
        return {
            "goal": self.goal,
            "says": self.says(),
            "rows": len(self.table),
            "mountings": self.mountings,
            "samples": sorted({int(n) for n in self.table["sample"]}),
            "expected_z": self.weakest.added,
            "expected": [e.plain() for e in self.expected],
            "parameters": [p.plain() for p in self.parameters],
            "rows_needed": self.rows_needed,
            "certificate": vars(self.certificate) | {"efficiency": self.certificate.efficiency},
            "certificate_says": self.certificate.sentence(self.visit),
            "notes": list(self.notes),
            **self.about,
        }


def plan_table(rows: pd.DataFrame, expected: list[float] | None = None) -> pd.DataFrame:
    """Rows in the measurement table's columns, what is to be measured blank, and what each is expected to add."""
    columns = Columns.from_table(rows)
    blank = {name: float("nan") for name in columns.measured}
    listed = list(columns.listed)
    if SECOND in rows and not columns.members and rows[SECOND].notna().any():
        listed.insert(listed.index("gamma_deg") + 1, SECOND)
    if is_log(rows):
        listed += [TIME, RUN]
    table = rows.assign(**blank, buckled=0)[listed].reset_index(drop=True)
    return table if expected is None else table.assign(**{EXPECTED: expected})
