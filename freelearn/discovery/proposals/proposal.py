"""A first look at one form at one place, and an effect that the search wrote, as it is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from freelearn.discovery.fits.step import Step
from freelearn.physics.written.forms import Form, amount
from freelearn.physics.written.places import Input, Place
from freelearn.physics.written.written_effect import Written, scaled

# A first look at one form at one place: how much it promises to explain, and from where a fit should set out.


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


@dataclass(frozen=True)
class Twin:
    """What the data cannot tell from a proposal: another form, or another place. E_heldout: its held-out error; None
    where the loads are the very same, and nothing was fitted."""

    port: str
    where: str
    inputs: Sequence[str]
    family: str
    formula: str
    E_heldout: float | None


@dataclass(frozen=True)
class Proposal:
    """written: with its constants as fitted; base, step: the models without it and with it; twins: the best first.
    places: the most promising guess of each place and its inputs, best first. resembles: the effect of the library that
    would explain most of the same, and which share of it."""

    written: Written
    base: Step
    step: Step
    twins: Sequence[Twin]
    places: Sequence[Guess] = ()
    resembles: tuple[str, float] | None = None
