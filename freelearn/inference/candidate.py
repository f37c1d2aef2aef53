"""Entries of discovery.json about effects that were tried."""

from __future__ import annotations

from typing import TypedDict


class Candidate(TypedDict):
    """An effect at one step of a search.

    step: place of the step in the trail. status: tested, not_testable or failed, the latter two with a reason. score:
    reduction of χ² that it promised; p_value: chance that the most promising of all would promise as much with nothing
    to find. E_heldout, E_new_sample: errors with the effect, as of a step; None where it was not fitted."""

    step: int
    effect: str
    status: str
    reason: str
    score: float | None
    p_value: float | None
    E_heldout: float | None
    E_new_sample: float | None


def not_testable(effect: str, reason: str) -> Candidate:
    """The entry of an effect that the table or the rows cannot show."""
    return Candidate(
        step=0,
        effect=effect,
        status="not_testable",
        reason=reason,
        score=None,
        p_value=None,
        E_heldout=None,
        E_new_sample=None,
    )
