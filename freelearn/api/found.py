"""What a search found: what `discover` gives, and `load` of its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.api.fitted_run import FittedRun, copied
from freelearn.api.run_plots import FoundPlots
from freelearn.common.errors import UserError
from freelearn.data.beds import bed_of
from freelearn.data.states import States
from freelearn.export.certificate import Certificate
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.models.build import build_model
from freelearn.physics.written.source import effect_class
from freelearn.queries.answers import Answers
from freelearn.queries.averages import averaged_answers, averaged_prediction, predictive_shares
from freelearn.queries.curves.model_curves import StateCurves, state_curves
from freelearn.queries.curves.shown_states import pick_states
from freelearn.queries.fitted_model import Answer
from freelearn.records.discovery import Discovery
from freelearn.records.run_files import RunFolder
from freelearn.records.suspected_readings import with_marks

# Of a suspected reading: what tells its row in the tables of predictions.
PLACE = ("sample", "step", "elongation_mm", "twist_deg", "pressure_kpa")


@dataclass(frozen=True)
class Found:
    """A search's answer. folder: its run's; content: discovery.json. outcome: as it came out, in the session that
    searched. read: the last model, where that has been read already."""

    folder: Path
    content: dict[str, Any]
    outcome: Discovery | None = None
    read: FittedRun | None = None

    @classmethod
    def from_folder(cls, folder: str | Path, outcome: Discovery | None = None) -> Found:
        """What stands in the folder of a search that has ended. Raises UserError."""
        path = Path(folder) / "discovery.json"
        try:
            return cls(Path(folder), json.loads(path.read_text(encoding="utf-8")), outcome)
        except (OSError, ValueError) as problem:
            raise UserError(f"{path} is not what a search wrote: {problem}.") from None

    @property
    def verdict(self) -> str:
        """adequate, named, class, proposed, unexplained or undecided."""
        return str(self.content["verdict"])

    @property
    def effects(self) -> list[str]:
        """The effects that were missing, the one that lowers the error most first."""
        return list(self.content["effects"])

    @property
    def classes(self) -> list[list[str]]:
        """For each effect all that the data cannot tell from it, itself first."""
        return [list(members) for members in self.content["classes"]]

    @property
    def models(self) -> pd.DataFrame:
        """The sets of effects that are as good: effects, E_heldout (a fraction), probability and parameters, SI."""
        return pd.DataFrame(self.content["models"])

    @property
    def candidates(self) -> pd.DataFrame:
        """What each effect promised on the first model, and why one was not tried."""
        return pd.DataFrame(self.content["candidates"])

    @property
    def referee(self) -> pd.DataFrame:
        """The checks of the claim: each with its result, figure and threshold."""
        return pd.DataFrame(self.content["referee"])

    @property
    def checks(self) -> pd.DataFrame:
        """The look at the table before the search."""
        return pd.DataFrame(self.content["checks"])

    @property
    def failures(self) -> pd.DataFrame:
        """Where the first model fails, the worst place first."""
        return pd.DataFrame(self.content["failures"])

    @property
    def suspects(self) -> pd.DataFrame:
        """Readings that slipped, perhaps, the worst first."""
        return pd.DataFrame(self.content["suspects"])

    @property
    def next_experiment(self) -> pd.DataFrame:
        """States whose measurement would tell apart what cannot be told yet; `plan` chooses among all."""
        return pd.DataFrame(self.content["next_experiment"])

    @cached_property
    def plot(self) -> FoundPlots:
        """Its pictures: `plot.staircase()`, `.ranking()`, `.residuals()`, `.curves()`, `.parity()`."""
        return FoundPlots(self)

    def frame(self) -> pd.DataFrame:
        """The models from the first to the last: effects, errors (fractions) and parameters, SI."""
        return pd.DataFrame(self.content["trail"])

    def summary(self) -> str:
        """The verdict in words, and what else a reader should know."""
        return "\n".join([self.content["says"], *(f"- {note}" for note in self.content["notes"])])

    @cached_property
    def fitted(self) -> FittedRun:
        """The last model, to predict with. Raises UserError where it has an effect that the search wrote and whose file
        FREELEARN_EFFECTS does not name, in another session than that of the search."""
        if self.read is not None:
            return self.read
        with self._written():
            return FittedRun.from_folder(self.folder)

    @cached_property
    def sets(self) -> list[tuple[float, FittedRun]]:
        """The sets of effects that are as good, each with its share in what all predict together (see
        `predictive_shares`). What the search wrote itself is among their effects in its own session, or where
        FREELEARN_EFFECTS names its file; else no set with it is here."""
        fitted, given, made = self.fitted, self.content["given_effects"], []
        with self._written():
            told = [each for each in self.content["models"] if set(each["effects"]) <= set(EFFECTS)]
            for each in told:
                model = self._model([*given, *each["effects"]], each["parameters"])
                values = model.scalars()
                unknown = np.full((len(values), len(values)), np.nan)
                made.append(replace(fitted, model=model, parameters=values, covariance=unknown, beside=fitted.bands))
        columns = ([each["probability"] for each in told], [each["E_heldout"] for each in told])
        return list(zip(predictive_shares(*columns, states=len(np.unique(fitted.rows.state))), made, strict=True))

    def predict(self, states: States | pd.DataFrame, bands: bool = True, average: bool = False) -> Answer:
        """What the last model predicts of new rows, see FittedRun.predict. average: the mean of what all sets of
        effects predict that are as good, each with its share (`sets`); its bands are the last model's, wider by how far
        they lie apart."""
        last = self.fitted.predict(states, bands)
        if not average or not self.sets:
            return last
        others = [each.predict(states, bands=False) for _, each in self.sets]
        return averaged_prediction(last, others, [share for share, _ in self.sets])

    def invert(self, questions: pd.DataFrame, bands: bool = True, average: bool = False) -> Answers:
        """The blanks of a table of questions, filled by the last model; see FittedRun.invert. average: as of `predict`;
        `solutions` and what else is said of a row are the last model's."""
        last = self.fitted.invert(questions, bands)
        if not average or not self.sets:
            return last
        others = [each.invert(questions, bands=False) for _, each in self.sets]
        return averaged_answers(last, others, [share for share, _ in self.sets])

    def score(self, table: pd.DataFrame, y: object = None) -> float:
        """−E of the last model on a table's rows."""
        return self.fitted.score(table)

    @property
    def model(self) -> Model[Any]:
        """The last model itself: a torch module."""
        return self.fitted.model

    @property
    def title(self) -> str:
        """The last model and its effects."""
        return self.fitted.title

    @property
    def parameters(self) -> dict[str, float]:
        """Of the last model, SI."""
        return self.fitted.parameters

    @property
    def covariance(self) -> np.ndarray:
        """Of the last model's parameters, in their order, SI (k, k)."""
        return self.fitted.covariance

    @property
    def design(self) -> pd.DataFrame:
        """Of each actuator in the table."""
        return self.fitted.design

    @property
    def run(self) -> RunFolder:
        """What the folder holds."""
        return self.fitted.run

    def table(self, when: str = "after") -> pd.DataFrame:
        """The rows looked at with the predictions of the first model (before) or of the last one (after)."""
        return pd.read_csv(self.folder / f"predictions_{when}.csv")

    def trusted(self, when: str) -> pd.DataFrame:
        """The same, with the rows of suspected readings left out and marked: what pictures are drawn from. Raises
        UserError."""
        if when not in ("before", "after"):
            raise UserError(f"when = {when!r} is not possible: choose before or after.")
        table = self.table(when)
        marks = {q.name: np.zeros(len(table), dtype=bool) for q in bed_of(table).measured}
        for suspect in (each for each in self.content["suspects"] if len(each["lines"]) == 1):
            same = [np.isclose(table[name], suspect[name]) for name in PLACE if suspect.get(name) is not None]
            marks[suspect["load"]] |= np.all(same, axis=0)
        return with_marks(table, marks)

    @cached_property
    def state_curves(self) -> list[StateCurves]:
        """Measured rows with the curves of the first and the last model, at a few states."""
        if self.outcome is not None:
            return list(self.outcome.curves)
        table = self.trusted("before")
        models, bands = {"before": self.first_model, "after": self.fitted.model}, {"after": self.fitted.bands}
        return state_curves(models, table, pick_states(table)[1:], bands=bands)

    @property
    def first_model(self) -> Model[Any]:
        """The model that the search began with, as fitted."""
        first = self.content["trail"][0]
        return self._model(first["effects"], first["parameters"])

    def _model(self, effects: Sequence[str], parameters: Mapping[str, float]) -> Model[Any]:
        """A model of the same samples or members, with these parameters, SI."""
        known = self.fitted.model.description()
        model = build_model(self.content["model"], {}, effects, known["samples"], known["members"])
        model.set_values(parameters)
        return model

    def _written(self) -> AbstractContextManager[None]:
        """In it the effects that the search wrote are known, where this is its session."""
        proposals = self.outcome.findings.proposals if self.outcome else []
        return lent(effect_class(each.written) for each in proposals)

    def save(self, folder: str | Path) -> Path:
        """Copies the run's files, those of `freelearn discover`, to a folder, from which `load` takes it up again.
        Raises UserError."""
        return copied(self.folder, Path(folder))

    def export(self, path: str | Path, to: str | None = None, **options: Any) -> Certificate:
        """Writes the last model for other software, see FittedRun.export. Raises UserError."""
        return self.fitted.export(path, to, **options)

    def __repr__(self) -> str:
        return f"<{self.verdict}: {' + '.join(self.effects) or 'nothing added'}>"

    def _repr_html_(self) -> str:
        columns = ["effects", "E_train", "E_heldout", "noise_floor"]
        steps = self.frame()[columns].assign(effects=lambda t: [" + ".join(e) or "–" for e in t["effects"]])
        percent = dict.fromkeys(columns[1:], "{:.3%}".format)
        shown = steps.to_html(index=False, formatters=percent, border=0)
        return f"<p><b>{escape(self.verdict)}</b>: {escape(self.content['says'])}</p>{shown}"
