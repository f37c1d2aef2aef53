"""`fit`, `discover` and `read_table` in Python: the commands with arguments in the place of words."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import pandas as pd

from freelearn.commands.configuration import composed, offer_own_models
from freelearn.commands.parse import Chosen, parse
from freelearn.commands.settings import DiscoverSettings, TrainSettings, place
from freelearn.errors import UserError
from freelearn.measurements.beds import BED, BEDS

if TYPE_CHECKING:
    from rich.console import Console

    from freelearn.results.fitted_model import FittedModel
    from freelearn.results.found import Found

# A measurement table, or its file.
Table: TypeAlias = pd.DataFrame | str | Path
# What is one of several files of the configuration.
GROUPS = ("split", "fit")


def read_table(
    table: Table,
    *,
    bed: str = "kinematic",
    members: str | Path | None = None,
    design: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """A measurement table, checked: (N, columns) in the units of its columns' names.

    design: gamma_deg, length_mm, inner_radius_mm and so on of all rows, where the table has no such column. What is odd
    about the rows stands in `attrs["warnings"]`. Raises UserError with all faults, and where they are.

    >>> import freelearn
    >>> rows = {"sample": 1, "step": [0, 1], "elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": [0.0, 50.0]}
    >>> rows |= {"force_n": [0.0, 1.0], "moment_nmm": [0.0, -3.0], "buckled": 0}
    >>> tube = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    >>> len(freelearn.read_table(pd.DataFrame(rows), design=tube))
    2
    """
    from freelearn.measurements.members_table import read_members
    from freelearn.measurements.table import read_table as read

    if bed not in BEDS:
        raise UserError(f"Unknown bed {bed!r}: choose among {', '.join(BEDS)}.")
    with tempfile.TemporaryDirectory(prefix="freelearn-") as folder:
        path = _file(table, Path(folder), design or {})
        found = read(path, BEDS[bed], None if members is None else read_members(members))
    found.table.attrs["warnings"] = [str(warning) for warning in found.warnings]
    return found.table


def fit(
    table: Table,
    model: str = "continuum",
    *,
    effects: Sequence[str] = (),
    train: str | Sequence[str] = "all",
    folder: str | Path | None = None,
    progress: bool = False,
    **options: Any,
) -> FittedModel:
    """A model fitted to a measurement table, as `python train.py` does: its parameters, predictions and errors.

    table: a DataFrame in the measurement table's columns, a file, or a data set of the package (dmsp20, virtual).
    folder: where the run's files go, which `freelearn.load` reads again; one for this session by default. options:
    those of the command, by name; of nested ones {"fit.multistart": 4} or fit={"multistart": 4}. accuracy: a mapping
    such as {"force_n": 0.1}, or "estimate". fix: names, or values by name, SI; priors: (mean, deviation) by name, SI.
    progress: shows what the command shows. Raises UserError.

    fit(table, effects=["end_clamps"], fix={"C2": 1e8}).parameters are the parameters, SI.
    """
    from freelearn.commands.train import train as run
    from freelearn.results.fitted_model import load

    options = {"figures": False, "fits": None} | options | {"effects": list(effects), "train": train}
    where = _folder(folder)
    run(_settings(TrainSettings, "train", table, model, where, options), where, console=_console(progress))
    return load(where)


def discover(
    table: Table,
    model: str = "continuum",
    *,
    effects: Sequence[str] = (),
    train: str | Sequence[str] = "all",
    folder: str | Path | None = None,
    progress: bool = False,
    **options: Any,
) -> Found:
    """Which physical effect a model is missing on a measurement table, as `python discover.py` does.

    table, folder, options and progress: as of `fit`. A search that was interrupted goes on where it was if it is asked
    again with the same folder. Raises UserError.

    discover(table, accuracy={"force_n": 0.1}).verdict is the verdict, .frame() the models from the first to the last.
    """
    from freelearn.commands.discover import discover as search
    from freelearn.results.found import Found

    options = {"figures": False} | options | {"effects": list(effects), "train": train}
    where = _folder(folder)
    search(_settings(DiscoverSettings, "discover", table, model, where, options), where, _console(progress))
    return Found.of(where)


def _settings(
    kind: type[Chosen], name: str, table: Table, model: str, folder: Path, options: Mapping[str, Any]
) -> Chosen:
    """The command's settings, from arguments. Raises UserError."""
    offer_own_models()
    given = dict(options)
    chosen = [f"{group}={given.pop(group)}" for group in GROUPS if isinstance(given.get(group), str)]
    known = isinstance(table, str) and not Path(table).suffix and not Path(table).exists()
    content = composed(name, [f"model={model}", f"data={table if known else 'csv'}", *chosen])
    data = content["data"]
    if not known:
        design = given.pop("design", None) or {}
        data["path"] = str(_file(table, folder, design))
        if isinstance(table, pd.DataFrame) and BED in table and len(table):
            data["bed"] = str(table[BED].iloc[0])
    for option in ("bed", "members"):
        if option in given:
            data[option] = str(given.pop(option))
    accuracy = given.pop("accuracy", {})
    data["accuracy"] = accuracy if isinstance(accuracy, str) else (data.get("accuracy") or {}) | dict(accuracy)
    if isinstance(given.get("priors"), Mapping):
        for parameter, (mean, deviation) in given.pop("priors").items():
            content["model"][parameter] = f"{float(mean)!r}±{float(deviation)!r}"
    if isinstance(given.get("fix"), Mapping):
        content["model"] |= {parameter: float(value) for parameter, value in given["fix"].items()}
        given["fix"] = list(given["fix"])
    for option, value in given.items():
        _put(content, option.split("."), value)
    return parse(kind, content)


def _put(content: dict[str, Any], names: Sequence[str], value: Any) -> None:
    """One option, or several of a group, in the place of what the configuration has."""
    *above, last = names
    for name in above:
        content = content.setdefault(name, {})
    if isinstance(value, Mapping) and isinstance(content.get(last), dict):
        content[last] |= value
    else:
        content[last] = list(value) if isinstance(value, tuple) else value


def _file(table: Table, folder: Path, design: Mapping[str, float]) -> Path:
    """The table's file; of a DataFrame, and of one whose design is told, a file of its own in the folder."""
    if isinstance(table, pd.DataFrame):
        frame = table
    elif design:
        frame = pd.read_csv(place(str(table)))
    else:
        return place(str(table))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "table.csv"
    frame.assign(**{name: value for name, value in design.items() if name not in frame}).to_csv(path, index=False)
    return path


def _folder(folder: str | Path | None) -> Path:
    """Where a run goes: of this session alone by default."""
    return Path(tempfile.mkdtemp(prefix="freelearn-")) if folder is None else Path(folder)


def _console(progress: bool) -> Console:
    from rich.console import Console

    return Console(quiet=not progress)
