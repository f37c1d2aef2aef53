"""A run of a fit: the fitted model with its parameters, errors and pictures."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, Protocol

import pandas as pd
import torch

from freelearn.api.run_plots import RunPlots
from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import write_whole
from freelearn.common.formats import percent
from freelearn.data.columns import usable_rows
from freelearn.data.error import set_error
from freelearn.data.rows import Rows
from freelearn.export.certificate import Certificate
from freelearn.physics.chain.prediction import Status
from freelearn.queries.fitted_model import FittedModel
from freelearn.records.estimates import Estimate, parameter_table
from freelearn.records.run_files import KINDS, RunFolder, check_folder, read_run
from freelearn.report.tables.run_tables import beside


def copied(folder: Path, to: Path) -> Path:
    """Copies a run's folder; gives the copy. Raises UserError where a run lies there, or nothing can be written."""
    if to.resolve() == folder.resolve():
        return to
    if any((to / mark).exists() for mark in KINDS):
        raise UserError(f"{to} holds a run already: choose another folder, or delete it.")
    files = sorted((path for path in folder.rglob("*") if path.is_file()), key=lambda path: path.name in KINDS)
    for path in files:
        place = to / path.relative_to(folder)
        check_folder(place.parent)
        try:
            write_whole(place, _copy_of(path))
        except OSError as problem:
            raise cannot_write(place, problem) from None
    return to


def _copy_of(path: Path) -> Callable[[Path], None]:
    def write(beside: Path) -> None:
        shutil.copyfile(path, beside)

    return write


class Unfitted(Protocol):
    """A fit that is still to be made."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Its options."""


# Columns of a parameter in `frame`.
PARAMETER = ["value", "stderr", "low", "high", "unit"]


@dataclass(frozen=True, repr=False)
class FittedRun(FittedModel):
    """What `fit` gives and `load` takes up again. unfitted: the same fit, still to be made; None for a run of another
    session."""

    unfitted: Unfitted | None = None

    @classmethod
    def from_folder(cls, run: str | Path | RunFolder, unfitted: Unfitted | None = None) -> FittedRun:
        """The run in a folder. Raises UserError."""
        read = run if isinstance(run, RunFolder) else read_run(run)
        return cls(**cls.parts(read), unfitted=unfitted)

    @cached_property
    def plot(self) -> RunPlots:
        """Its pictures: `plot.parity()`, `.residuals()`, `.curves()`, `.heatmap()`; of a log `.recording()`, `.loops()`
        and `.spectra()`."""
        return RunPlots(self)

    @property
    def errors(self) -> pd.DataFrame:
        """E by test set (fractions): E, E_force, E_moment and so on, and n, the rows scored."""
        return pd.DataFrame.from_dict(self.run.content.get("tests", {}), orient="index").rename_axis("test")

    @property
    def notes(self) -> list[str]:
        """What a reader should know of the run."""
        return [str(note) for note in self.run.content.get("notes", [])]

    def frame(self) -> pd.DataFrame:
        """The parameters: value, standard error, ends of the 95 % interval (SI) and unit, one a row."""
        rows = {e.name: {"value": e.value, "stderr": e.stderr, "low": e.low, "high": e.high, "unit": e.unit}
                for e in self._estimates()}  # fmt: skip
        return pd.DataFrame.from_dict(rows, orient="index", columns=PARAMETER).rename_axis("parameter")

    @property
    def untold(self) -> list[str]:
        """The positive parameters of which its rows say nothing."""
        return [e.name for e in self._estimates() if e.untold]

    def summary(self) -> str:
        """What was fitted to what, how well, the parameters, and what else to know."""
        content = self.run.content
        how = f"fitted on {content['train']}" if content.get("fit") != "none" else "not fitted"
        errors = [f"E = {percent(row['E'])} % on {name} ({row['n']:.0f} rows)" for name, row in self._shown_errors()]
        parameters = [parameter_table(self._estimates()).text()] if self.parameters else []
        parameters += filter(None, [beside(content.get("learned", 0))])
        return "\n".join([f"{self.title}, {how}", *errors, *parameters, *(f"- {note}" for note in self.notes)])

    def error(self, table: pd.DataFrame) -> float:
        """E (a fraction) on a table's rows, buckled and left-out ones apart: √mean(((F−F̂)/max|F|)² + ((M−M̂)/max|M|)²).

        table: as of `predict`, with what was measured. Raises UserError.
        """
        complete = self._complete(table.reset_index(drop=True))
        used = complete[usable_rows(complete)] if "buckled" in complete else complete
        rows = Rows.from_table(used.reset_index(drop=True))
        if not bool(rows.readings.present.any()):
            raise UserError("The table has no reading to score by: fill in what was measured.")
        with torch.no_grad():
            loads, status = self.model(rows.states)
        return set_error(rows, loads, status == Status.OK).E

    def score(self, table: pd.DataFrame, y: object = None) -> float:
        """−E on a table's rows, as scikit-learn scores: of two the better is the larger."""
        return -self.error(table)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The options of `fit` that made it. Raises UserError for a run of another session, which does not keep all."""
        return self._unfitted.get_params()

    def __sklearn_clone__(self) -> Unfitted:
        """The same fit, still to be made: what scikit-learn's `clone` gives."""
        return type(self._unfitted)(**self.get_params())

    @property
    def _unfitted(self) -> Unfitted:
        if self.unfitted is None:
            raise UserError(f"The options of {self.folder} are not known in this session: fit it here.")
        return self.unfitted

    def save(self, folder: str | Path) -> Path:
        """Copies the run's files, those of `freelearn train`, to a folder, from which `load` takes it up again. Raises
        UserError."""
        return copied(self.folder, Path(folder))

    def export(
        self,
        path: str | Path,
        to: str | None = None,
        *,
        name: str | None = None,
        sample: int | None = None,
        force: bool = False,
        license: str | None = None,
        error: float = 1e-3,
    ) -> Certificate:
        """Writes the actuator for other software, and its certificate (export.json, export.html) beside it.

        path: a file, which names actuator and format by its ending (.onnx, .c, .fmu, .xml, .nc), or a folder with `to`:
        onnx, c, fmu, mujoco or table. sample: of a run that was fitted on several. force: whether to export what the
        data do not determine. license: of the data. error: of a table, a share of the range. Raises UserError.
        """
        from freelearn.export.export import export
        from freelearn.export.export_options import Options, asked_for

        folder, to, named = asked_for(path, to)
        options = Options(to, name or named, sample, force, license, error)
        return export(self, folder, options)

    def _estimates(self) -> list[Estimate]:
        entries = self.run.content.get("parameters", {})
        return [Estimate.from_plain(name, entry) for name, entry in entries.items() if name in self.parameters]

    def _shown_errors(self) -> list[tuple[str, Any]]:
        """Of the set that was fitted, or else of all."""
        train, errors = str(self.run.content.get("train", "")), self.errors
        shown = errors.loc[[train]] if train in errors.index else errors
        return [(str(name), row) for name, row in shown.iterrows() if "E" in row and pd.notna(row["E"])]

    def _repr_html_(self) -> str:
        errors = "; ".join(f"E = {percent(row['E'])} % on {escape(name)}" for name, row in self._shown_errors())
        table = self.frame().to_html(border=0, float_format="{:.4g}".format) if self.parameters else ""
        return f"<p><b>{escape(self.title)}</b>{f': {errors}' if errors else ''}</p>{table}"
