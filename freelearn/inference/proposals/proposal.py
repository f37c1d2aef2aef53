"""An effect that the search wrote, as it is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from freelearn.inference.proposals.guess import Guess
from freelearn.inference.step import Step
from freelearn.models.written.written import Written


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
