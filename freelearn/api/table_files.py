"""Measurement tables in Python: a DataFrame, a file, a laboratory's raw file with its recipe, or a known data set."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import pandas as pd

from freelearn.api.session_folders import new_folder, session_folder
from freelearn.common.errors import UserError, unknown
from freelearn.common.package import CONF, example
from freelearn.data.beds import BED, BEDS, KINEMATIC
from freelearn.data.columns import DESIGN
from freelearn.data.logs import RUN

# A measurement table: its rows, its file, or the name of a data set that comes with the package.
Table: TypeAlias = pd.DataFrame | str | Path
# The actuators of an end block: a row for each, or the file of these.
Members: TypeAlias = pd.DataFrame | str | Path
# In `attrs` of a checked table: sentences about it, the file of an end block's actuators, and of a data set of the
# package how accurate its bed was, in engineering units, and its name with the digest of its rows.
WARNINGS, MEMBERS, ACCURACY, DATA_SET = "warnings", "members", "accuracy", "data_set"


@dataclass(frozen=True)
class TableFile:
    """Where a table lies. name: of the data set that it is, "csv" for a table of one's own; path: of its file, None for
    a data set that knows it itself. bed, members, accuracy: None where nothing but the default is known. frames: what
    the files were written from, by what a message calls it."""

    name: str
    path: Path | None
    bed: str | None = None
    members: Path | None = None
    accuracy: Mapping[str, float] | None = None
    frames: Mapping[str, tuple[Path, pd.DataFrame]] = field(default_factory=dict)


def read_table(
    table: Table,
    *,
    bed: str | None = None,
    members: Members | None = None,
    design: Mapping[str, float] | None = None,
    recipe: str | Path | None = None,
    rate_hz: float | None = None,
) -> pd.DataFrame:
    """A measurement table, checked: (N, columns) in the units of its columns' names.

    table: a DataFrame, a CSV file, the name of a data set (dmsp20, virtual), or a laboratory's own file or folder. A
    DataFrame without `sample` is of one, without `buckled` of none that did, and without `step` its rows are counted
    while the bed stays where it is.
    bed: kinematic (the default), isometric, dead_load or inflation. members: several actuators on one end block, a
    DataFrame with a row for each or its file. design: gamma_deg, length_mm, inner_radius_mm, outer_radius_mm of all
    rows, where the table has no such columns. recipe: the file that says what a laboratory's own file means. rate_hz:
    rows a second to which a log is thinned through a low-pass. What is odd about the rows stands in
    `attrs["warnings"]`. Raises UserError with all faults, and where they are.

    >>> import freelearn as fl
    >>> rows = {"elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": [0.0, 50.0]}
    >>> rows |= {"force_n": [0.0, 1.0], "moment_nmm": [0.0, -3.0]}
    >>> tube = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    >>> len(fl.read_table(pd.DataFrame(rows), design=tube))
    2
    """
    from freelearn.data.table.measurement_table import read_table as read
    from freelearn.data.table.members_table import read_members

    place = table_file(table, None, design, recipe, members, bed)
    if place.path is None:
        if design:
            raise UserError(f"{place.name} has its design: leave design out.")
        return _data_set(place.name, bed, place.members)
    chosen, block = bed or place.bed or KINEMATIC.name, place.members
    if chosen not in BEDS:
        raise UserError(f"Unknown bed {chosen!r}: choose among {', '.join(BEDS)}.")
    with said_of(place):
        found = read(place.path, BEDS[chosen], None if block is None else read_members(block), rate_hz)
    found.table.attrs[WARNINGS] = [str(warning) for warning in found.warnings]
    if block is not None:
        found.table.attrs[MEMBERS] = str(block)
    return found.table


def table_file(
    table: Table,
    folder: Path | None,
    design: Mapping[str, float] | None = None,
    recipe: str | Path | None = None,
    members: Members | None = None,
    bed: str | None = None,
) -> TableFile:
    """The table's file; of a DataFrame, of a raw file and of one whose design is told, a file of its own: table.csv in
    the folder (members.csv), or one of this session's. Raises UserError."""
    place = _place(table, folder, design, recipe, bed)
    if isinstance(members, pd.DataFrame):
        path = _written(members, folder, "members.csv")
        return replace(place, members=path, frames={**place.frames, "members": (path, members)})
    return place if members is None else replace(place, members=Path(members))


def _place(
    table: Table,
    folder: Path | None,
    design: Mapping[str, float] | None,
    recipe: str | Path | None,
    bed: str | None = None,
) -> TableFile:
    if recipe is not None:
        return _converted(table, recipe, folder)
    if isinstance(table, str) and table in data_sets():
        return TableFile(table, None)
    if not isinstance(table, pd.DataFrame | str | Path):
        raise UserError(f"A {type(table).__name__} is no table: give a DataFrame, a file, or a data set's name.")
    if not isinstance(table, pd.DataFrame):
        path = example(str(table))
        if (
            isinstance(table, str)
            and path == Path(table)
            and len(path.parts) == 1
            and not path.suffix
            and not path.exists()
        ):
            raise unknown("file or data set", table, data_sets())
        if not design:
            return TableFile("csv", path)
        return TableFile("csv", _written(_with(_plain(path), design), folder))
    if not isinstance(table.columns, pd.Index) or not all(isinstance(name, str) for name in table.columns):
        raise UserError("The DataFrame's columns must be named by texts, as those of a measurement table are.")
    if table.attrs.get(DATA_SET, ("", ""))[1] == _digest(table.to_csv(index=False)):
        # Nothing was changed: it is the data set still, and what is simulated says so.
        return TableFile(str(table.attrs[DATA_SET][0]), None)
    own = str(table[BED].iloc[0]) if BED in table and len(table) else None
    frame = _completed(_with(table, design or {}), bed or own)
    block = table.attrs.get(MEMBERS)
    members = None if block is None else Path(block)
    path = _written(frame, folder)
    return TableFile("csv", path, own, members, table.attrs.get(ACCURACY), {"The DataFrame": (path, frame)})


@contextmanager
def said_of(place: TableFile) -> Iterator[None]:
    """Within it, what is wrong with a file that was written from a DataFrame is said of the DataFrame's rows."""
    try:
        yield
    except UserError as mistake:
        said = str(mistake)
        for name, (path, frame) in place.frames.items():
            if str(path) in said:
                raise UserError(_said_of(frame, said.replace(str(path), name))) from None
        raise


def _said_of(frame: pd.DataFrame, text: str) -> str:
    labels = list(frame.index)

    def row(found: re.Match[str]) -> str:
        number = int(found[1]) - 2
        return f"row {labels[number]!r}" if 0 <= number < len(labels) else "columns"

    text = re.sub(r"\bline (\d+)", row, text)
    return re.sub(rf"({'|'.join(DESIGN)})(: column is missing: add it)", r"\1\2, or give design={'\1': …}", text)


def data_sets() -> list[str]:
    """Names of the data sets that come with the package."""
    return sorted(path.stem for path in (CONF / "data").glob("*.yaml") if path.stem != "csv")


def _data_set(name: str, bed: str | None, members: Path | None) -> pd.DataFrame:
    # Here, not above: the simulated bed needs torch, a file does not.
    from freelearn.api.settings.configuration import settings
    from freelearn.api.settings.settings import TrainSettings
    from freelearn.api.tasks.loaded_table import load_table

    more = [f"data.{option}={value}" for option, value in (("bed", bed), ("members", members)) if value is not None]
    data = settings(TrainSettings, [f"data={name}", *more]).data
    loaded = load_table(data)
    table = loaded.table.copy()
    if data.accuracy is not None:
        table.attrs[ACCURACY] = dict(vars(data.accuracy))
    if bed is None and members is None:
        table.attrs[DATA_SET] = (name, _digest(table.to_csv(index=False)))
    table.attrs[WARNINGS] = [str(warning) for warning in loaded.warnings]
    return table


def _plain(path: Path) -> pd.DataFrame:
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as problem:
        raise UserError(f"{path} cannot be read as a table: {problem}. Name a CSV file.") from None


def _with(frame: pd.DataFrame, design: Mapping[str, float]) -> pd.DataFrame:
    return frame.assign(**{name: value for name, value in design.items() if name not in frame})


def _completed(frame: pd.DataFrame, bed: str | None) -> pd.DataFrame:
    """With the columns that rows of one actuator, in the order of measuring, tell themselves."""
    whole = frame.assign(**{name: value for name, value in {"sample": 1, "buckled": 0}.items() if name not in frame})
    state = [q.column for q in BEDS.get(bed or "", KINEMATIC).state if q.column in whole]
    if "step" in whole or RUN in whole or not state:
        return whole
    # Here, not above: few tables ask for it.
    from freelearn.data.intake.assemble import count_steps

    return whole.assign(step=count_steps(whole, ["sample", *state]))


def _written(frame: pd.DataFrame, folder: Path | None, name: str = "table.csv") -> Path:
    """The file of a DataFrame: in this session by its content, so that the same rows are the same table."""
    text = frame.to_csv(index=False)
    path = session_folder("tables") / f"{_digest(text)}.csv" if folder is None else folder / name
    from freelearn.common.files import write_text

    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    return path


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _converted(raw: Table, recipe: str | Path, folder: Path | None) -> TableFile:
    """What a recipe makes of a laboratory's file."""
    from freelearn.api.tasks.intake_task import taken_in

    if isinstance(raw, pd.DataFrame):
        raise UserError("recipe is for a laboratory's file: name the file, or leave recipe out.")
    made = taken_in(Path(raw), Path(recipe), (folder or new_folder("intake")) / "table.csv")
    return TableFile("csv", made.path, made.bed, made.members)
