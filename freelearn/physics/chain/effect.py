"""An effect: physics that a model leaves out, as a part that plugs into one stop of the chain."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Generic

import torch
from torch import Tensor

from freelearn.data.beds import BEDS
from freelearn.data.states import States
from freelearn.physics.chain.parameters import P, Parameter, Parameters, misnamed

# The stops of the chain in the order in which effects are listed.
PORTS = ("energy", "geometry", "boundary", "dissipation", "measurement", "history")

# Which stops each family of models has. A model of a user's own belongs to OWN unless it says otherwise.
OWN = "own"
FAMILIES: dict[str, tuple[str, ...]] = {
    "continuum": PORTS,
    "linear": PORTS[1:],
    "mlp": PORTS[2:],
    "continuum_inextensible": PORTS[1:],
    OWN: PORTS[1:],
}


class Effect(Generic[P]):
    """What all effects share. Derive from the base class of a port (ports) and write its one method.

    That method gets `p`, the effect's own parameters in SI, as scalars or one per row, (N,). With every parameter at
    its no-effect value the model is unchanged.
    """

    name: ClassVar[str]
    parameter_class: ClassVar[type[Parameters]] = Parameters
    # When to suspect it, in a researcher's words, and where it is described.
    suspect: ClassVar[str] = ""
    source: ClassVar[str] = ""
    # Columns of the table that it needs besides the required ones.
    needs: ClassVar[tuple[str, ...]] = ()
    # Whether it goes by the way in which the pressure changes.
    directed: ClassVar[bool] = False
    # Names of the beds (beds) on which it can be told.
    beds: ClassVar[tuple[str, ...]] = tuple(BEDS)
    # Effects of one port act in the order of their places, and of their names where these are equal.
    place: ClassVar[int] = 100

    # Chance that an actuator or a bed has it, before anybody has looked: what goes wrong most often has more.
    odds: ClassVar[float] = 0.04
    # Share of what it explains that other forms of it in the literature would explain otherwise: so much of its gain is
    # no evidence for anything else.
    loose: ClassVar[float] = 0.0
    # Parameters that are as often one number as not: two channels of one amplifier are filtered alike.
    alike: ClassVar[tuple[str, ...]] = ()
    # The effect of which it is a further term: a search tries it only beside that one, whose place it would take.
    beside: ClassVar[str] = ""

    # Set by the base class of each port: its stop in the chain, the method to write, whether the state imposed depends
    # on the loads, and whether its derivatives at no effect follow from the loads without it and their derivatives by
    # the pressure, so that a structure solved once serves it.
    port: ClassVar[str]
    method: ClassVar[str]
    yields: ClassVar[bool] = False
    late: ClassVar[bool] = False
    # Whether it acts on each actuator of an end block, or on the block.
    of_each: ClassVar[bool] = True
    # Whether it can be told of several actuators on one end block alone.
    together: ClassVar[bool] = False
    # Whether it says how samples, or actuators on one end block, differ from the first of them, which has no value of
    # its own: nothing where all share one.
    compares: ClassVar[bool] = False
    # Whether a search asks it of samples alone: another effect says it of actuators on one end block.
    alone: ClassVar[bool] = False

    def __init__(self, samples: Sequence[int] = (), members: int = 0) -> None:
        """samples: those of a fit; with several, a `per_sample` parameter has one value for each. members: how many
        actuators share an end block; each then has its own `per_sample` and `per_member` parameters, if the effect acts
        on the actuators and not on the block."""
        distinct = tuple(sorted(set(samples)))
        self.samples = distinct if len(distinct) > 1 else ()
        self.members = tuple(range(1, members + 1)) if self.of_each else ()

    @classmethod
    def declared_parameters(cls) -> tuple[Parameter, ...]:
        """Its parameters as they were declared."""
        return cls.parameter_class.records()

    @classmethod
    def families(cls) -> tuple[str, ...]:
        """Families of models that it can join: those that have its port."""
        return tuple(family for family, ports in FAMILIES.items() if cls.port in ports)

    @classmethod
    def untold(cls, bed: str) -> str | None:
        """Why it cannot be told on the bed of this name; None where it can."""
        return None if bed in cls.beds else f"cannot be told on the bed {bed}: it can on {', '.join(cls.beds)}"

    @classmethod
    def assumptions(cls, columns: Iterable[str]) -> list[str]:
        """Sentences on what it has to assume where a table has only these columns. None by default."""
        return []

    @classmethod
    def problem(cls) -> str | None:
        """What is wrong with the class as an effect, beginning with "its" or "the"; None where it is proper."""
        if wrong := misnamed(cls, cls.parameter_class):
            return wrong
        if not cls.beds or not set(cls.beds) <= set(BEDS):
            return f"its beds {cls.beds} must name beds: {', '.join(BEDS)}"
        for p in cls.declared_parameters():
            numbers = [p.start, p.scale, *([] if p.none is None else [p.none])]
            if not all(isinstance(v, int | float) and math.isfinite(v) for v in numbers):
                return f"start, scale and none of its parameter {p.name!r} must be finite numbers"
            if not p.allows(p.start) or not (p.none is None or p.lower <= p.none <= p.upper):
                return f"start and none of its parameter {p.name!r} must lie within its bounds"
            if cls.compares and p.none is None:
                return f"it compares, so its parameter {p.name!r} needs a value without effect, none: the first one's"
            if p.prior is not None and not (math.isfinite(p.prior.middle) and p.prior.deviation > 0):
                return f"the prior of its parameter {p.name!r} needs a finite middle and a deviation above zero"
        return None

    def declared(self) -> dict[str, Parameter]:
        """Its parameters by the name that they have in a model: effect.name, or effect.name[3] for sample 3."""
        return {label: p for p in self.declared_parameters() for label in self._labels(p)}

    def _labels(self, p: Parameter) -> list[str]:
        whole = f"{self.name}.{p.name}"
        return [f"{whole}[{number}]" for number in self._numbers(p)] or [whole]

    def _numbers(self, p: Parameter) -> tuple[int, ...]:
        """The samples or members of which each has a value of its own."""
        own = p.per_sample or (p.per_member and bool(self.members))
        return (self.members or self.samples)[self.compares :] if own else ()

    def own(self, values: Mapping[str, Tensor], states: States | None = None) -> P:
        """This effect's parameters out of the model's values, each () or (N,).

        A row takes its own sample's value; a sample that was not fitted takes the mean of those that were.
        """
        each = {p: [values[label] for label in self._labels(p)] for p in self.declared_parameters()}
        own = {p.name: self._value(p, v, states) for p, v in each.items()}
        return self.parameter_class(**own)  # type: ignore[return-value]  # P is the type of `parameter_class`

    def _value(self, p: Parameter, each: list[Tensor], states: States | None) -> Tensor:
        """A parameter's value, () or (N,), from those that it has in a model."""
        if self.compares and p.none is not None and self._numbers(p):
            each = [torch.full_like(each[0], p.none), *each]
        return each[0] if len(each) == 1 else self._of_rows(torch.stack(each, -1), states)

    def _of_rows(self, each: Tensor, states: States | None) -> Tensor:
        """Values of the samples (or members), (S,) or (N, S), to one value per row, (N,)."""
        assert states is not None
        numbers = self.members or self.samples
        match = states.sample[:, None] == torch.tensor(numbers, device=states.sample.device)
        share = torch.where(match.any(1, keepdim=True), match.to(each.dtype), 1 / len(numbers))
        return (share * each).sum(-1)
