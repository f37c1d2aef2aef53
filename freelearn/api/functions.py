"""What a notebook calls beside `fit`: each command as a function, with arguments in the place of words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from freelearn.api.arguments import Group, StatedAccuracy, options_of, settings_of
from freelearn.api.session_folders import session_folder
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.table_files import Members, Table, said_of, table_file
from freelearn.common.errors import UserError

if TYPE_CHECKING:
    from freelearn.api.fitted_run import FittedRun
    from freelearn.api.found import Found
    from freelearn.api.planned import Planned
    from freelearn.records.claims import RefereedRun

# A run: what a function gave, or its folder.
Run = Any


def discover(
    table: Table,
    model: Group = "continuum",
    *,
    effects: Sequence[str] = (),
    ruled_out: Sequence[str] = (),
    train: str | Sequence[str] = "all",
    test: str = "every",
    fit: Group = "levenberg_marquardt",
    split: Group = "states",
    checks: bool | Literal["on", "off"] = True,
    accuracy: StatedAccuracy = None,
    bed: str | None = None,
    members: Members | None = None,
    design: Mapping[str, float] | None = None,
    recipe: str | Path | None = None,
    data: Mapping[str, Any] | None = None,
    fix: Sequence[str] | Mapping[str, float] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    priors: bool | Mapping[str, tuple[float, float]] = True,
    material: str | None = None,
    per_sample: bool = True,
    seed: int = 0,
    device: Literal["cpu", "cuda", "auto"] = "cpu",
    figures: bool = False,
    bands: bool = True,
    folder: str | Path | None = None,
    progress: bool = True,
    **options: Any,
) -> Found:
    """Which physical effect a model is missing on a measurement table, as `freelearn discover` finds it, bit for bit.

    ruled_out: effects that are known to be absent. checks: whether a look at the table that finds something wrong stops
    every claim. All other arguments: as of `fit`. A search that was interrupted goes on where it was when the same is
    asked again, in the same folder or in the same session. Raises UserError with every mistake.

    >>> import freelearn as fl
    >>> found = fl.discover("virtual", train="sample8", data={"hidden": ["force_offset"]}, progress=False)
    >>> found
    <named: force_offset>
    """
    arguments = options_of(locals())
    with ExitStack() as stack:
        place = table_file(table, None if folder is None else Path(folder), design, recipe, members, bed)
        stack.enter_context(said_of(place))
        settings = settings_of(DiscoverSettings, "discover", place, arguments)
        # After the settings are checked: torch takes seconds to import.
        from freelearn.api.found import Found
        from freelearn.api.shown_progress import Shown
        from freelearn.api.tasks.discover_task import discover as search
        from freelearn.api.tasks.loaded_table import job_key

        where = session_folder(f"discover-{job_key(settings)}") if folder is None else Path(folder)
        stack.enter_context(Shown("searching", progress))
        outcome = search(settings, where)
    return Found.from_folder(where, outcome)


def plan(
    run: Run,
    rows: int | None = None,
    goal: Literal["auto", "discriminate", "detect", "narrow"] = "auto",
    *,
    effect: str | None = None,
    parameter: str | None = None,
    per_state: int | None = None,
    mounting_rows: float = 1.0,
    reach: Mapping[str, tuple[float, float]] | None = None,
    path: str | Path | None = None,
    seed: int = 0,
    progress: bool = True,
) -> Planned:
    """The next rows worth measuring, as `freelearn plan` chooses them; nothing is written.

    run: what `fit` or `discover` gave, or a run's folder. rows: how many. goal: auto splits a class where there is one,
    else narrows the widest interval. effect: that detect asks about. parameter: that narrow narrows. per_state: rows of
    each mounting, None for the best. mounting_rows: what a mounting costs, in rows. reach: (lowest, highest) of the bed
    by column, where it is not what the table went to. path: a plan of one's own, which is scored. seed: the same gives
    the same plan. progress: as of `fit`. Raises UserError.

    >>> import freelearn as fl
    >>> run = fl.fit("dmsp20", effects=["fiber_misalignment"], progress=False)
    >>> len(fl.plan(run, rows=4, goal="narrow", parameter="C1", progress=False).frame())
    4
    """
    from freelearn.api.settings.run_settings import plan_settings

    content: dict[str, Any] = {"run": str(folder_of(run)), "rows": rows, "goal": goal, "effect": effect}
    content |= {"parameter": parameter, "plan": {"path": None if path is None else str(path)}}
    content |= {"per_state": per_state, "seed": seed}
    settings = plan_settings(content | {"mounting_rows": float(mounting_rows), "reach": dict(reach or {})})
    # After the settings are checked, as above.
    from freelearn.api.planned import Planned
    from freelearn.api.shown_progress import Shown
    from freelearn.api.tasks.plan_task import planned

    with Shown("planning", progress):
        return Planned.from_plan(planned(settings))


def referee(
    run: Run,
    referee: Literal["standing", "simulate"] = "standing",
    tables: int = 40,
    *,
    cores: int | None = None,
    seed: int = 0,
    progress: bool = True,
) -> RefereedRun:
    """Whether what a run claims stands, as `freelearn referee` tells it; the run's referee.json is written anew.

    run: what `fit` or `discover` gave, or a run's folder. referee: simulate also searches tables that are simulated
    from the run's models. tables: how many. cores: on how many (None: all). seed: of these. progress: as of `fit`.
    Raises UserError.

    >>> import freelearn as fl
    >>> run = fl.fit("dmsp20", effects=["fiber_misalignment"], progress=False)
    >>> sorted(set(fl.referee(run, progress=False).frame()["result"]) - {"cannot_tell"})
    ['fail', 'pass']
    """
    from freelearn.api.settings.parse import parsed
    from freelearn.api.settings.run_settings import RefereeSettings

    content = {"run": str(folder_of(run)), "referee": referee, "tables": tables, "cores": cores, "seed": seed}
    settings = parsed(RefereeSettings, content)
    # After the settings are checked, as above.
    from freelearn.api.shown_progress import Shown
    from freelearn.api.tasks.referee_task import refereed_run

    with Shown("asking whether the claim stands", progress):
        return refereed_run(settings)


def load(folder: str | Path) -> FittedRun | Found:
    """The run in a folder that train, discover, `fit`, `discover` or `save` wrote: a FittedRun, of a search a Found.
    Raises UserError.

    Effects and models of the user's own are read from the files that FREELEARN_EFFECTS and FREELEARN_MODELS name, and
    from nowhere else: nothing in the folder is executed.

    >>> import freelearn as fl
    >>> run = fl.fit("dmsp20", fit="none", progress=False)
    >>> fl.load(run.folder).parameters == run.parameters
    True
    """
    from freelearn.api.fitted_run import FittedRun
    from freelearn.api.found import Found
    from freelearn.records.run_files import read_run

    run = read_run(folder_of(folder))
    fitted = FittedRun.from_folder(run)
    return Found(run.folder, dict(run.content), read=fitted) if "verdict" in run.content else fitted


def folder_of(run: Run) -> Path:
    """The folder of what a function gave, or the folder itself."""
    place: Any = getattr(run, "folder", run)
    if not isinstance(place, str | Path):
        raise UserError(f"{type(run).__name__} is no run: give what fit or discover gave, or a run's folder.")
    return Path(place)
