"""A guess at what a laboratory's file holds: what its columns seem to be, and what its numbers leave open."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from freelearn.data.columns import pressure_column
from freelearn.data.intake.guesses.meanings import MEANINGS, column_of
from freelearn.data.intake.headings import Confidence
from freelearn.data.intake.readers.raw_table import Place
from freelearn.data.intake.readers.told_elsewhere import Told

# Question → answer: texts of choices and units, numbers in the table's units.
Answers = Mapping[str, str | float]
YES, NO = "yes", "no"
# Questions about what a column is begin so, and those about which of several columns is meant.
WHAT, WHICH = "what.", "which."
# That about what one of a sensor's signal means.
SCALE = "scale."
YES_OR_NO = ((YES, "yes"), (NO, "no"))


# The key of the doubt whether places in which a log stood still are averaged.
PLATEAUS = "plateaus"
# What each of several actuators on an end block has of its own in any case.
ANGLES = ("gamma_deg", "gamma2_deg")


@dataclass(frozen=True)
class Doubt:
    """text: the question; short: what it is about. options: answer → its words. proposed: the answer that is likely, if
    one is. of: column of the file → the meaning that it must have. changes: answer → what the recipe has more, plain
    values. rows: whether it is about which rows there are."""

    key: str
    text: str
    short: str
    options: tuple[tuple[str, str], ...] = YES_OR_NO
    proposed: str | None = None
    of: Mapping[str, str] = field(default_factory=dict)
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    rows: bool = False


@dataclass(frozen=True)
class ColumnGuess:
    """quantity: of MEANINGS; None: none known. unit: as written, "" where the heading says none. example: the first
    reading. low, high: the range, NaN for texts. chosen: whether the draft takes it. words: the cells of a column that
    may name actuators or recordings, each once. clock: of a column that may be a clock its name, or that of an
    earlier one that tells the same time; dates: whether its cells are dates; began: when these begin [s]; blanks: how
    many are blank. place: where it stands, source: under which name, if under another one. signal:
    V or mA, where a sensor's readings stand there."""

    name: str
    quantity: str | None
    unit: str
    confidence: Confidence
    example: str
    low: float
    high: float
    chosen: bool = False
    words: tuple[str, ...] = ()
    clock: str = ""
    dates: bool = False
    began: float = math.nan
    blanks: int = 0
    place: Place = field(default_factory=Place)
    source: str = ""
    signal: str = ""

    @property
    def own_name(self) -> str:
        """Its name where it stands."""
        return self.source or self.name

    @property
    def is_clock(self) -> bool:
        """Whether it stamps the channels beside it."""
        return bool(self.clock) and self.quantity == "time_s"

    @property
    def column(self) -> str:
        """The column of the table that it becomes, "" for none."""
        return column_of(self.quantity)

    @property
    def numeric(self) -> bool:
        """Whether it holds numbers."""
        return self.low == self.low

    @property
    def meant(self) -> dict[str, str]:
        """Its name and its meaning."""
        return {self.name: self.quantity or ""}


@dataclass(frozen=True)
class Clock:
    """One of several times in a file. time: its column. channels: the columns of readings that go by it."""

    time: str
    channels: tuple[str, ...]


@dataclass(frozen=True)
class Log:
    """What a log would have: recordings, as its time begins anew. likely: whether the rows look like samples, so close
    to each other that no rig came to rest between them."""

    recordings: int
    likely: bool


@dataclass(frozen=True)
class Guess:
    """What a file seems to hold. bed: the one that fits these columns. pressures: names of the columns that are
    members' pressures, where there are several. notes: how the file was read and what looks wrong in it."""

    name: str
    rows: int
    bed: str
    columns: tuple[ColumnGuess, ...]
    pressures: tuple[str, ...]
    notes: tuple[str, ...]
    # Of which actuator the rows are: the words of the column that says so, in their order.
    samples: tuple[str, ...] = ()
    # A column that may say so, although its heading does not.
    perhaps: str = ""
    perhaps_words: tuple[str, ...] = ()
    # Columns by which the rows of one state come to stand together, where they lie sorted by pressure.
    order_by: tuple[str, ...] = ()
    # Of a workbook, or a MATLAB file, with several; and all of them that look like readings as much as this one.
    sheet: str = ""
    sheets: tuple[str, ...] = ()
    # What stands elsewhere in the file about the actuator.
    about: tuple[Told, ...] = ()
    # Columns that say one quantity as clearly as each other, and with other numbers; the first was chosen.
    rivals: tuple[tuple[str, ...], ...] = ()
    # What the numbers leave open.
    doubts: tuple[Doubt, ...] = ()
    # Where channels go by several: first the one whose rows the table has.
    clocks: tuple[Clock, ...] = ()
    # Where each of several recordings of this form stands, the first of which this is; () where there is but one.
    recordings: tuple[tuple[Place, ...], ...] = ()
    # Whether the rows may be samples of recordings.
    log: Log | None = None

    def of(self, quantity: str) -> ColumnGuess | None:
        """The column chosen for a quantity; of several clocks the first."""
        if quantity == "time_s" and self.clocks:
            return self.named(self.clocks[0].time)
        return next((c for c in self.columns if c.chosen and c.quantity == quantity), None)

    def open_rivals(self, answers: Mapping[str, str | float]) -> list[tuple[str, ...]]:
        """Those of which nobody has said what they are."""
        return [names for names in self.rivals if not any(f"{WHAT}{name}" in answers for name in names)]

    def named(self, name: str) -> ColumnGuess:
        """The column of a name."""
        return next(c for c in self.columns if c.name == name)

    def told(self, name: str, member: int = 0) -> Told | None:
        """What the file says elsewhere of a part of the design: of one of the actuators on an end block, or of all."""
        several = max((one.member for one in self.about), default=0) == len(self.pressures)
        parts = {one.member: one for one in self.about if one.name == name}
        return parts.get(member if several else 0, parts.get(0))

    @property
    def sizes_apart(self) -> bool:
        """Whether the file says sizes of its own for each of the actuators on an end block."""
        return any(
            self.told(one.name, one.member) is one
            for one in self.about
            if one.member and one.name not in ANGLES and self.told(one.name) is None
        )

    @property
    def measured(self) -> list[ColumnGuess]:
        """The chosen columns that have a unit: of readings, of what was set, of designs."""
        return [c for c in self.columns if c.chosen and MEANINGS[c.quantity or ""].kind]

    def table_column(self, column: ColumnGuess) -> str:
        """The column of the table that a chosen one becomes."""
        several = column.name in self.pressures
        return pressure_column(self.pressures.index(column.name) + 1) if several else column.column


def with_nan(content: Any) -> Any:
    """What was JSON, with the numbers of columns that had none (the range of a text) as they were."""
    if isinstance(content, dict):
        return {k: math.nan if v is None and k in ("low", "high", "began") else with_nan(v) for k, v in content.items()}
    return [with_nan(one) for one in content] if isinstance(content, list) else content
