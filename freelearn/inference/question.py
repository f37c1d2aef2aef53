"""What a search is asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from freelearn.inference.derivatives import Build
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model
from freelearn.models.parameter import Prior
from freelearn.models.priors import RawPrior, raw_prior


@dataclass(frozen=True)
class Question:
    """Which of the candidates does the model miss on these rows?

    build: effect names → fresh model with these effects. candidates: names of the effects to try. accuracy: of the
    measuring. given: effects that the model has from the start: they are part of the question, and so are never taken
    out, exchanged or reported as missing. priors: the user's own, by the parameter's label. clocked: whether the rows
    tell when they were measured: nothing is sought in the time of rows that do not.
    """

    build: Callable[[Sequence[str]], Model]
    candidates: Sequence[str]
    rows: Rows
    accuracy: Accuracy
    seed: int
    given: Sequence[str] = ()
    priors: Mapping[str, Prior] = field(default_factory=dict)
    clocked: bool = True

    def added(self, effects: Sequence[str]) -> list[str]:
        """Those of a model's effects that were not given."""
        return [effect for effect in effects if effect not in self.given]

    def on(self, effects: Sequence[str]) -> Build:
        """What builds the model that has these effects, and more."""
        return lambda more: self.build([*effects, *more])

    def prior(self, model: Model, spans: Mapping[str, float]) -> RawPrior:
        """What is known of a model's raw vector."""
        return raw_prior(model, spans, self.priors)
