"""What a job does, in a process of its own: the same as `train.py` and `discover.py` with the same overrides."""

from __future__ import annotations

import json
import os
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import lightning as L
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import OmegaConf
from rich.console import Console

import freelearn
from freelearn.commands.discover import discover
from freelearn.commands.tables import load_table
from freelearn.commands.train import train
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.inference.search import Step
from freelearn.measurements.sets import set_names
from freelearn.measurements.states import kinematic_state

# Imported here so that the process from which jobs are forked has them: a fit then starts at once.
from freelearn.inference import misfit  # noqa: F401  isort:skip
from freelearn.render.png import discovery  # noqa: F401  isort:skip
from freelearn.render.html import run  # noqa: F401  isort:skip
from freelearn.render.html.discovery import report_discovery  # noqa: F401  isort:skip

CONF = Path(freelearn.__file__).parents[1] / "conf"


def work(kind: str, overrides: list[str], command: str, folder: Path, fits: Path, pipe: Connection) -> None:
    """Does one job and tells `pipe` of it: ("progress", fields), then ("done", "") or ("failed", message)."""
    # Whatever is printed belongs to the job, not to the terminal of the page.
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "log.txt", "w", encoding="utf-8") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            JOBS[kind](settings(kind, overrides), command, folder, fits, pipe)
            pipe.send(("done", ""))
        except UserError as mistake:
            pipe.send(("failed", str(mistake)))
        except Exception as problem:
            traceback.print_exc()
            text = f"{type(problem).__name__}: {problem} (more in {folder / 'log.txt'})"
            pipe.send(("failed", text))


def settings(kind: str, overrides: list[str]) -> dict[str, Any]:
    """What the command's configuration files and these overrides amount to. Raises UserError."""
    if not CONF.is_dir():
        raise UserError(f"No configuration files at {CONF}: run the workbench from a copy of the project.")
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(CONF), version_base="1.3"):
        try:
            config = compose("discover" if kind == "discover" else "train", overrides)
        except HydraException as problem:
            raise UserError(str(problem)) from None
    chosen: Any = OmegaConf.to_container(config, resolve=True)
    return chosen


def _check(chosen: dict[str, Any], command: str, folder: Path, fits: Path, pipe: Connection) -> None:
    """Reads the table; table.json says what is in it."""
    table, warnings, _ = load_table(chosen["data"])
    usable = table["buckled"] == 0
    content = {
        "sets": list(set_names(table["sample"].to_numpy())),
        "rows": len(table),
        "usable": int(usable.sum()),
        "samples": int(table["sample"].nunique()),
        "states": int(kinematic_state(table).max()) + 1,
        "warnings": warnings,
    }
    write_text(folder / "table.json", json.dumps(content) + "\n")


def _train(chosen: dict[str, Any], command: str, folder: Path, fits: Path, pipe: Connection) -> None:
    chosen["fits"] = str(fits)
    train(chosen, folder, command=command, progress=_Epochs(pipe, int(chosen["fit"].get("max_epochs", 1))))


def _discover(chosen: dict[str, Any], command: str, folder: Path, fits: Path, pipe: Connection) -> None:
    def watch(step: Step, text: str) -> None:
        pipe.send(("progress", {"text": f"{text}: E held-out {100 * step.E_heldout:.3g} %"}))

    with open(folder / "discovery.txt", "w", encoding="utf-8") as file:
        discover(chosen, folder, Console(file=file, width=110), command, watch)


class _Epochs(L.Callback):
    """Sends each epoch's errors."""

    def __init__(self, pipe: Connection, most: int) -> None:
        self.pipe, self.most = pipe, most

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: Any, *_: Any) -> None:
        epoch, fitted, held_out = pl_module.history[-1]
        text = f"epoch {epoch}: E {100 * fitted:.3g} %"
        if pl_module.validation:
            text += f", validation {100 * held_out:.3g} %"
        self.pipe.send(("progress", {"text": text, "share": epoch / self.most}))


JOBS = {"check": _check, "train": _train, "discover": _discover}
