"""What a search found, taken up again from its folder: what `freelearn.discover` gives."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.results.fitted_model import FittedModel, load


@dataclass(frozen=True)
class Found:
    """A search's answer. folder: its run's; content: discovery.json."""

    folder: Path
    content: dict[str, Any]

    @classmethod
    def of(cls, folder: str | Path) -> Found:
        """What stands in the folder of a search that has ended."""
        return cls(Path(folder), json.loads((Path(folder) / "discovery.json").read_text(encoding="utf-8")))

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
    def next_experiment(self) -> Any:
        """What to measure next."""
        return self.content["next_experiment"]

    def frame(self) -> pd.DataFrame:
        """The models from the first to the last: effects, errors (fractions) and parameters, SI."""
        return pd.DataFrame(self.content["trail"])

    def summary(self) -> str:
        """The verdict in words, and what else a reader should know."""
        return "\n".join([self.content["says"], *(f"- {note}" for note in self.content["notes"])])

    @cached_property
    def model(self) -> FittedModel:
        """The last model, to predict with."""
        return load(self.folder)

    def predict(self, states: pd.DataFrame, bands: bool = True) -> pd.DataFrame:
        """What the last model predicts of new rows (FittedModel.predict), beside these: the readings, their standard
        errors and 95 % bands, in the columns of predictions.csv."""
        answer = self.model.predict(states, bands).table()
        return pd.concat([states.reset_index(drop=True), answer], axis=1)

    def table(self, when: str = "after") -> pd.DataFrame:
        """The rows looked at with the predictions of the first model (before) or of the last one (after)."""
        return pd.read_csv(self.folder / f"predictions_{when}.csv")

    def __repr__(self) -> str:
        return f"<{self.verdict}: {' + '.join(self.effects) or 'nothing added'}>"

    def _repr_html_(self) -> str:
        columns = ["effects", "E_train", "E_heldout", "noise_floor"]
        steps = self.frame()[columns].assign(effects=lambda t: [" + ".join(e) or "–" for e in t["effects"]])
        percent = dict.fromkeys(columns[1:], "{:.3%}".format)
        shown = steps.to_html(index=False, formatters=percent, border=0)
        return f"<p><b>{escape(self.verdict)}</b>: {escape(self.content['says'])}</p>{shown}"
