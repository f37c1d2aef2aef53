"""A first look at one form at one place: how much it promises to explain, and from where a fit should set out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from freelearn.models.written.forms import Form, amount
from freelearn.models.written.inputs import Input
from freelearn.models.written.places import Place
from freelearn.models.written.written import Written, scaled


@dataclass(frozen=True)
class Guess:
    """gain: reduction of χ² in units of its noise that the linearized form promises; worth: the same less what its
    constants cost. amounts (in the place's unit) and shapes, both SI, begin a fit. p_value: chance that the most
    promising of all guesses would promise as much if there were nothing to find."""

    place: Place
    inputs: tuple[Input, ...]
    form: Form
    gain: float
    worth: float
    scales: tuple[float, ...]
    amounts: tuple[float, ...]
    shapes: Mapping[str, float]
    p_value: float = 1.0

    def written(self) -> Written:
        """As an effect."""
        starts = {amount(i): a for i, a in enumerate(self.amounts)}
        for shape in self.form.shapes:
            starts[shape.name] = self.shapes[shape.name] * scaled(shape, self.scales[shape.place])
        return Written(self.place, self.inputs, self.scales, self.form, starts)

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """Place and inputs."""
        return self.place.name, tuple(i.name for i in self.inputs)
