"""`python train.py`: from a composed configuration to a run's files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lightning as L
from rich.console import Console

from freelearn.bed.hidden import hidden_effects
from freelearn.commands.comparison import compare
from freelearn.commands.tables import load_table
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.fit.fit import FitOptions
from freelearn.fit.store import FitStore
from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.check import check_model
from freelearn.models.continuum import CONSTITUENT
from freelearn.models.effects.check import ROWS, check_effects
from freelearn.models.effects.registry import missing_columns
from freelearn.models.own import load_own_code
from freelearn.render.terminal.run import FitProgress, show_run
from freelearn.results.curve import state_curves
from freelearn.results.run import CONSTITUENT_SET, Run, run
from freelearn.results.run_files import check_folder, predictions, training_samples, write_run
from freelearn.results.states import pick_states
from freelearn.threads import one_thread

if TYPE_CHECKING:
    from freelearn.inference.misfit import Misfit


def train(
    settings: dict[str, Any],
    folder: Path,
    key: str = "",
    console: Console | None = None,
    command: str = "",
    progress: L.Callback | None = None,
) -> Run:
    """Everything that `python train.py` does, from plain settings (see conf/train.yaml); files go to `folder`.

    key: digest of all that the results depend on, kept with them. console: where progress and tables are shown.
    command: the shell command that repeats the run, for the report. progress: told of epochs, instead of the console.
    Raises UserError.
    """
    one_thread()
    seed = _integer(settings["seed"], "seed")
    names = settings["effects"] or []
    if not isinstance(names, list):
        raise UserError("effects must be a list of effect names, for example effects=[end_clamps,twist_offset].")
    values = {k: _real(v, f"model.{k}") for k, v in settings["model"].items() if k != "name"}
    load_own_code()
    name, training = settings["model"]["name"], str(settings["train"])
    build_model(name, values, names)  # mistakes in names and values come before the work of making a table
    options = fit_options(settings["fit"])
    constituents = _constituents(settings["constituent"])
    check_folder(folder)
    table, warnings, provenance = load_table(settings["data"])
    seal(settings["data"], folder)
    sample = table["sample"].to_numpy()
    samples = [] if training == CONSTITUENT_SET else [int(n) for n in samples_of(training, sample)]

    def build(with_effects: bool) -> Model:
        return build_model(name, values, names if with_effects else [], samples)

    model = build(True)
    if lacking := missing_columns(model.effects, table.columns):
        raise UserError(lacking)
    check_model(model, States.from_table(table[:ROWS]))
    check_effects(model.effects, model.values(), States.from_table(table[:ROWS]))
    store = FitStore(Path(settings["fits"])) if settings["fits"] else None
    outcome = run(
        model,
        table,
        training,
        str(settings["test"]),
        options,
        seed,
        by_states=settings["split"]["name"] == "states",
        folder=folder,
        progress=progress or (FitProgress(console, options.max_epochs) if options and console else None),
        store=store,
        constituents=constituents,
    )
    comparison = None
    if console and names and options and training != CONSTITUENT_SET:
        comparison = compare(build, table, training, str(settings["test"]), options, seed, folder, store)
    from freelearn.render.tensorboard.run import log_run

    simulated = bool(provenance["simulated"])
    predicted = predictions(outcome)
    log_run(outcome, folder)
    found: Misfit | None = None
    own, shown = None, []
    if settings["figures"]:
        # scikit-learn and matplotlib cost a second each to import: only when there is something to show.
        from freelearn.inference.misfit import misfit
        from freelearn.render.tensorboard.figures import log_figures

        own = training_samples(outcome, predicted)
        found = misfit(outcome.model, own, settings["data"]["accuracy"])
        shown = state_curves({outcome.model.name: outcome.model}, own, pick_states(own))
        log_figures(outcome, own, shown, folder, simulated)
    about = {"seed": seed, "split": settings["split"]["name"], "data": provenance, "key": key}
    if comparison:
        about["comparison"] = comparison
    if found:
        about["noise_floor"] = found.noise_floor
        about["failures"] = [failure.numbers() for failure in found.failures]
    from freelearn.render.html.run import report_run

    report_run(outcome, folder, about, command, own, shown)
    write_run(outcome, predicted, folder, about)
    if console:
        show_run(console, outcome, folder, warnings, simulated, comparison, found)
    return outcome


def _constituents(path: Any) -> Mapping[str, float]:
    """Values of train=constituent: the paper's, or those that a specimen.json found."""
    if path is None:
        return CONSTITUENT
    from freelearn.results.specimen import load_parameters

    return CONSTITUENT | load_parameters(Path(str(path)))


def seal(data: dict[str, Any], folder: Path) -> None:
    """Keeps what data.hidden=random drew in a file of its own, which nothing else reads."""
    if data.get("hidden") == "random":
        answer = {"hidden": hidden_effects("random", data["seed"])}
        write_text(folder / "sealed_answer.json", json.dumps(answer, indent=2) + "\n")


def fit_options(settings: dict[str, Any]) -> FitOptions | None:
    """Checked options of a `fit` configuration; None for fit=none. Raises UserError."""
    if settings["name"] == "none":
        return None
    whole = {k: _integer(settings[k], f"fit.{k}") for k in ("max_epochs", "restarts", "patience")}
    for key, value in whole.items():
        if value < 1:
            raise UserError(f"fit.{key} = {value} is too small: choose at least 1.")
    for key in {"batch_size", "race"} & set(settings):
        whole[key] = max(1, _integer(settings[key], f"fit.{key}"))
    rest = {k: _real(v, f"fit.{k}") for k, v in settings.items() if k not in (*whole, "name")}
    return FitOptions(settings["name"], **whole, **rest)  # type: ignore[arg-type]


def _integer(value: Any, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise UserError(f"{name} = {value!r} is not an integer.")
    return value


def _real(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UserError(f"{name} = {value!r} is not a number.")
    return float(value)
