"""results.json read back: what is known of a run without its model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freelearn.common.errors import UserError
from freelearn.records.estimates import Estimate
from freelearn.records.provenance import Provenance, read_document
from freelearn.records.sweep_records import job_order


@dataclass(frozen=True)
class RunRecord:
    """A run's entry in results.json. estimates: of its parameters; method: of its fit, none where nothing was fitted;
    folder: where its other files lie."""

    folder: Path
    model: str
    effects: tuple[str, ...]
    train: str
    method: str
    seed: int
    provenance: Provenance
    estimates: tuple[Estimate, ...]

    @property
    def title(self) -> str:
        """Model and effects, as Run.title."""
        return " + ".join([self.model, *self.effects])

    @classmethod
    def from_plain(cls, content: Mapping[str, Any], folder: Path) -> RunRecord:
        """The record that run_files.results wrote. Raises KeyError or TypeError for what is no such content."""
        return cls(
            folder,
            str(content["model"]),
            tuple(content["effects"]),
            str(content["train"]),
            str(content["fit"]),
            int(content["seed"]),
            Provenance.from_plain(content["data"]),
            tuple(Estimate.from_plain(name, entry) for name, entry in content["parameters"].items()),
        )


def read_records(folder: Path) -> list[RunRecord]:
    """The runs in a run's folder, or in a sweep's in the order of its jobs. Raises UserError without a whole one."""
    alone = folder / "results.json"
    jobs = sorted(folder.glob("*/results.json"), key=lambda path: job_order(path.parent))
    paths = [alone] if alone.exists() else jobs
    if not paths:
        raise UserError(f"No results in {folder}: name the folder of a run or of a sweep.")
    return [_record(path) for path in paths]


def _record(path: Path) -> RunRecord:
    content = read_document(path)
    try:
        return RunRecord.from_plain(content, path.parent)
    except (ValueError, KeyError, TypeError, AttributeError) as problem:
        raise UserError(f"{path} is not the results.json of a run ({problem}): make the run again.") from None
