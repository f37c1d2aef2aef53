"""A recipe: how a laboratory's file becomes a measurement table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from freelearn.data.columns import pressure_column


@dataclass(frozen=True)
class Reading:
    """All of it may be left out. sheet: of a workbook; of a MATLAB file a structure. variables: of a MATLAB file,
    columns or one matrix. encoding and separator: of text. decimal, thousands: how numbers are written. header: its
    line in the file. names: of the columns of a file without a header. units_row: whether the row below the header
    says units."""

    sheet: str | None = None
    variables: tuple[str, ...] = ()
    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: int | None = None
    names: tuple[str, ...] = ()
    units_row: bool | None = None


# Columns of the table by what they are; which of them a bed needs stands in beds.py.
DESIGN = ("gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
NEEDED_DESIGN = tuple(name for name in DESIGN if name != "gamma2_deg")
STATE = ("elongation_mm", "twist_deg", "pressure_kpa")
READINGS = ("force_n", "moment_nmm", "outer_diameter_mm")
FURTHER = ("time_s", "temperature_c")
MARKS = ("buckled", "slack", "left_out", "risen")
QUANTITIES = (*DESIGN, *STATE, *READINGS, *FURTHER)

# The unit of a time whose cells are dates with a time of day.
DATE = "date"

Cell = str | float


@dataclass(frozen=True)
class Test:
    """What a cell must be: any of `is_`, none of `is_not`, below, above, blank (True) or filled (False)."""

    is_: tuple[Cell, ...] = ()
    is_not: tuple[Cell, ...] = ()
    below: float | None = None
    above: float | None = None
    blank: bool | None = None


# Column → test; all must hold.
Condition = Mapping[str, Test]


@dataclass(frozen=True)
class Term:
    """What is added to a quantity or taken from it, in its unit: a number; a column of the table; a column of
    the file with its unit; or the thrust π r² P of the pressure on the circle of a radius, itself a term."""

    number: float | None = None
    column: str | None = None
    source: str | None = None
    unit: str = ""
    thrust_on: Term | None = None


@dataclass(frozen=True)
class Column:
    """value = sign · scale · (reading − offset) in `unit`, converted to the table's unit, × times, + plus, − minus.

    source: a column of the file. offset: what it reads where it should read zero, or "rest" for the mean of the rows at
    rest. times: a column of the table, by which a ratio is multiplied. blank_where: rows whose value is blanked;
    blanks: words that stand for no reading; fill: written into blank cells, "above" for what stands above them.
    correct: readings that are known to be wrong, with the right ones. even: of a rounded time, whether its rows were
    taken evenly.
    """

    source: str
    unit: str = ""
    sign: int = 1
    scale: float = 1.0
    offset: float | Literal["rest"] = 0.0
    times: str | None = None
    plus: tuple[Term, ...] = ()
    minus: tuple[Term, ...] = ()
    blank_where: Condition | None = None
    fill: float | Literal["above"] | None = None
    blanks: tuple[str, ...] = ()
    correct: tuple[tuple[float, float], ...] = ()
    even: bool = False


Constants = Mapping[str, float]


@dataclass(frozen=True)
class Sample:
    """Which actuator a row is of: one number for all, or a column of the file, whose words `numbers` translates."""

    number: int | None = None
    source: str | None = None
    numbers: Mapping[str, int] | None = None


@dataclass(frozen=True)
class Member:
    """One of several actuators in parallel: its pressure and its design, in the table's units."""

    pressure: Column
    constants: Constants


@dataclass(frozen=True)
class Join:
    """Channels that another clock's rows hold, joined by time. time: in seconds of the clock of the rows' time_s. file:
    beside the data, "" for the same file. reading: of it; None as that of the same file, or nothing said of another.
    gap_s: readings farther apart are not joined by a line; None: of several usual steps."""

    time: Column
    columns: Mapping[str, Column]
    file: str = ""
    reading: Reading | None = None
    gap_s: float | None = None


@dataclass(frozen=True)
class Part:
    """One of several files, or of several sheets, structures or variables of one, with what differs from the rest of
    the recipe. name: "" for the only file. drop: besides the recipe's. join: in place of the recipe's. beside: where
    the channels that the recipe joins stand for this part, a file's name and how it is read, in the order of join."""

    name: str
    sample: Sample | None = None
    constants: Constants = field(default_factory=dict)
    columns: Mapping[str, Column] = field(default_factory=dict)
    reading: Reading | None = None
    drop: tuple[Condition, ...] = ()
    join: tuple[Join, ...] = ()
    beside: tuple[tuple[str, Reading | None], ...] = ()

    @property
    def label(self) -> str:
        """What it is called: by its file, and by its place there."""
        place = (self.reading.sheet, *self.reading.variables) if self.reading else ()
        return ", ".join(filter(None, (self.name, *place)))


@dataclass(frozen=True)
class Plateaus:
    """of: column of the table → how far it may wander on a plateau. settle: readings left out at its beginning. least:
    readings that make one."""

    of: Mapping[str, float]
    settle: int = 0
    least: int = 5


@dataclass(frozen=True)
class Steps:
    """How `step` is counted: derived from consecutive rows of one state, 0 in each row, or taken from a column of the
    file. state: columns of the table that stay equal in a state; () those that the bed imposes beside the pressure.
    anew: columns of the file whose change begins a new state."""

    kind: Literal["derive", "each_row", "column"] = "derive"
    source: str | None = None
    state: tuple[str, ...] = ()
    anew: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recordings:
    """How `run` is told, which makes the table a log: by a column of the file, or, without one, by where a file, an
    actuator or the time begins anew."""

    source: str | None = None


@dataclass(frozen=True)
class Design:
    """Where the designs of the actuators stand: file: beside the data, "" for a sheet of the data's own workbook. by:
    its column of names, which are those of `sample`. columns: of the table, each from one of its columns."""

    by: str
    columns: Mapping[str, Column]
    file: str = ""
    sheet: str = ""


@dataclass(frozen=True)
class Recipe:
    """bed: a name of BEDS. files: () where there is one. samples: number → constants of that actuator. keep, drop: rows
    of the file (drop: any of the conditions). order_by: columns of the file. rest: "first" row of each sample and file,
    or where. state_tolerance: column → values nearer than this are one state's. run: of a log; None of other tables.
    marks: buckled, slack, left_out → where. carry: columns of the file that are kept as they are. about: for the
    provenance."""

    bed: str
    columns: Mapping[str, Column]
    reading: Reading = field(default_factory=Reading)
    files: tuple[Part, ...] = ()
    join: tuple[Join, ...] = ()
    sample: Sample = field(default_factory=lambda: Sample(number=1))
    constants: Constants = field(default_factory=dict)
    samples: Mapping[int, Constants] = field(default_factory=dict)
    design: Design | None = None
    members: tuple[Member, ...] = ()
    keep: Condition | None = None
    drop: tuple[Condition, ...] = ()
    order_by: tuple[str, ...] = ()
    plateaus: Plateaus | None = None
    rest: Condition | Literal["first"] | None = None
    state_tolerance: Mapping[str, float] = field(default_factory=dict)
    steps: Steps = field(default_factory=Steps)
    run: Recordings | None = None
    marks: Mapping[str, Condition] = field(default_factory=dict)
    carry: tuple[str, ...] = ()
    about: str = ""

    def joins_for(self, part: Part) -> tuple[Join, ...]:
        """What is joined with the rows of one file."""
        if part.join or not part.beside:
            return part.join or self.join
        return tuple(
            replace(join, file=file, reading=reading)
            for join, (file, reading) in zip(self.join, part.beside, strict=True)
        )

    def joined_files(self) -> list[str]:
        """Names of further files that hold joined channels, each once."""
        joins = [join for part in self.files or (Part(""),) for join in self.joins_for(part)]
        return list(dict.fromkeys(join.file for join in joins if join.file))

    def as_read(self) -> set[str]:
        """Pressures from which 0 is taken, which says that they are what their gauges read."""
        columns = {name: column for join in self.join for name, column in join.columns.items()} | dict(self.columns)
        columns |= {pressure_column(i): member.pressure for i, member in enumerate(self.members, start=1)}
        pressures = {name: column for name, column in columns.items() if name.startswith("pressure_")}
        return {name for name, column in pressures.items() if Term(number=0.0) in column.minus}

    def columns_for(self, part: Part) -> dict[str, Column]:
        """The columns of one file: its own go before the recipe's, and so do its constants."""
        shared = {name: column for name, column in self.columns.items() if name not in part.constants}
        return shared | dict(part.columns)

    def constants_for(self, part: Part) -> dict[str, float]:
        """The constants of one file, in the same way."""
        shared = {name: value for name, value in self.constants.items() if name not in part.columns}
        return shared | dict(part.constants)
