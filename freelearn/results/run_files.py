"""The files of one run. Each is written beside its place and renamed, `results.json` last: it marks a whole run."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.csv_text import csv_text
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.measurements.sets import samples_of
from freelearn.models.build import save_checkpoint
from freelearn.models.predicted import predicted_table
from freelearn.models.prediction import Status
from freelearn.results.fit_report import fit_report
from freelearn.results.run import Run


def check_folder(folder: Path) -> None:
    """Makes the run's folder and sees that it can be written to. Raises UserError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as problem:
        raise UserError(
            f"Cannot write to the output folder {folder}: {problem.strerror}. Set hydra.run.dir=…"
        ) from None


def write_run(run: Run, table: pd.DataFrame, folder: Path, about: dict[str, Any]) -> None:
    """Writes predictions.csv (`table`, from `predictions`), fit_report.txt, checkpoint.ckpt and results.json.

    about: what results.json says besides the run's own outcome (seed, split, data, key).
    """
    write_text(folder / "predictions.csv", csv_text(table, "%.10g"))
    write_text(folder / "fit_report.txt", report(run))
    save_checkpoint(run.model, folder / "checkpoint.ckpt")
    write_text(folder / "results.json", json.dumps(results(run, about), indent=2, allow_nan=False) + "\n")


def predictions(run: Run) -> pd.DataFrame:
    """The run's table with splits and predicted loads."""
    return predicted_table(run.table, run.labels, run.prediction)


def training_samples(run: Run, predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows of the samples that were fitted; all rows where nothing was."""
    if run.uncertainty is None:
        return predictions
    sample = predictions["sample"].to_numpy()
    return predictions[np.isin(sample, samples_of(run.train, sample))]


def counts(run: Run) -> dict[str, int]:
    """Rows of the table: all, used by the fit, buckled, and un-buckled ones without a valid prediction, by reason."""
    buckled = (run.table["buckled"] == 1).to_numpy()
    status = run.prediction.status.numpy()[~buckled]
    used = run.uncertainty.residuals // 2 if run.uncertainty else 0
    reasons = {s.name.lower(): int((status == s).sum()) for s in Status if s != Status.OK}
    return {"rows": len(run.table), "used": used, "buckled": int(buckled.sum()), **reasons}


def results(run: Run, about: dict[str, Any]) -> dict[str, Any]:
    """Everything in results.json. Numbers that do not exist are null."""
    return {
        "model": run.model.name,
        "train": run.train,
        "fit": run.method,
        "effects": [e.name for e in run.model.effects],
        "parameters": _parameters(run),
        "tests": {name: {k: _number(v) for k, v in e._asdict().items()} for name, e in run.errors.items()},
        "counts": counts(run),
        "seconds": run.seconds,
        "fit_seconds": run.fit_seconds,
        "fit_reused": run.reused,
        "outcome": run.message,
        **about,
    }


def _parameters(run: Run) -> dict[str, dict[str, Any]]:
    units = {name: p.unit for name, p in run.model.declared.items()}
    if run.uncertainty is None:
        return {n: {"value": v, "stderr": None, "unit": units[n]} for n, v in run.model.scalars().items()}
    found = run.uncertainty
    return {
        name: {
            "value": float(found.values[i]),
            "stderr": _number(found.stderr[i]),
            "unit": units.get(name, ""),
            "stderr_independent": _number(found.stderr_independent[i]),
        }
        for i, name in enumerate(found.names)
    }


def _number(value: float) -> float | None:
    return value if isinstance(value, int) else float(value) if math.isfinite(value) else None


def report(run: Run) -> str:
    """Text of fit_report.txt."""
    if run.uncertainty is None:
        values = "\n".join(
            f"    {n:<22} {v:>14.8g}  {run.model.declared[n].unit}" for n, v in run.model.scalars().items()
        )
        return f"[[Model]]\n    {run.model.name}\n[[Variables]] (nothing was fitted)\n{values}\n"
    epochs = run.history[-1][0] if run.history else 0
    return fit_report(run.model, run.uncertainty, run.start, run.method, run.message, epochs, counts(run))
