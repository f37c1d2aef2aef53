"""The verdict of a search, and what it found out about the noise, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from freelearn.common.formats import error_percent, in_words
from freelearn.data.beds import DEAD_LOAD
from freelearn.discovery.checks.table_check import TableCheck
from freelearn.discovery.fits.step import Step
from freelearn.discovery.noise.memory import Memory
from freelearn.discovery.noise.scatter import Scatter
from freelearn.discovery.referee.case import FAIL, PASS, ROWS_SHOW
from freelearn.discovery.search.search import Findings
from freelearn.discovery.thresholds import MOST_ALIKE
from freelearn.records.written_effects import file_of

# Stated noise that is wrong by more than this factor is said to be.
WRONG_NOISE = 1.5
# A scale estimated from so few readings may be off by more: by so many of its standard errors.
UNCERTAIN = 2.0
# Position errors of fewer states, and such as hardly show, tell little of themselves.
WRONG_POSITION = 2.0
# Share of an unexplained model's error below which the set that predicts best is told.
BETTER = 0.8

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
        for i in measured_channels(step)
        if float(memory.share[i])
    ]
    return f"the noise has a memory: {', '.join(parts)}; rows that err alike count for fewer"


def measured_channels(step: Step) -> list[int]:
    """The channels of a step's bed of which some row has a reading."""
    return [i for i, there in enumerate(step.whiten.present.any(0).tolist()) if there]


def _wrong(step: Step, found: Scatter) -> str:
    """What of the stated accuracy is wrong, in words; empty where nothing is."""
    bed, deviations = step.states.bed, found.deviations.tolist()
    position = found.position * found.tails.deviation
    common = "hung loads' scatter" if bed is DEAD_LOAD else "positions' scatter"
    free = int(step.whiten.present.sum()) - len(step.fit.vector)
    if free <= 0:
        # Readings that a model passes through say nothing of their scatter.
        return ""
    # The logarithm of a scale from n readings has the standard error 1/√(2n).
    unsure, parts = math.exp(UNCERTAIN / math.sqrt(2 * free)), []
    for name, factor, least in (
        *((f"{bed.readings[i].name}'s scatter", deviations[i], WRONG_NOISE) for i in measured_channels(step)),
        (common, position, WRONG_POSITION),
    ):
        most = least * unsure
        if factor > most:
            parts.append(f"the {name} is {in_words(factor, 2)} times larger")
        elif factor < 1 / most:
            parts.append(f"the {name} is {in_words(1 / factor, 2)} times smaller")
    return ", ".join(parts)


# The verdict of a discovery as a sentence or two for the researcher.

NOTHING_LEFT = "nothing systematic is left"
# Share of what is predicted of other rows of the same states that of other states is nothing.
OF_OTHERS = 0.1
# Effects that are told where the table cannot decide between them.
MOST_TOLD = 5


def verdict_in_words(findings: Findings, classes: Sequence[Sequence[str]], stopping: Sequence[TableCheck] = ()) -> str:
    """What is claimed; of what stays unexplained the check that refutes the claim first, of an undecided table what it
    cannot tell. stopping: checks of the table itself that failed: with them nothing is claimed."""
    if stopping:
        return _stopped(stopping)
    saying = {"unexplained": _unexplained, "undecided": _undecided}.get(findings.verdict)
    return saying(findings) if saying else _claim(findings, classes)


def _stopped(stopping: Sequence[TableCheck]) -> str:
    first, others = stopping[0], len(stopping) - 1
    cure = f" Try {first.cure}." if first.cure else ""
    more = f" {others} more check{' fails' if others == 1 else 's fail'}." if others else ""
    return (
        f"Undecided: {_lowered(first.says)}{cure}{more} Nothing is claimed until the table is corrected, or the check "
        "overruled by checks=off."
    )


def _claim(findings: Findings, classes: Sequence[Sequence[str]]) -> str:
    names, seen = ", ".join(findings.effects), findings.referee is None or findings.referee.sees_nothing
    they = "it" if len(findings.effects) == 1 else "them"
    beside = " and ".join(findings.answer.beside if findings.answer else [])
    left = f"with {they} and {beside}, which other forms of {they} may be," if beside else f"with {they}"
    left = f"{left} {NOTHING_LEFT}"
    more = f"; {left}" if seen else "; whether more is missing these rows cannot tell"
    if findings.verdict == "adequate":
        return "Adequate: at this accuracy nothing systematic is missing."
    if findings.verdict == "named":
        return f"Named: {names} {'was' if len(findings.effects) == 1 else 'were'} missing{more}."
    if findings.verdict == "class":
        groups = "; ".join(" or ".join(c) for c in classes)
        return f"Class: what was missing is {groups}{more}. The data cannot tell the alternatives apart."
    new = [p for p in findings.proposals if p.written.name in findings.effects]
    wrote = "; ".join(f"{p.written.formula} ({p.written.place.changes}, file {file_of(p)})" for p in new)
    known = ", ".join(e for e in findings.effects if e not in [p.written.name for p in new])
    library = (
        f"{known} and something that is in no library were missing" if known else "what was missing is in no library"
    )
    return f"Proposed: {library}; the search wrote {wrote}{more.replace('them', 'it')}."


def _unexplained(findings: Findings) -> str:
    failed = findings.referee.failed if findings.referee else []
    helped = ""
    if findings.effects:
        names = ", ".join(findings.effects)
        helped = f" {names} explain{'s' if len(findings.effects) == 1 else ''} a part of it."
    why = _lowered(failed[0].says) if failed and findings.claimed != "unexplained" else _left(findings)
    return f"Unexplained: {why}{helped}{_best(findings)}"


def _left(findings: Findings) -> str:
    """What is left, as far as a regression predicts it of other rows of the same states, and of other states."""
    checks = {check.name: check for check in findings.referee.checks} if findings.referee else {}
    rows, states = (checks.get(f"black box, {way} left out") for way in ("rows", "states"))
    if rows is not None and states is not None and states.result == PASS:
        if rows.result == FAIL and (states.figure or 0.0) < OF_OTHERS * (rows.figure or 0.0):
            return (
                "what is left is the same in all rows of a state and tells nothing of another state: places that were "
                "set otherwise than the table says, or a load cell that was zeroed at each of them."
            )
        if rows.result == PASS:
            return (
                "something is left that no effect in the library accounts for, and that no regression predicts of "
                "other rows: errors that go on from row to row, such as a zero that wanders, would look like that."
            )
    return "something systematic is left that no effect in the library accounts for."


def _best(findings: Findings) -> str:
    """What to predict with meanwhile, where that is clearly more than what stands; "" for nothing."""
    best = findings.predicts_best
    if best is None or best.E_heldout > BETTER * findings.final.E_heldout:
        return ""
    names, error = " + ".join(best.effects) or "the model alone", error_percent(best.E_heldout)
    return f" Of the sets looked at, {names} predicts what was left out best ({error} %), and explains nothing yet."


def _undecided(findings: Findings) -> str:
    shares = findings.answer.shares if findings.answer else {}
    likely = ", ".join(f"{name} ({100 * share:.0f} %)" for name, share in list(shares.items())[:MOST_TOLD])
    if findings.claimed == "adequate" and likely:
        return f"Undecided: something may be missing, and these rows cannot tell what: {likely}."
    if findings.classes and all(len(c) > MOST_ALIKE for c in findings.classes):
        return f"Undecided: too many effects would explain these rows equally well: {likely}."
    if findings.answer and findings.answer.doubted:
        return f"Undecided: one effect or several others together would explain these rows equally well: {likely}."
    missing = findings.referee.open if findings.referee else []
    # What other rows would tell comes before what there are too few of.
    missing = sorted(missing, key=lambda check: check.name != ROWS_SHOW)
    why = _lowered(missing[0].says) if missing else "there are too few rows."
    if missing and missing[0].name == ROWS_SHOW:
        beside = [name for name in findings.effects if name not in why]
        return f"Undecided: {why}" + (f" Beside it: {', '.join(beside)}." if beside else "")
    said = f" If anything is missing, it is {', '.join(findings.effects)}." if findings.effects else ""
    return f"Undecided: {why}{said}"


def _lowered(sentence: str) -> str:
    """A sentence as it goes on behind a colon; a name of one letter and figures stays."""
    return sentence if sentence[:2].isupper() or not sentence[1:2].islower() else sentence[0].lower() + sentence[1:]
