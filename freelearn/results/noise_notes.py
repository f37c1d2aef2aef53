"""What a search found out about the noise, in words."""

from __future__ import annotations

import numpy as np

from freelearn.inference.memory import Memory
from freelearn.inference.scatter import Scatter
from freelearn.inference.step import Step
from freelearn.measurements.beds import DEAD_LOAD

# Stated noise that is wrong by more than this factor is said to be.
WRONG_NOISE = 1.5
# Position errors of fewer states, and such as hardly show, tell little of themselves.
WRONG_POSITION = 2.0


# What to do about a stated accuracy that is wrong, and about an estimated one.
CORRECT = (
    "than data.accuracy says; the search takes the scatter as it is, the noise floor is the stated one: correct "
    "data.accuracy, or use data.accuracy=estimate"
)
APART = (
    "than was estimated from the data; the search takes the scatter as it is: state in data.accuracy what the sensors' "
    "data sheets say"
)


def noise_notes(step: Step, stated: bool = True) -> list[str]:
    """Sentences about the scatter of a step's readings, where it is not as stated, or as was estimated first."""
    found = step.whiten.scatter
    if found is None:
        return []
    notes = []
    wrong = _wrong(step, found)
    if wrong:
        notes.append(f"{wrong} {CORRECT if stated else APART}")
    if found.growth.amount:
        notes.append(
            f"the noise grows with the {found.growth.kind}: it is {1 + found.growth.amount:.2g} times as large at the "
            "largest as at none"
        )
    if np.isfinite(found.tails.freedom):
        notes.append(
            f"the noise has heavier tails than normal noise (Student's t with {found.tails.freedom:g} degrees of "
            "freedom): readings far off count for less"
        )
    if found.memory is not None:
        notes.append(_lasting(step, found.memory))
    return notes


def _lasting(step: Step, memory: Memory) -> str:
    """Of the errors in a log that are still there when the next reading is taken."""
    parts = [
        f"{100 * float(memory.share[i]):.0f} % of the {step.states.bed.readings[i].name}'s variance fades in "
        f"{float(memory.time[i]):.2g} s"
        for i in told(step)
        if float(memory.share[i])
    ]
    return f"the noise has a memory: {', '.join(parts)}; rows that err alike count for fewer"


def told(step: Step) -> list[int]:
    """The channels of a step's bed of which some row has a reading."""
    return [i for i, there in enumerate(step.whiten.present.any(0).tolist()) if there]


def _wrong(step: Step, found: Scatter) -> str:
    """What of the stated accuracy is wrong, in words; empty where nothing is."""
    bed, deviations = step.states.bed, found.deviations.tolist()
    position = found.position * found.tails.deviation
    common = "hung loads' scatter" if bed is DEAD_LOAD else "positions' scatter"
    parts = []
    for name, factor, most in (
        *((f"{bed.readings[i].name}'s scatter", deviations[i], WRONG_NOISE) for i in told(step)),
        (common, position, WRONG_POSITION),
    ):
        if factor > most:
            parts.append(f"the {name} is {factor:.2g} times larger")
        elif factor < 1 / most:
            parts.append(f"the {name} is {1 / factor:.2g} times smaller")
    return ", ".join(parts)
