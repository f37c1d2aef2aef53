"""The verdict of a discovery as a sentence or two for the researcher."""

from __future__ import annotations

from collections.abc import Sequence

from freelearn.inference.checks.check import TableCheck
from freelearn.inference.search import Findings
from freelearn.inference.thresholds import MOST_ALIKE
from freelearn.results.proposals import file_of

NOTHING_LEFT = "nothing systematic is left"
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
    left = f"with {'it' if len(findings.effects) == 1 else 'them'} {NOTHING_LEFT}"
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
    beside = ", ".join(e for e in findings.effects if e not in [p.written.name for p in new])
    library = (
        f"{beside} and something that is in no library were missing" if beside else "what was missing is in no library"
    )
    return f"Proposed: {library}; the search wrote {wrote}{more.replace('them', 'it')}."


def _unexplained(findings: Findings) -> str:
    failed = findings.referee.failed if findings.referee else []
    helped = ""
    if findings.effects:
        names = ", ".join(findings.effects)
        helped = f" {names} explain{'s' if len(findings.effects) == 1 else ''} a part of it."
    if failed and findings.claimed != "unexplained":
        return f"Unexplained: {_lowered(failed[0].says)}{helped}"
    return f"Unexplained: something systematic is left that no effect in the library accounts for.{helped}"


def _undecided(findings: Findings) -> str:
    shares = findings.answer.shares if findings.answer else {}
    likely = ", ".join(f"{name} ({100 * share:.0f} %)" for name, share in list(shares.items())[:MOST_TOLD])
    if findings.claimed == "adequate" and likely:
        return f"Undecided: something may be missing, and these rows cannot tell what: {likely}."
    if any(len(c) > MOST_ALIKE for c in findings.classes):
        return f"Undecided: too many effects would explain these rows equally well: {likely}."
    missing = findings.referee.open if findings.referee else []
    why = _lowered(missing[0].says) if missing else "there are too few rows."
    said = f" If anything is missing, it is {', '.join(findings.effects)}." if findings.effects else ""
    return f"Undecided: {why}{said}"


def _lowered(sentence: str) -> str:
    """A sentence as it goes on behind a colon; a name of one letter and figures stays."""
    return sentence if sentence[:2].isupper() or not sentence[1:2].islower() else sentence[0].lower() + sentence[1:]
