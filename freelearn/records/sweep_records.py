"""The results of a sweep's jobs as one table, and what is known of a run without its model."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.common.errors import UserError
from freelearn.records.estimates import Estimate
from freelearn.records.provenance import Provenance, read_document

# What a failed job leaves instead of results.json.
ERROR_FILE = "error.json"

# Columns of heatmap.csv; those up to `run` are the contract's, in its order.
COLUMNS = (
    "model",
    "train",
    "test",
    "E",
    "E_force",
    "E_moment",
    "n",
    "seed",
    "effects",
    "run",
    "fit",
    "split",
    "parameters",
    "data",
    "label",
    "error",
)


def collect(folders: Sequence[Path]) -> pd.DataFrame:
    """One row per tested cell of every job in the sweeps' folders, and one per failed job (E blank, `error` filled).

    `label` names what is compared: the model, with its effects, and with its fit and split where they differ
    between the model's jobs. Files still being written are never read: results are renamed into place. Raises
    UserError when there is nothing to gather.
    """
    rows: list[dict[str, Any]] = []
    for folder in folders:
        for job in _jobs(folder):
            rows += _rows(job, folder if len(folders) == 1 else folder.parent)
    if not rows:
        named = ", ".join(map(str, folders))
        raise UserError(f"No results in {named}: name a sweep's folder, whose subfolders hold results.json files.")
    table = pd.DataFrame(rows)
    table["label"] = _labels(table)
    # Errors of what other beds than the kinematic one measure.
    others = sorted(str(name) for name in table if str(name).startswith("E_") and name not in COLUMNS)
    return table.reindex(columns=[*COLUMNS, *others])


def _jobs(folder: Path) -> list[Path]:
    """Folders of jobs that ended, in the order of their numbers."""
    ended = {path.parent for name in ("results.json", ERROR_FILE) for path in folder.glob(f"*/{name}")}
    return sorted(ended, key=job_order)


def job_order(folder: Path) -> tuple[bool, int, str]:
    """Sorts folders of jobs by the number at the end of their names; those without one are last.

    >>> sorted(map(Path, ("b_seed0_10", "mine", "c_seed0_2", "7")), key=job_order)[:3] == [
    ...     Path("c_seed0_2"), Path("7"), Path("b_seed0_10")]
    True
    """
    number = re.search(r"(?:^|_)(\d+)$", folder.name)
    return number is None, int(number[1]) if number else 0, folder.name


def _rows(job: Path, base: Path) -> list[dict[str, Any]]:
    name = str(job.relative_to(base)) if job.is_relative_to(base) else str(job)
    path = job / "results.json"
    failed = not path.exists()
    try:
        content = read_document(job / ERROR_FILE if failed else path)
        common = {key: content.get(key) for key in ("model", "train", "seed", "fit", "split")}
        common |= {"effects": "+".join(content["effects"]), "run": name, "error": ""}
        if failed:
            return [common | {"test": content["test"], "error": content["error"]}]
        common |= {"parameters": len(content["parameters"]) + content.get("learned", 0), "data": content["data"]}
        return [common | {"test": test, **scores} for test, scores in content["tests"].items()]
    except UserError as problem:
        wrong = str(problem)
    except (KeyError, TypeError, AttributeError) as problem:
        wrong = f"{job} holds no results of a run ({type(problem).__name__}: {problem}): make the run again"
    return [{"run": name, "error": wrong, "model": "?", "effects": ""}]


def _labels(table: pd.DataFrame) -> pd.Series:
    """What each row's run is called in a comparison."""
    label = table["model"].astype(str)
    label = label.where(table["effects"] == "", label + "+" + table["effects"])
    for column in ("fit", "split"):
        if column in table:
            # A run that fits nothing is not another way of fitting.
            values = table[column].where(table[column] != "none")
            several = values.groupby(label).transform("nunique") > 1
            label = label.where(~several | values.isna(), label + " " + values.astype(str))
    return label


def read_gathered(path: Path) -> pd.DataFrame:
    """A heatmap.csv as the table that it was written from. Raises UserError."""
    try:
        # A column that is blank throughout would be read as one of numbers.
        table = pd.read_csv(path, dtype={"error": "string", "label": "string"})
        return table.assign(error=table["error"].fillna("").astype(object), label=table["label"].astype(object))
    except (OSError, ValueError, KeyError) as problem:
        raise UserError(f"{path} is not a gathered sweep: {problem}") from None


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
