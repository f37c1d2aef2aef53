"""`python train.py`: from a composed configuration to a run's files."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import DictConfig, OmegaConf
from rich.console import Console

from freelearn.data.virtual import simulate
from freelearn.errors import UserError
from freelearn.evaluate.files import check_folder, predictions, write_run
from freelearn.evaluate.run import Run, run
from freelearn.fit.fit import FitOptions
from freelearn.models.build import build_model
from freelearn.terminal import FitProgress, show_run


def train(config: DictConfig, folder: Path) -> Run:
    """Everything that `python train.py` does; the run's files go to `folder`. Raises UserError."""
    settings: dict[str, Any] = OmegaConf.to_container(config, resolve=True)  # type: ignore[assignment]
    seed = _integer(settings["seed"], "seed")
    names = settings["effects"] or []
    if not isinstance(names, list):
        raise UserError("effects must be a list of effect names, for example effects=[end_clamps,twist_offset].")
    values = {k: _real(v, f"model.{k}") for k, v in settings["model"].items() if k != "name"}
    model = build_model(settings["model"]["name"], values, names)
    options = fit_options(settings["fit"])
    check_folder(folder)
    table, warnings, provenance = load_table(settings["data"])

    console = Console()
    outcome = run(
        model,
        table,
        str(settings["train"]),
        str(settings["test"]),
        options,
        seed,
        by_states=settings["split"]["name"] == "states",
        folder=folder,
        progress=FitProgress(console, options.max_epochs) if options else None,
    )
    # The TensorBoard figures need matplotlib, which costs a second to import: only when there is something to draw.
    from freelearn.plots.tensorboard import log_run

    simulated = bool(provenance["simulated"])
    predicted = predictions(outcome)
    log_run(outcome, predicted, folder, simulated)
    write_run(outcome, predicted, folder, seed, provenance)
    show_run(console, outcome, folder, warnings, simulated)
    return outcome


def load_table(data: dict[str, Any]) -> tuple[pd.DataFrame, list[str], dict[str, Any]]:
    """The measurement table of a `data` configuration, warnings about it, and where it came from."""
    if data["name"] == "virtual":
        table = simulate(
            data["truth"], data["truth_effects"] or {}, data["accuracy"], data["buckled_share"], data["seed"]
        )
        return table, [], {"name": "virtual", "simulated": True, "seed": data["seed"]}
    from freelearn.data.table import read_table

    table, warnings = read_table(data["path"])
    digest = hashlib.sha256(Path(data["path"]).read_bytes()).hexdigest()
    return table, warnings, {"name": "csv", "simulated": False, "path": str(data["path"]), "sha256": digest}


def fit_options(settings: dict[str, Any]) -> FitOptions | None:
    """Checked options of a `fit` configuration; None for fit=none. Raises UserError."""
    if settings["name"] == "none":
        return None
    whole = {k: _integer(settings[k], f"fit.{k}") for k in ("max_epochs", "restarts", "patience")}
    for key, value in whole.items():
        if value < 1:
            raise UserError(f"fit.{key} = {value} is too small: choose at least 1.")
    rest = {k: _real(v, f"fit.{k}") for k, v in settings.items() if k not in (*whole, "name", "batch_size")}
    if "batch_size" in settings:
        rest["batch_size"] = max(1, _integer(settings["batch_size"], "fit.batch_size"))
    return FitOptions(settings["name"], **whole, **rest)  # type: ignore[arg-type]


def _integer(value: Any, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise UserError(f"{name} = {value!r} is not an integer.")
    return value


def _real(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UserError(f"{name} = {value!r} is not a number.")
    return float(value)
