"""A finished run as the page compares it with the measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.api.fitted_run import FittedRun
from freelearn.common.errors import UserError
from freelearn.data.beds import Quantity, bed_of
from freelearn.data.columns import usable_rows
from freelearn.data.logs import RUN, is_log
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States, kinematic_state
from freelearn.discovery.search.testable import candidates
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import usable
from freelearn.physics.effects.registry import lent
from freelearn.physics.models.build import load_model
from freelearn.physics.written.source import effect_class
from freelearn.queries.curves.curve_rows import curves_of, measured_quantities, misses, plane, sweep_text
from freelearn.queries.curves.log_spectra import Spectrum, log_spectra
from freelearn.queries.curves.model_curves import model_curve, taut_rows
from freelearn.queries.curves.shown_states import ROWS_FOR_A_CURVE, fields, place_text, places
from freelearn.queries.inverse.bands import Bands
from freelearn.report.tables.residual_tables import residual_table
from freelearn.workbench.state.proposed import proposed
from freelearn.workbench.state.session_store import SessionStore


class Fitted:
    """A finished run's rows, states and model.

    curve: number of each row's curve, (N,), see curve_rows. place: of each curve, its sample and what the bed
    imposes, by its number. over: the two quantities of the map; map: its fields; field: number of each row's field,
    (N,). own: see Question; here the program writes these effects anew, and runs none of the files."""

    def __init__(self, folder: Path, own: Sequence[str] = ()) -> None:
        self.folder = folder
        self.own = [effect_class(proposed(Path(path), folder.parent).written) for path in own]
        with lent(self.own):
            self.model: Model = load_model(folder / "checkpoint.ckpt")
        own_run = folder / "predictions.csv"
        self.table = pd.read_csv(own_run if own_run.exists() else folder / "predictions_after.csv")
        self.states = States.from_table(self.table)
        self.usable, self.taut = usable_rows(self.table), taut_rows(self.table)
        self.state = state = kinematic_state(self.table)
        self.curve = curves_of(self.table, state)
        first = np.unique(self.curve, return_index=True)[1]
        self.place = places(self.table).iloc[state[first]].set_index(np.arange(len(first)))
        self.bed, self.told = bed_of(self.table), measured_quantities(self.table)
        self.missed = misses(usable(self.table))
        # Of a bed that held an elongation or a twist throughout, the map shows the pressure in its place.
        self.over = plane(self.table)
        self.map = residual_table(self.table, self.over)
        self.field = fields(self.table, self.over)[0]

    def rows(self, curve: int) -> np.ndarray:
        """Positions of a curve's rows, in time order."""
        return np.flatnonzero(self.curve == curve)

    def told_of(self, sample: int) -> tuple[Quantity, ...]:
        """What was measured of a sample."""
        return measured_quantities(self.table[self.table["sample"] == sample]) or self.told

    def labels(self, sample: int) -> dict[int, str]:
        """The sample's curves that have usable rows, by their place, and what each is called."""
        used = np.isin(np.arange(len(self.place)), self.curve[self.usable])
        order = [quantity.column for quantity in self.bed.state]
        shown = self.place[(self.place["sample"] == sample) & used].sort_values(order, kind="stable")
        return {int(n): self._label(int(n), place) for n, place in shown.iterrows()}

    def _label(self, curve: int, place: pd.Series) -> str:
        rows = self.table.iloc[self.rows(curve)]
        run = f"run {rows[RUN].iloc[0]}" if self.log else ""
        parts = [run, place_text(place, self.bed.state), sweep_text(rows)]
        return ", ".join(part for part in parts if part).replace("-", "−")

    def worst(self, curves: list[int]) -> int:
        """That of these curves on which the model errs most, on average over its rows."""
        curve = self.curve[self.missed.index]
        each = self.missed.groupby(curve)
        rows = each.size().reindex(curves, fill_value=0)
        enough = rows.index[rows >= min(ROWS_FOR_A_CURVE, rows.max())]
        size = (each.mean().abs() / self.missed.abs().max().replace(0.0, 1.0)).sum(axis=1)
        return int(size.reindex(enough).fillna(0.0).idxmax())

    @cached_property
    def testable(self) -> tuple[list[str], dict[str, str]]:
        """The effects that a search of these rows would try, and of others why it would not; nothing is said of what
        no table without recordings has."""
        rows = Rows(self.states, Readings.from_table(self.table), self.state)
        names, others, _ = candidates(
            self.model, (), self.table.columns, rows[torch.as_tensor(np.flatnonzero(self.usable))]
        )
        return names, {other["effect"]: other["reason"] for other in others}

    @cached_property
    def log(self) -> bool:
        """Whether its rows are samples of recordings."""
        return is_log(self.table)

    @cached_property
    def _as_run(self) -> FittedRun:
        with lent(self.own):
            return FittedRun.from_folder(self.folder)

    @cached_property
    def spectra(self) -> list[Spectrum]:
        """What the model leaves of a log by its frequency, beside the noise that was stated or estimated."""
        return log_spectra(self.model, self.table, self._as_run.run.accuracy)

    @cached_property
    def bands(self) -> Bands | None:
        """How far a new measurement may lie from the model; None where no row tells it."""
        with lent(self.own):
            return self._as_run.bands

    def predicted(self, rows: np.ndarray, banded: bool = False, of: Fitted | None = None) -> pd.DataFrame:
        """What the model predicts along the pressures of these rows (see model_curves.model_curve). banded: with its
        bands. of: the run whose rows they are, this one by default: another run's table holds others at the same
        positions, a search's for one only those that it was asked about."""
        shown, bands = of or self, self.bands if banded else None
        return model_curve(self.model, shown.states[torch.as_tensor(rows)], shown.usable[rows], shown.taut[rows], bands)


@lru_cache(8)
def fitted(folder: Path, written: float, own: tuple[str, ...] = ()) -> Fitted:
    """written: when the run was, so that a newer one in the same folder is read anew."""
    return Fitted(folder, own)


def of_run(session: SessionStore, run: Mapping[str, Any]) -> Fitted:
    """A run that the session lists."""
    folder = session.folder / run["folder"]
    return fitted(folder, written(folder), run["question"].own)


def written(folder: Path) -> float:
    """When a run, or a search, was written to its folder."""
    found = [path for name in ("results.json", "discovery.json") if (path := folder / name).exists()]
    if not found:
        raise UserError(f"{folder} holds no results any more: fit again.")
    return found[0].stat().st_mtime
