"""How a fit ended, and fits that are kept: what was fitted once is read, without Lightning."""

from __future__ import annotations

import hashlib
import inspect
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, fields
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import torch
from filelock import FileLock, Timeout
from torch import Tensor

from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import write_bytes
from freelearn.common.package import code_version
from freelearn.data.rows import Rows
from freelearn.fitting.options import FitOptions
from freelearn.fitting.uncertainty import Uncertainty
from freelearn.physics.chain.model import Model


@dataclass(frozen=True)
class FitOutcome:
    """kept: training rows that took part, (N,) bool. initial: raw vector (p,) before the fit. history: epoch,
    training and validation error. converged: whether the fit came to its own end, not to a limit of iterations or to
    a point from where nothing helps; message: one sentence on how it ended."""

    kept: np.ndarray
    initial: Tensor
    history: list[tuple[int, float, float]]
    message: str
    converged: bool


# Fits kept on disk and reused, under a key made of everything they depend on.

# Bytes of a digest.
DIGEST = hashlib.sha256().digest_size


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
    that need the same fit the second waits for the first one's.

    unkept: why fits could not be kept, "" where they could; nothing but the time of another fit depends on it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.unkept, self.swept = "", False

    def fitted(self, model: Model, key: str, compute: Callable[[], Fitted]) -> Fitted:
        """The fit under `key`, from its file or else from `compute`; the model holds its parameters afterwards."""
        path = self.folder / f"{key}.fit"
        self.sweep()
        if (kept := _read(path, model)) is not None:
            return kept
        with ExitStack() as held:
            try:
                self.folder.mkdir(parents=True, exist_ok=True)
                held.enter_context(_locked(self.folder / f".{key}.lock"))
            except (OSError, ValueError) as problem:
                self.unkept = str(cannot_write(self.folder, problem, "name another folder by fits=…"))
                return compute()
            if (kept := _read(path, model)) is not None:
                return kept
            fitted = compute()
            try:
                write_bytes(path, _packed(model, fitted))
            except UserError as problem:
                self.unkept = str(problem)
        return fitted

    def sweep(self) -> None:
        """Removes the locks of processes that were killed, and what they had begun to write under them."""
        if self.swept:
            return
        self.swept = True
        try:
            locks = list(self.folder.glob(".*.lock"))
        except (OSError, ValueError):
            return  # keeping a fit says what is wrong with the folder
        for lock in locks:
            # One that is held is in use.
            with suppress(OSError, ValueError, Timeout), _locked(lock, timeout=0):
                for unfinished in self.folder.glob(f"{lock.name.removesuffix('.lock')}.fit.*.part"):
                    unfinished.unlink()


@contextmanager
def _locked(path: Path, timeout: float = -1) -> Iterator[None]:
    """Holds a lock, and leaves no file of it behind: whoever waits for it, or makes it anew, looks for the fit first.
    timeout: how long to wait for it, −1 forever. Raises OSError, or Timeout."""
    with FileLock(path, timeout=timeout):
        try:
            yield
        finally:
            # Where an open file cannot be removed, the next command does.
            with suppress(OSError):
                path.unlink()


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
    digest.update(repr((description, model.known.plain(), asdict(options), seed, torch.__version__)).encode())
    return digest.hexdigest()[:24]


def timed(compute: Callable[[], tuple[FitOutcome, Uncertainty]]) -> Fitted:
    """The fit that `compute` makes, with the seconds it took."""
    began = time.perf_counter()
    outcome, errors = compute()
    return Fitted(outcome, errors, time.perf_counter() - began)


def _packed(model: Model, fitted: Fitted) -> bytes:
    """Plain containers and tensors, which torch reads back without executing anything, after their digest."""
    file = BytesIO()
    torch.save(
        {
            "state": model.description()["state"],
            "outcome": _plain(fitted.outcome),
            "uncertainty": _plain(fitted.uncertainty),
            "seconds": fitted.seconds,
        },
        file,
    )
    content = file.getvalue()
    return hashlib.sha256(content).digest() + content


def _plain(record: Any) -> dict[str, Any]:
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {name: torch.as_tensor(v) if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _read(path: Path, model: Model) -> Fitted | None:
    """The stored fit, its parameters put into `model`; None where there is none that can be read."""
    try:
        stored = path.read_bytes()
        digest, packed = stored[:DIGEST], stored[DIGEST:]
        # A number that changed on the disk would else be taken for the fit's.
        if hashlib.sha256(packed).digest() != digest:
            return None
        content = torch.load(BytesIO(packed), weights_only=True)
        outcome = content["outcome"] | {"kept": content["outcome"]["kept"].numpy()}
        errors: dict[str, Any] = {
            n: v.numpy() if isinstance(v, torch.Tensor) else v for n, v in content["uncertainty"].items()
        }
        fitted = Fitted(FitOutcome(**outcome), Uncertainty(**errors), content["seconds"], reused=True)
        model.load_state_dict(content["state"])
    except Exception:
        # No file, a damaged one, or one that another version wrote: the fit is made again and the file replaced.
        return None
    return fitted
