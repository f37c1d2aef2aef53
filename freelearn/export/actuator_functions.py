"""The functions that an actuator is exported as."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from freelearn.data.beds import DEAD_LOAD
from freelearn.export.actuator import Actuator
from freelearn.export.arithmetic.function import Function, Port
from freelearn.export.forward import forward, parts
from freelearn.export.inverse import MOST, inverses
from freelearn.export.log_step import stepped

# Of a run of a log, what lasts has a name beside what is followed from sample to sample.
STEADY = "_steady"


@dataclass(frozen=True)
class View:
    """An actuator as one bed asks it."""

    actuator: Actuator

    @cached_property
    def whole(self) -> Function:
        """All that is known there."""
        return forward(self.actuator)

    @cached_property
    def parts(self) -> list[Function]:
        """The answer, its derivatives and its bands."""
        return parts(self.actuator, self.whole)

    @property
    def answer(self) -> Function:
        """The answer alone."""
        return self.parts[0]

    @property
    def inputs(self) -> tuple[Port, ...]:
        """What is imposed, and what is remembered as far as it matters."""
        return self.whole.inputs


@dataclass(frozen=True)
class Functions:
    """Of an actuator: what its bed asks, its loads at a place where that is another question, and inverses. Of one that
    was fitted to a log with effects of the history also what a sample answers; all else then is of a state that lasts.
    """

    actuator: Actuator

    @cached_property
    def step(self) -> Function | None:
        """From sample to sample of a log; None where samples do not depend on those before."""
        return stepped(self.actuator) if self.actuator.remembers else None

    @cached_property
    def view(self) -> View:
        """What `predict` answers."""
        return View(self.actuator)

    @cached_property
    def held(self) -> View | None:
        """The loads at a place, where the bed asks for something else."""
        held = self.actuator.held
        return View(held) if held else None

    @property
    def views(self) -> list[View]:
        """Both."""
        return [self.view, *([self.held] if self.held else [])]

    @property
    def loads(self) -> View:
        """What answers with loads at a place; of a network that does not, what it has."""
        return self.held or self.view

    @cached_property
    def inverses(self) -> list[Function]:
        """Pressures for what is wanted."""
        return inverses(self.loads.actuator)

    @property
    def lacks(self) -> list[str]:
        """What there is no function for, and why, a sentence each."""
        count, said = len(self.actuator.states.members), list[str]()
        if self.step:
            said.append(
                "Bands along a log are not exported, for there they depend on all that was before: those that are "
                "exported are of a state that lasts."
            )
        if self.actuator.bed is DEAD_LOAD and self.actuator.held:
            said.append(
                "No pressure for an elongation or a twist under a load: each of hundreds of pressures would have a "
                "search of its own for the place of rest; use predict, with a table whose pressure is blank."
            )
        if count <= MOST:
            return said
        return [
            *said,
            f"No pressures for a load: the least of {count} are looked for on too many faces of their box; "
            "use predict.",
        ]

    @property
    def every(self) -> list[Function]:
        """All of them."""
        first = [self.step] if self.step else []
        return [*first, *(f for view in self.views for f in view.parts), *self.inverses]

    @property
    def files(self) -> dict[str, Function]:
        """What formats of one function each write, by what the names of their files end in."""
        held = {f"_{self.held.answer.name}": self.held.whole} if self.held else {}
        steady = {"": self.step, STEADY: self.view.whole} if self.step else {"": self.view.whole}
        return {**steady, **held, **{f"_{f.name}": f for f in self.inverses}}

    def file_of(self, f: Function) -> str:
        """The ending of the file that holds a function."""
        return next(ending for ending, whole in self.files.items() if whole.graph is f.graph)
