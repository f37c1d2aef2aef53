"""A written effect fitted in full, inside the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from freelearn.inference.noise import Whitener
from freelearn.inference.prepare import Prepared
from freelearn.inference.refit import proper
from freelearn.inference.step import Step
from freelearn.inference.thresholds import SECOND_INPUT
from freelearn.inference.white_fit import white_fit
from freelearn.models.effect import Effect
from freelearn.models.effects.registry import EFFECTS, lent
from freelearn.models.written.source import effect_class
from freelearn.models.written.written import Written


@dataclass(frozen=True)
class Trial:
    """A step one of whose effects is this written one."""

    written: Written
    step: Step

    @property
    def kind(self) -> type[Effect[Any]]:
        """The effect's class."""
        return effect_class(self.written)

    def cost(self, scale: float) -> float:
        """χ² in units of the noise's, with what its constants and a second input cost: the least is the best.

        Not the held-out χ²: leaving a state out by one linear step does not tell where a jump goes. scale: of the
        noise, in units of the stated one."""
        fit, readings = self.step.fit, self.step.whiten.count
        return fit.chi2 / scale**2 + price(self.written.form.count, len(self.written.inputs), readings)

    def fitted(self) -> Written:
        """As it was fitted: its constants there."""
        values = self.step.fit.values()
        return self.written.started({c.name: values[f"{self.written.name}.{c.name}"] for c in self.written.constants()})


def tried(
    prepared: Prepared, base: Step, written: Written, whiten: Whitener | None = None, start: Step | None = None
) -> Trial | None:
    """The base's model with a written effect more, fitted; None where that does not end in a minimum.

    whiten: the base's by default. start: a step with the effect to set out from; by default the base, at no amount."""
    kind, whiten = effect_class(written), whiten or base.whiten
    if EFFECTS.get(kind.name, kind) is not kind:
        # A user's own of this name: it is a candidate like any other.
        return None
    with lent([kind]):
        effects = [*(name for name in base.effects if name != kind.name), kind.name]
        model = prepared.question.build(effects)
        known = dict(zip(base.fit.model.labels(), base.fit.vector, strict=True))
        if start is not None:
            known |= dict(zip(start.fit.model.labels(), start.fit.vector, strict=True))
        vector = model.vector().detach().clone()
        for i, label in enumerate(model.labels()):
            if label in known:
                vector[i] = known[label]
            elif model.declared[label].none is not None:
                # The first step from no amount is the one that the guess was made by, for all parameters at once.
                vector[i] = 0.0
        fit = white_fit(model, prepared.rows, whiten, vector)
        return Trial(written, prepared.step(effects, fit, whiten)) if proper(fit) else None


def price(constants: int, inputs: int, readings: int) -> float:
    """What a form has to explain of χ², in units of the noise's, to be worth its constants (Schwarz 1978), and a second
    input: there are several times as many pairs."""
    each = math.log(max(readings, 2))
    return each * constants + (SECOND_INPUT + each) * (inputs - 1)
