"""Is the accuracy that the user states what the rows need?"""

from __future__ import annotations

import numpy as np

from freelearn.inference.memory import Memory
from freelearn.inference.referee.case import Case
from freelearn.inference.referee.check import FAIL, PASS, Check
from freelearn.inference.scatter import MAD, clock_of
from freelearn.measurements.bed_accuracy import sensors, shared
from freelearn.measurements.beds import Quantity

# Factor by which calibration certificates differ from what is true; beyond it the rows themselves have to show it.
CERTIFIED = 1.5
# Share of the scatter that must be there from each row to the next, where it is scatter and no misfit.
ROUGH = 0.6
# Factor beyond which errors of places count as a misfit, and errors that a sensor makes for a while.
MOST, LASTING = 3.5, 5.0
FEWEST = 12


def stated(case: Case) -> list[Check]:
    """One check for the readings, one for what of their errors lasts, one for the places."""
    scatter = case.whiten.scatter
    if scatter is None:
        return []
    bed = case.rows.states.bed
    checks = []
    for channel, quantity in enumerate(bed.readings):
        if not bool(case.present[:, channel].any()):
            continue
        told = float(sensors(case.accuracy, bed)[channel]) / quantity.factor
        factor = float(scatter.deviations[channel])
        says = f"The {quantity.name} scatters by {factor * told:.2g} {quantity.unit}; you say {told:.2g}."
        name = f"accuracy of the {quantity.name}"
        rough = roughness(case, channel)
        if factor > CERTIFIED and rough is not None and rough < ROUGH:
            says += f" From row to row it is {100 * rough:.0f} % of that: most of it is no scatter but a misfit."
            checks.append(Check(name, FAIL, factor, CERTIFIED, says))
        elif factor < 1 / CERTIFIED:
            says += " The stated one would hide what is missing; the search took the scatter as it is."
            checks.append(Check(name, PASS, factor, 1 / CERTIFIED, says, decides=False))
        else:
            checks.append(Check(name, PASS, factor, CERTIFIED, says, decides=False))
        if scatter.memory is not None and float(scatter.memory.share[channel]) > 0:
            checks.append(_lasting(quantity, scatter.memory, channel, factor, told))
    place = float(scatter.position * scatter.tails.deviation)
    words = [
        f"{q.name} {place * float(value) / q.factor:.2g} {q.unit} (you say {float(value) / q.factor:.2g})"
        for q, value in zip(bed.state, shared(case.accuracy, bed), strict=True)
        if float(value) > 0
    ]
    if words:
        says = f"What a state's rows share would have to be off by {' and '.join(words)}."
        checks.append(Check("accuracy of the places", FAIL if place > MOST else PASS, place, MOST, says, place > MOST))
    return checks


def _lasting(quantity: Quantity, memory: Memory, channel: int, factor: float, told: float) -> Check:
    """Errors of a sensor that last for a while: a wandering zero, or a history that no shape tells."""
    lasts = factor * float(memory.share[channel]) ** 0.5
    says = (
        f"The {quantity.name} errs by {lasts * told:.2g} {quantity.unit} for {float(memory.time[channel]):.2g} s; "
        f"you say {told:.2g}."
    )
    name = f"errors of the {quantity.name} that last"
    if lasts > LASTING:
        says += " No sensor wanders by so much: something with a memory is missing. Or state what its data sheet says."
        return Check(name, FAIL, lasts, LASTING, says)
    return Check(name, PASS, lasts, LASTING, says, decides=False)


def roughness(case: Case, channel: int) -> float | None:
    """How much residuals differ from the mean of their neighbors along the pressure, as a share of what errors of the
    size and memory that were found would; None of too few."""
    raw = case.fit.raw_residual[:, channel].numpy() / np.maximum(case.whiten.own[:, channel].numpy(), 1e-300)
    there, state = case.present[:, channel].numpy(), case.rows.state
    inner = np.flatnonzero(
        there[1:-1] & there[:-2] & there[2:] & (state[1:-1] == state[:-2]) & (state[1:-1] == state[2:])
    )
    if len(inner) < FEWEST:
        return None
    second = raw[inner + 1] - (raw[inner] + raw[inner + 2]) / 2
    return float(MAD * np.median(np.abs(second)) / np.sqrt(_rough(case, channel, inner)))


def _rough(case: Case, channel: int, inner: np.ndarray) -> float:
    """Variance of the difference between an error and the mean of its neighbors, of errors of variance one."""
    scatter, clock = case.whiten.scatter, clock_of(case.rows.states)
    if scatter is None or scatter.memory is None or clock is None:
        return 1.5
    share, time = float(scatter.memory.share[channel]), float(scatter.memory.time[channel])
    before, after = (np.abs(np.diff(clock.numpy()))[inner + i] for i in (0, 1))
    near = np.exp(-before / time) + np.exp(-after / time) - np.exp(-(before + after) / time) / 2
    return float(1.5 - share * np.median(near))
