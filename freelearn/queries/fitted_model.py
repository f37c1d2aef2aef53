"""A fitted model, taken up again from a run's folder: what answers questions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import BED, DIAMETER, INFLATION, KINEMATIC, Bed, bed_of
from freelearn.data.columns import DESIGN, SECOND, Columns, design_column, members_in, pressure_column
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.queries.answers import SOLUTIONS, Answers, Column, answers
from freelearn.queries.asked_rows import as_numbers, in_time, leaves_length, with_design, with_held
from freelearn.queries.inverse.asker import Asker
from freelearn.queries.inverse.backwards import backwards, under_load
from freelearn.queries.inverse.bands import Bands
from freelearn.queries.inverse.raw_covariance import RawCovariance
from freelearn.queries.inverse.system import System
from freelearn.queries.log_answers import LogQuestion
from freelearn.records.run_files import RunFolder

WORDS = np.array([status.name.lower() for status in Status])


@dataclass(frozen=True, repr=False)
class Answer:
    """loads: force [N] and moment [N·m] of each row, (N, 2), or what else the bed measures, SI. stderr: one standard
    error of each that the parameters' uncertainty makes, (N, 2); NaN where that is not known. half: half of the band
    that holds a new measurement with 95 % probability, (N, 2). status: ok, no_equilibrium, singular or overstretched,
    (N,). asked: the table that was asked about, None for States.
    """

    loads: np.ndarray
    stderr: np.ndarray
    half: np.ndarray
    status: list[str]
    bed: Bed
    asked: pd.DataFrame | None = None

    def __len__(self) -> int:
        return len(self.loads)

    def __getitem__(self, names: Any) -> Any:
        """A column of `frame`, or several."""
        return self.frame()[names]

    def frame(self) -> pd.DataFrame:
        """The rows that were asked about, as far as a table held them, and what is predicted beside them."""
        told = self.table()
        if self.asked is None:
            return told
        own = self.asked.drop(columns=[name for name in told if name in self.asked])
        return pd.concat([own.reset_index(drop=True), told], axis=1).set_axis(own.index, axis=0)

    def __repr__(self) -> str:
        return repr(self.frame())

    def _repr_html_(self) -> str:
        return str(self.frame().to_html(max_rows=20, border=0, float_format="{:.5g}".format))

    def table(self) -> pd.DataFrame:
        """What the bed measures as predicted, in the columns and units of predictions.csv, each with its standard error
        and the ends of its band (force_pred_n, force_pred_n_stderr, force_pred_n_low, force_pred_n_high), and the
        status."""
        columns: dict[str, Any] = {}
        for i, quantity in enumerate(self.bed.readings):
            if quantity in self.bed.measured:
                value, half = self.loads[:, i] / quantity.factor, self.half[:, i] / quantity.factor
                columns[quantity.predicted] = value
                columns[f"{quantity.predicted}_stderr"] = self.stderr[:, i] / quantity.factor
                columns[f"{quantity.predicted}_low"], columns[f"{quantity.predicted}_high"] = value - half, value + half
        return pd.DataFrame(columns | {"status": self.status})


@dataclass(frozen=True)
class FittedModel:
    """A model with its parameters as fitted.

    model: the torch module. parameters: by name, SI. covariance: of the parameters in that order, (k, k), SI; NaN where
    the rows did not determine one, and for a run that fitted nothing. design: sample, gamma_deg, length_mm,
    inner_radius_mm, outer_radius_mm of each actuator in the run's table (of an end block, all its members'). run: what
    its folder holds. bed: that of the run's table. members: of an end block, by number. beside: bands of the model that
    it stands beside, which are its own then.
    """

    model: Model[Any]
    parameters: dict[str, float]
    covariance: np.ndarray
    design: pd.DataFrame
    run: RunFolder
    bed: Bed
    members: list[int]
    beside: Bands | None = None

    @classmethod
    def parts(cls, run: RunFolder) -> dict[str, Any]:
        """What a model is made of that was read from a run's folder."""
        rows = run.table
        design = rows.drop_duplicates("sample").sort_values("sample").reset_index(drop=True)
        members = members_in(design.columns)
        names = [*DESIGN, SECOND, *(design_column(name, m) for m in members for name in (*DESIGN, SECOND))]
        design = design[["sample", *(name for name in names if name in design)]]
        known = {"model": run.model, "parameters": run.model.scalars(), "covariance": run.covariance}
        return known | {"design": design, "run": run, "bed": bed_of(rows), "members": members}

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {value:.5g}" for name, value in self.parameters.items())
        return f"<{self.title}: {values or f'{len(self.model.vector())} weights'}>"

    @property
    def title(self) -> str:
        """Model and effects, as Run.title."""
        return " + ".join([self.model.name, *(effect.name for effect in self.model.effects)])

    @property
    def columns(self) -> Columns:
        """Of a measurement table like the run's."""
        return Columns(self.bed, len(self.members))

    @property
    def folder(self) -> Path:
        """Of the run."""
        return self.run.folder

    def table(self) -> pd.DataFrame:
        """The run's rows with their predictions, in the columns of predictions.csv."""
        return self.run.table.copy()

    @cached_property
    def rows(self) -> Rows:
        """The rows of the samples that were fitted, as they tell how far the model misses where it is asked."""
        own = torch.as_tensor(np.flatnonzero(self.run.own))
        return Rows.straight(self.run.table)[own]

    @cached_property
    def bands(self) -> Bands | None:
        """How far a new measurement may lie from what the model says; None where no row tells it."""
        if self.beside is not None:
            return self.beside.around(self.model)
        run, own = self.run, self.run.own
        seen = torch.as_tensor(run.seen[own])
        left = run.left_out.of(own) if run.left_out else None
        return Bands.from_model(self.model, self.rows, seen, self.covariance, run.accuracy, run.by_states, left)

    @cached_property
    def asker(self) -> Asker:
        """Answers questions; without a row that was fitted, from all of the run's."""
        rows = self.rows if len(self.rows) else Rows.straight(self.run.table)
        return Asker.from_model(self.model, rows, self.bands.miss if self.bands else None)

    def predict(self, states: States | pd.DataFrame, bands: bool = True) -> Answer:
        """Loads at states, or at the rows of a table in the measurement table's columns; or what else the bed measures.

        A table needs what the run's bed imposes (elongation_mm, twist_deg and pressure_kpa, or under a dead load
        force_n and moment_nmm in place of the first two; each actuator's pressure of an end block); the design's
        columns where the run has several samples and no column `sample` says which. Raises UserError.
        """
        asked = states if isinstance(states, pd.DataFrame) else None
        if isinstance(states, pd.DataFrame):
            complete = self._complete(with_held(states.reset_index(drop=True), self.run.table, loads=True))
            states = States.from_table(complete)
            if self.model.remembers(states):
                in_time(complete)
        with torch.no_grad():
            prediction = self.model(states)
        # The bed's own readings as outputs, whatever they are.
        system = System(self.model, states)
        stderr = _stderr(self.model, system.by_parameters(system.x), self.covariance)
        shown = self.bands if bands else None
        half = shown.half(states, prediction.loads) if shown else np.full(stderr.shape, np.nan)
        words = WORDS[prediction.status.numpy()].tolist()
        return Answer(prediction.loads.numpy(), stderr, half, words, states.bed, asked)

    def invert(self, questions: pd.DataFrame, bands: bool = True) -> Answers:
        """Whatever is blank in a table of questions: the loads at a state, the state that carries given loads (zero for
        a free end), the pressure to command.

        questions: in the measurement table's columns; any of elongation_mm, twist_deg, the pressures, force_n and
        moment_nmm may be blank (NaN) or absent. Raises UserError for a table that cannot be understood; a row that
        cannot be answered says why. Of a log (time_s and run) each recording is one question, whose answers have what
        the actuator remembers in them.
        """
        questions = with_held(questions.reset_index(drop=True), self.run.table, loads=False)
        complete = self._complete(questions, blanks=True)
        states = States.from_table(_neutral(complete))
        along = self.model.remembers(states) and self.bed is not INFLATION
        if along:
            in_time(complete)
        alone = not along and ("step" not in questions or pd.to_numeric(questions["step"]).isna().any())
        # Of a log what was before is known only once it is answered.
        states = states.replace(recording=None, place=None)
        # Each question stands for itself, an actuator that has stood still, unless steps say how it came there.
        states = _standing(states) if alone else _undirected(states, complete)
        system = System.from_model(self.model, states)
        x, y = _blanked(system, complete)
        y[:, self.never_shown] = torch.nan
        asker = replace(self.asker, banded=bands)
        if along:
            answered = LogQuestion(complete, self.bed, system, self._largest).answered(asker, x, y)
        else:
            answered = asker.answered(system, x, y)
        answered.y[:, self.never_shown] = torch.nan
        known = np.isin(complete["sample"], np.unique(self.rows.states.sample.numpy())) & self._same_design(complete)
        found = answers(questions, system, answered, known, self._diameter(questions, system, answered.x, bands))
        return self._beside(found, system, x, y)

    @cached_property
    def _largest(self) -> Tensor:
        """The largest of each reading that the model says of the run's rows, (2,) SI."""
        rows = self.rows if len(self.rows) else Rows.straight(self.run.table)
        with torch.no_grad():
            loads: Tensor = self.model(rows.states).loads
        return loads.abs().nan_to_num(nan=0.0).amax(0).clamp_min(1e-9)

    @cached_property
    def never_shown(self) -> list[int]:
        """Outputs that mean nothing: a network was never shown one of them."""
        if self.model.family != "mlp":
            return []
        return [i for i, there in enumerate(self.rows.readings.present.any(0).tolist()) if not there]

    def _beside(self, found: Answers, system: System, x: Tensor, y: Tensor) -> Answers:
        """Beside the places at which a network carries given loads, what one trained the other way says of them."""
        asked = x[:, :2].isnan().all(-1) & ~x[:, 2:].isnan().any(-1) & ~y.isnan().any(-1)
        if self.model.family != "mlp" or not system.mechanical or not bool(asked.any()):
            return found
        rows = torch.nonzero(asked)[:, 0]
        # Fitted outside: a fit needs derivatives.
        network = self._backwards
        with torch.no_grad():
            place = network(under_load(system.states[rows], y[rows])).loads
        table = found.filled.copy()
        for i, quantity in enumerate(system.inputs[:2]):
            column = np.full(len(table), np.nan)
            column[rows.numpy()] = place[:, i].numpy() / quantity.factor
            table.insert(table.columns.get_loc(SOLUTIONS), f"{quantity.column}_network", column)
        return replace(found, filled=table)

    @cached_property
    def _backwards(self) -> Model[Any]:
        seen = torch.as_tensor(np.flatnonzero(self.run.seen[self.run.own]))
        return backwards(self.rows[seen], int(self.run.content.get("seed", 0)))

    def _diameter(self, questions: pd.DataFrame, system: System, x: Tensor, bands: bool) -> Column | None:
        """The outer diameter at the answers, where it is asked for."""
        if DIAMETER.column not in questions and self.bed is not INFLATION:
            return None
        if not system.mechanical or system.states.members or type(self.model).diameter is Model.diameter:
            return None
        there = torch.nonzero(x.isfinite().all(-1))[:, 0]
        value, half = np.full(len(x), np.nan), np.full(len(x), np.nan)
        if len(there):
            states = system.states[there].with_inputs(x[there].unbind(-1))
            values = system.values
            with torch.no_grad():
                swollen = self.model.swollen(self.model.imposed(states, values), values)
            # As numbers of rows: a tensor of one would be taken for a single place.
            place = there.numpy()
            value[place] = swollen.numpy() / DIAMETER.factor
            half[place] = self.bands.diameter / DIAMETER.factor if bands and self.bands else np.nan
        return Column(DIAMETER.column, value, half)

    def _same_design(self, table: pd.DataFrame) -> np.ndarray:
        """Rows whose design is that of the run's sample of their number, (N,) bool."""
        own = table[["sample"]].merge(self.design, on="sample", how="left")
        names = [name for name in self.design if name != "sample" and name in table]
        same = np.ones(len(table), dtype=bool)
        for name in names:
            here, there = table[name].to_numpy(np.float64), own[name].to_numpy(np.float64)
            same &= np.isclose(here, there, rtol=1e-9, atol=0.0, equal_nan=True)
        return same

    def _complete(self, table: pd.DataFrame, blanks: bool = False) -> pd.DataFrame:
        """The table with the columns that States need. blanks: whether what is imposed may be blank or absent."""
        imposed, pressures = self.columns.imposed, list(self.columns.pressures)
        table = as_numbers(table, [str(name) for name in self.design], self.members)
        lacking = [name for name in imposed if name not in table]
        if lacking and not blanks:
            raise UserError(f"The table of states lacks the columns {', '.join(lacking)}: add them.")
        table = with_design(table, self.design)
        # Each row is a visit of its own unless the table says otherwise.
        missing: dict[str, Any] = {}
        for name in ("sample", "step"):
            missing[name] = table[name].fillna(0).astype(np.int64) if name in table else 0
        if blanks:
            leaves_length(table, self.members)
            every = (*imposed, *(q.column for q in (*self.bed.state, *self.bed.readings, *KINEMATIC.readings)))
            missing |= {name: np.nan for name in (*every, *(q.column for q in KINEMATIC.state)) if name not in table}
            if "time_s" in table and table["time_s"].isna().any():
                table = table.drop(columns="time_s")
        table = table.assign(**missing)
        more: dict[str, Any] = {"pressure_kpa": table[pressures].mean(axis=1, skipna=True)} if self.members else {}
        if self.bed is not KINEMATIC:
            more[BED] = self.bed.name
        return table.assign(**more)


def _neutral(table: pd.DataFrame) -> pd.DataFrame:
    """The table with something in the place of every blank, so that States can be made of it."""
    blank = [name for name in table if str(name).startswith(("elongation", "twist", "pressure", "force", "moment"))]
    return table.fillna(dict.fromkeys(blank, 0.0))


def _standing(states: States) -> States:
    """The states as of actuators that nothing has moved, and that remember nothing but where they are."""
    still = torch.zeros(len(states), dtype=torch.float64)
    named = ("direction", "moved_length", "moved_twist", "dwell", "clock")
    alone = states.replace(**dict.fromkeys(named, still), past_severity=states.severity)
    return alone.replace(members=tuple(_standing(member) for member in states.members))


def _undirected(states: States, table: pd.DataFrame) -> States:
    """The states without a direction of the pressure where one of the two that tell it is blank."""
    members = tuple(
        _directed(member, table[pressure_column(i)]) for i, member in enumerate(states.members, start=1)
    )  # fmt: skip
    return _directed(states, table["pressure_kpa"]).replace(members=members)


def _directed(states: States, pressure: pd.Series) -> States:
    blank = pressure.isna().to_numpy()
    lost = torch.as_tensor(blank | np.r_[False, blank[:-1]])
    return states.replace(direction=torch.where(lost, 0.0, states.direction))


def _blanked(system: System, table: pd.DataFrame) -> tuple[Tensor, Tensor]:
    """Inputs (N, m) and outputs (N, 2) of the questions, SI, NaN where they are blank."""
    x, y = system.x, torch.zeros(len(table), 2, dtype=torch.float64)
    for i, name in enumerate(system.columns[: len(system.inputs)]):
        x[torch.tensor(table[name].isna().to_numpy()), i] = torch.nan
        if system.mechanical and i < 2:
            value = torch.tensor(table[name].to_numpy(np.float64) * system.inputs[i].factor)
            x[:, i] = value + (system.states.reference_length if i == 0 else 0.0)
    for i, quantity in enumerate(system.bed.readings):
        y[:, i] = torch.tensor(table[quantity.column].to_numpy(np.float64) * quantity.factor)
    return x, y


def _stderr(model: Model[Any], rate: Tensor, covariance: np.ndarray) -> np.ndarray:
    """√(J C Jᵀ) of each reading, J (N, 2, p) its derivatives by the model's raw vector: (N, 2). A load that hangs on a
    parameter which nobody knows is not known either."""
    if not np.isfinite(covariance).any():
        return np.full(tuple(rate.shape[:2]), np.nan)
    spread = RawCovariance.from_model(model, covariance).spread(rate)
    deviation = spread.covariance.diagonal(dim1=1, dim2=2).clamp_min(0).sqrt()
    return torch.where(spread.lost, torch.nan, deviation).numpy()
