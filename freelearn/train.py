"""`python train.py`: from a composed configuration to a run's files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from freelearn.data.source import load_table
from freelearn.errors import UserError
from freelearn.evaluate.files import check_folder, predictions, write_run
from freelearn.evaluate.run import Run, run
from freelearn.fit.fit import FitOptions
from freelearn.fit.store import FitStore
from freelearn.models.build import build_model
from freelearn.terminal import FitProgress, show_run


def train(settings: dict[str, Any], folder: Path, key: str = "", console: Console | None = None) -> Run:
    """Everything that `python train.py` does, from plain settings (see conf/train.yaml); files go to `folder`.

    key: digest of all that the results depend on, kept with them. console: where progress and tables are shown.
    Raises UserError.
    """
    seed = _integer(settings["seed"], "seed")
    names = settings["effects"] or []
    if not isinstance(names, list):
        raise UserError("effects must be a list of effect names, for example effects=[end_clamps,twist_offset].")
    values = {k: _real(v, f"model.{k}") for k, v in settings["model"].items() if k != "name"}
    model = build_model(settings["model"]["name"], values, names)
    options = fit_options(settings["fit"])
    check_folder(folder)
    table, warnings, provenance = load_table(settings["data"])

    outcome = run(
        model,
        table,
        str(settings["train"]),
        str(settings["test"]),
        options,
        seed,
        by_states=settings["split"]["name"] == "states",
        folder=folder,
        progress=FitProgress(console, options.max_epochs) if options and console else None,
        store=FitStore(Path(settings["fits"])) if settings["fits"] else None,
    )
    from freelearn.tensorboard import log_run

    simulated = bool(provenance["simulated"])
    predicted = predictions(outcome)
    log_run(outcome, folder)
    if settings["figures"]:
        # matplotlib costs a second to import: only when there is something to draw.
        from freelearn.plots.tensorboard import log_figures

        log_figures(outcome, predicted, folder, simulated)
    about = {"seed": seed, "split": settings["split"]["name"], "data": provenance, "key": key}
    write_run(outcome, predicted, folder, about)
    if console:
        show_run(console, outcome, folder, warnings, simulated)
    return outcome


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
