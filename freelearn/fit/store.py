"""Fits kept on disk and reused, under a key made of everything they depend on."""

from __future__ import annotations

import hashlib
import inspect
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from filelock import FileLock

from freelearn.files import write_whole
from freelearn.fit.code_version import code_version
from freelearn.fit.options import FitOptions
from freelearn.fit.outcome import FitOutcome
from freelearn.fit.uncertainty import Uncertainty
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model


@dataclass(frozen=True)
class Fitted:
    """A finished fit: what happened, how well the parameters are known, the seconds it took, and whether it was
    read from the store instead of being computed."""

    outcome: FitOutcome
    uncertainty: Uncertainty
    seconds: float
    reused: bool = False


class FitStore:
    """One file per fit in `folder`. Safe with several processes: files are whole or absent, and of two processes
    that need the same fit the second waits for the first one's."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def fitted(self, model: Model, key: str, compute: Callable[[], Fitted]) -> Fitted:
        """The fit under `key`, from its file or else from `compute`; the model holds its parameters afterwards."""
        path = self.folder / f"{key}.fit"
        if (kept := _read(path, model)) is not None:
            return kept
        self.folder.mkdir(parents=True, exist_ok=True)
        with FileLock(self.folder / f".{key}.lock"):
            if (kept := _read(path, model)) is not None:
                return kept
            fitted = compute()
            write_whole(path, lambda beside: torch.save(_pack(model, fitted), beside))
        return fitted


def fit_key(model: Model, train: Rows, validation: Rows, options: FitOptions, seed: int) -> str:
    """Digest of the rows, the model with its starts and effects, the options, the seed and the code: 24 digits."""
    digest = hashlib.sha256(code_version().encode())
    for rows in (train, validation):
        for name, tensor in rows.states.tensors():
            digest.update(name.encode() + tensor.numpy().tobytes())
        digest.update(rows.states.bed.name.encode())
        # Only which rows share a state matters, not how states are numbered.
        grouping = np.unique(rows.state, return_inverse=True)[1].astype(np.int64)
        readings = rows.readings
        for tensor in (readings.value, readings.present, readings.slack):
            digest.update(tensor.numpy().tobytes())
        digest.update(grouping.tobytes())
    for part in (model, *model.effects):
        digest.update(Path(inspect.getfile(type(part))).read_bytes())
    description = model.description()
    state = description.pop("state")
    for name, tensor in state.items():
        digest.update(name.encode() + tensor.numpy().tobytes())
    digest.update(repr((description, asdict(options), seed, torch.__version__)).encode())
    return digest.hexdigest()[:24]


def timed(compute: Callable[[], tuple[FitOutcome, Uncertainty]]) -> Fitted:
    """The fit that `compute` makes, with the seconds it took."""
    began = time.perf_counter()
    outcome, errors = compute()
    return Fitted(outcome, errors, time.perf_counter() - began)


def _pack(model: Model, fitted: Fitted) -> dict[str, Any]:
    """Plain containers and tensors, which torch reads back without executing anything."""
    return {
        "state": model.description()["state"],
        "outcome": _plain(fitted.outcome),
        "uncertainty": _plain(fitted.uncertainty),
        "seconds": fitted.seconds,
    }


def _plain(record: Any) -> dict[str, Any]:
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {name: torch.as_tensor(v) if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _read(path: Path, model: Model) -> Fitted | None:
    """The stored fit, its parameters put into `model`; None where there is none that can be read."""
    try:
        content = torch.load(path, weights_only=True)
        model.load_state_dict(content["state"])
        outcome = content["outcome"] | {"kept": content["outcome"]["kept"].numpy()}
        errors: dict[str, Any] = {
            n: v.numpy() if isinstance(v, torch.Tensor) else v for n, v in content["uncertainty"].items()
        }
        return Fitted(FitOutcome(**outcome), Uncertainty(**errors), content["seconds"], reused=True)
    except FileNotFoundError:
        return None
    except Exception:
        # A damaged file, or one that another version wrote: the fit is made again and the file replaced.
        return None
