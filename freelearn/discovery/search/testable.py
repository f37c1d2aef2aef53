"""Which effects can be tested on a model and a table, and tables that can tell nothing."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import DEAD_LOAD
from freelearn.data.columns import RISEN
from freelearn.data.moves import driven, moved_by, swept
from freelearn.data.rows import Rows
from freelearn.discovery.checks.look import needed_readings
from freelearn.discovery.fits.derivatives import Build
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.step import Candidate, not_testable
from freelearn.discovery.noise.shapes import imposed
from freelearn.discovery.referee.case import CANNOT, Check
from freelearn.discovery.residuals.hysteresis import ALONE, FEWEST_COMPARISONS, comparisons
from freelearn.discovery.search.first_rows import as_risen, risen
from freelearn.discovery.search.measuring_order import DRIFT
from freelearn.discovery.thresholds import SORTED
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.geometry.strand_jamming import area_of
from freelearn.physics.effects.registry import EFFECTS

# Which effects can be tested on a model and a table.

MOTION = "motion_friction"
# The column that says when a row was measured.
TIME = "time_s"
# Rows that have to show what an effect does.
FEWEST = 10
FEWEST_EACH_WAY = 5
# Where the pressure leaves a smaller share of the variance of the time in a state, it is all that the time could tell.
APART_FROM_PRESSURE = 0.02
# A row counts as less severe than an earlier one below this share of the harshest so far.
MILDER = 0.99
# Strands lie closer than at rest below this share of the braid's area there.
CLOSER = 0.98


class Testable(NamedTuple):
    """What a search of some rows can try. names: of the effects to test; untestable: an entry of discovery.json for
    each that cannot be, with the reason; unshown: of the latter those that may act in these rows all the same, and what
    rows they need."""

    names: list[str]
    untestable: list[Candidate]
    unshown: Mapping[str, str]


def candidates(model: Model, given: Iterable[str], columns: Iterable[str], rows: Rows) -> Testable:
    """Which effects can be tested.

    An effect cannot be tested where the table lacks a column, where it does not fit the model's family or the bed, or
    where the rows (those looked at) never saw what it would show in: fitted all the same, it would stand for something
    else.
    """
    present, known = set(columns), set(given)
    names: list[str] = []
    out: list[Candidate] = []
    unshown: dict[str, str] = {}
    still = not rows.states.members and rows.states.recording is None
    acting = ACTING_SWEPT if swept(rows.states) else ACTING
    for name, effect in EFFECTS.items():
        # Along no log there is no history: nothing is said of it.
        if name in known or (effect.port == "history" and rows.states.recording is None):
            continue
        missing = [c for c in effect.needs if c not in present]
        if missing:
            out.append(not_testable(name, f"needs the column {', '.join(missing)}"))
        elif model.family not in effect.families():
            out.append(not_testable(name, f"works with {', '.join(effect.families())} only"))
        elif reason := effect.untold(rows.states.bed.name):
            out.append(not_testable(name, reason))
        elif reason := unseen(name, present, rows):
            out.append(not_testable(name, reason))
            if still and name in acting:
                unshown[name] = reason
        else:
            names.append(name)
    return Testable(names, out, unshown)


def question_of_rows(build: Build, columns: Collection[str], rows: Rows, accuracy: Accuracy, seed: int) -> Question:
    """What a search asks of rows that were read from a table with these columns: all that they can tell."""
    names, _, unshown = candidates(build([]), (), columns, rows)
    clocked = not unclocked(columns, rows)
    question = Question(build, names, rows, accuracy, seed, clocked=clocked, unshown=unshown)
    return replace(question, rows=as_risen(rows)) if RISEN not in columns and risen(question) else question


def unseen(name: str, columns: Collection[str], rows: Rows) -> str:
    """Why these rows cannot show an effect of the history, of the time, of several actuators or of braids; empty where
    they can, and for all other effects."""
    if name == DRIFT:
        return unclocked(columns, rows)
    if EFFECTS[name].together and len(rows.states.members) < 2:
        return "needs several actuators on one end block"
    if EFFECTS[name].alone and len(rows.states.members) > 1:
        return "is asked of samples of one actuator: those on one end block have it as pressure_gain"
    members = len(rows.states.members) if EFFECTS[name].of_each else 0
    if EFFECTS[name].compares and max(members, len(rows.states.sample.unique())) < 2:
        return "needs several samples" + ", or several actuators on one end block" * EFFECTS[name].of_each
    return HISTORY[name](rows) if name in HISTORY else ""


def unclocked(columns: Collection[str], rows: Rows) -> str:
    """Why rows without a time cannot show what the time would do: their order is that of what was imposed, of which
    anything unknown may be a function."""
    if TIME in columns:
        return ""
    inputs = [x.numpy() for x in imposed(rows.states).values()]
    order, sample = np.arange(len(rows), dtype=float), rows.states.sample.numpy()
    if _unfollowed(order, inputs, sample, degree=2) >= 1 - SORTED:
        return ""
    return f"needs the column {TIME}: the order of the rows is that of what was imposed"


def assumptions(names: Sequence[str], columns: Iterable[str]) -> list[str]:
    """What was assumed for want of a column, in words, for the effects tested."""
    known = set(columns)
    return [sentence for name in names for sentence in EFFECTS[name].assumptions(known)]


def _friction(rows: Rows) -> str:
    if rows.states.members:
        return f"cannot be told of several actuators on one end block: {ALONE}"
    count = len(comparisons(rows.states, rows.state))
    if count >= FEWEST_COMPARISONS:
        return ""
    return (
        f"needs {FEWEST_COMPARISONS} rows of falling pressure beside rising ones of the same state: there are {count}"
    )


def _lagging_pressure(rows: Rows) -> str:
    if rows.states.recording is not None:
        return "is asked of states that were held: along a log a regulator or a gauge lags in time"
    return _friction(rows)


def _motion(rows: Rows) -> str:
    states = rows.states
    if states.members or states.recording is not None:
        return "is asked of states of one actuator that were held: along a log it is maxwell_slip"
    there = driven(states)
    way = moved_by(states)[there]
    fewest = int(torch.minimum((way > 0.5).sum(0), (way < -0.5).sum(0)).max()) if bool(there.any()) else 0
    if fewest >= FEWEST_EACH_WAY:
        return ""
    return f"needs {FEWEST_EACH_WAY} rows after a move either way, under a pressure held since: there are {fewest}"


def _braid(rows: Rows) -> str:
    return "" if rows.states.second_angle is not None else "needs a braid: a second family of fibers, gamma2_deg"


def _jam(rows: Rows) -> str:
    if reason := _braid(rows):
        return reason
    states, shown = rows.states, rows.readings.value
    if states.bed is DEAD_LOAD:
        states = states.replace(length=states.reference_length + shown[:, 0], twist=shown[:, 1])
    count = int((area_of(states) < CLOSER).sum())
    if count >= FEWEST:
        return ""
    return f"needs {FEWEST} rows in which the braid's strands lie closer than at rest: there are {count}"


def _relaxation(rows: Rows) -> str:
    dwell = rows.states.dwell.numpy()
    _, member = np.unique(rows.state, return_inverse=True)
    shortest = np.full(member.max() + 1, np.inf)
    np.minimum.at(shortest, member, dwell)
    count = int((dwell > shortest[member]).sum())
    if count < FEWEST:
        return f"needs {FEWEST} rows that were read later than others of the same state: there are {count}"
    if rows.states.members:
        return ""
    # Where the pressure only rises, step by step, the stress of later rows is that of higher pressures.
    apart = _unfollowed(dwell, [rows.states.pressure.numpy()], rows.states.sample.numpy(), degree=3)
    if apart >= APART_FROM_PRESSURE:
        return ""
    return (
        "needs rows of one pressure that were read at different times: here the time in a state goes with the pressure"
    )


def _unfollowed(target: np.ndarray, inputs: Sequence[np.ndarray], sample: np.ndarray, degree: int) -> float:
    """Share of the target's variance (N,) within samples that no polynomials of the inputs, (N,) each, follow; zero
    where it does not vary."""
    left, whole = 0.0, 0.0
    for one in np.unique(sample):
        own = sample == one
        columns = [np.ones(own.sum())]
        for x in inputs:
            size = np.ptp(x[own])
            if size > 0:
                columns += [((x[own] - x[own].mean()) / size) ** power for power in range(1, degree + 1)]
        design, wanted = np.stack(columns, axis=1), target[own] - target[own].mean()
        rest = wanted - design @ np.linalg.lstsq(design, wanted, rcond=None)[0]
        left, whole = left + float(rest @ rest), whole + float(wanted @ wanted)
    return left / whole if whole else 0.0


def _softening(rows: Rows) -> str:
    count = int((rows.states.severity < MILDER * rows.states.past_severity).sum())
    if count >= FEWEST:
        return ""
    return f"needs {FEWEST} rows milder than one that the sample went through before: there are {count}"


# Effects of the history and of braids, and what says why rows cannot show them.
HISTORY: dict[str, Callable[[Rows], str]] = {
    "friction_hysteresis": _friction,
    "contact_friction": _friction,
    "pressure_hysteresis": _lagging_pressure,
    MOTION: _motion,
    "relaxation": _relaxation,
    "stress_softening": _softening,
    "bladder_slack": _braid,
    "strand_jamming": _jam,
}


# Of these those that act in any rows. Where a place is driven under one pressure, the pressure drives nothing; along a
# log effects of the history see them.
ACTING = ("friction_hysteresis", "contact_friction", "pressure_hysteresis", "relaxation", "stress_softening", DRIFT)
ACTING_SWEPT = (MOTION, "stress_softening", DRIFT)


# Rows of a single kinematic state that let anything be told from a line.
ROWS_OF_ONE_STATE = 24


def scant(question: Question) -> Check | None:
    """Why no search can tell anything of the rows, if so: too few readings, one state with few rows, or nothing that
    varies."""
    rows = question.rows
    needed = needed_readings(question.build(list(question.given)))
    if rows.readings.count < needed:
        many = f"{len(rows)} row{'s' * (len(rows) != 1)} with {rows.readings.count} readings"
        says = f"{many}: too few to look for a missing effect."
        return _check(rows.readings.count, needed, says)
    inputs = [x.numpy() for x in imposed(rows.states).values()]
    if all(np.ptp(x) <= 1e-9 * max(float(np.abs(x).max()), 1e-300) for x in inputs):
        return _check(1, 2, "Nothing that the bed imposes varies in these rows: measure at other states and pressures.")
    if len(np.unique(rows.state)) == 1 and len(rows) < ROWS_OF_ONE_STATE:
        says = f"{len(rows)} rows of a single kinematic state tell no effect from another: measure at other states."
        return _check(len(rows), ROWS_OF_ONE_STATE, says)
    return None


def _check(figure: float, threshold: float, says: str) -> Check:
    return Check("enough rows", CANNOT, figure, threshold, says)
