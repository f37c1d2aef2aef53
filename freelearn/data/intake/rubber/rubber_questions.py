"""What files of tests of rubber do not say, as questions, and the recipe that their answers make."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from freelearn.data.intake.guesses.guessed import NO, YES, YES_OR_NO, Answers, ColumnGuess
from freelearn.data.intake.guesses.recipe_entries import LARGEST_STRAIN
from freelearn.data.intake.guesses.recipe_text import Path, recipe_lines
from freelearn.data.intake.guesses.typed_answers import Question
from freelearn.data.intake.rubber.rubber_guess import RubberGuess
from freelearn.data.intake.rubber.rubber_recipe import ALONG, KINDS, LARGEST, SPECIMEN, STRESSES, kind_of
from freelearn.data.specimen_schema import MODES
from freelearn.data.specimen_tests import TIME

UNUSED = "not used"
WORDS = {
    "uniaxial": "uniaxial tension", "equibiaxial": "equibiaxial tension", "pure_shear": "pure shear (a wide strip)",
    "simple_shear": "simple shear (a layer between plates)",
}  # fmt: skip


def rubber_questions(tests: Sequence[RubberGuess], answers: Answers, everything: bool = False) -> Iterator[Question]:
    """All that are to be asked; the keys begin with the number of the test. everything: also what files say."""
    for number, test in enumerate(tests, start=1):
        if everything or not test.mode or f"{number}.mode" in answers:
            yield mode_of(number, test)
        if answers.get(f"{number}.mode") == UNUSED:
            continue
        for which, kinds in (("along", ALONG), ("stress", STRESSES)):
            yield from _column(number, test, which, kinds, answers, everything)
        yield from _sizes(number, test, answers)
        if test.time and (everything or test.held or f"{number}.timed" in answers):
            text = (
                f"{test.label} has times, {test.time!r}. Does it show how the rubber relaxes (held, pulled at a rate, "
                "cycled)? A slow test shows the rubber at rest."
            )
            likely = YES if test.held else NO
            yield Question(f"{number}.timed", text, "choice", "", YES_OR_NO, likely, f"{test.label}: over time")
            if _timed(test, answers, number) and not test.column(test.time).unit:
                text, short = f"Which unit has {test.time!r} of {test.label}?", f"{test.label}: unit of {test.time!r}"
                yield Question(f"{number}.time.unit", text, "unit", TIME, (), "s", short)
        if test.torn and not _timed(test, answers, number):
            text = f"The stress of {test.label} falls at the end. Leave out what follows the largest, where it tore?"
            yield Question(f"{number}.torn", text, "choice", "", YES_OR_NO, YES, f"{test.label}: torn part left out")


def _timed(test: RubberGuess, answers: Answers, number: int) -> bool:
    """Whether a test is a recording, as was answered or is likely."""
    return bool(test.time) and answers.get(f"{number}.timed", YES if test.held else NO) == YES


def mode_of(number: int, test: RubberGuess) -> Question:
    """How the rubber of a test was loaded."""
    options = ((UNUSED, UNUSED), *WORDS.items())
    text = f"How was the rubber loaded in {test.label}?"
    return Question(f"{number}.mode", text, "choice", "", options, test.mode or None, f"{test.label}: loading")


def _column(
    number: int, test: RubberGuess, which: str, kinds: Mapping[str, Any], answers: Answers, everything: bool
) -> Iterator[Question]:
    """Which column it is, what kind of quantity, and in which unit, as far as no heading says so."""
    key, words = f"{number}.{which}", "stretch" if which == "along" else "stress"
    guessed = test.along if which == "along" else test.stress
    if everything or not guessed or key in answers:
        options = tuple((c.name, f"{c.name} ({c.low:.4g} … {c.high:.4g})") for c in test.columns)
        text = f"Which column of {test.label} is the {words}, strain or elongation?" if which == "along" else (
            f"Which column of {test.label} is the stress or force?"
        )  # fmt: skip
        yield Question(key, text, "choice", "", options, guessed or None, f"{test.label}: {words}")
    column = chosen(test, which, answers, number)
    if column is None:
        return
    kind, sure = kind_of(column.name, column.unit)
    if kind not in kinds or not sure:
        options = tuple((name, one.words) for name, one in kinds.items())
        before = _alike(number, f"{which}.kind", answers)
        likely = before or (kind if kind in kinds and which == "along" else None)
        text = f"What is {column.name!r} of {test.label} ({column.low:.4g} … {column.high:.4g})?"
        yield Question(f"{key}.kind", text, "choice", "", options, likely, f"{test.label}: {column.name!r} is")
    told = str(answers.get(f"{key}.kind", kind))
    if told in kinds and _unit_open(column, told):
        text = f"Which unit has {column.name!r} of {test.label} ({column.low:.4g} … {column.high:.4g})?"
        wanted = "" if kinds[told].unit == "ratio" else told
        before = _alike(number, f"{which}.unit", answers)
        yield Question(f"{key}.unit", text, "unit", wanted, (), before, f"{test.label}: unit of {column.name!r}")


def _alike(number: int, key: str, answers: Answers) -> str | None:
    """What was said of the test before this one."""
    before = answers.get(f"{number - 1}.{key}")
    return None if before is None else str(before)


def _unit_open(column: ColumnGuess, kind: str) -> bool:
    if KINDS[kind].unit != "ratio":
        return not column.unit
    percents = max(abs(column.low), abs(column.high)) > LARGEST_STRAIN
    return kind == "strain" and not column.unit and percents


def chosen(test: RubberGuess, which: str, answers: Answers, number: int) -> ColumnGuess | None:
    """The column that is the stretch (along) or the stress of a test."""
    name = str(answers.get(f"{number}.{which}", test.along if which == "along" else test.stress))
    return next((c for c in test.columns if c.name == name), None)


def kind_chosen(test: RubberGuess, which: str, answers: Answers, number: int) -> str:
    """The kind of that column, "" where it is open."""
    column = chosen(test, which, answers, number)
    kinds = ALONG if which == "along" else STRESSES
    if column is None:
        return ""
    kind, sure = kind_of(column.name, column.unit)
    return str(answers.get(f"{number}.{which}.kind", kind if sure and kind in kinds else ""))


def _sizes(number: int, test: RubberGuess, answers: Answers) -> Iterator[Question]:
    kinds = [kind_chosen(test, which, answers, number) for which in ("along", "stress")]
    for name in (need for kind in kinds if kind for need in KINDS[kind].needs):
        told = next((size for size in test.sizes if size.name == name), None)
        before = answers.get(f"{number - 1}.{name}")
        proposed = told.value if told else float(before) if isinstance(before, float) else None
        text = f"{SPECIMEN[name].capitalize()} of the specimen of {test.label}"
        short = f"{test.label}: {SPECIMEN[name]}"
        yield Question(f"{number}.{name}", text, "number", name, (), proposed, short, told.words if told else "")


def rubber_draft(tests: Sequence[RubberGuess], answers: Answers, name: str) -> str:
    """The recipe's text. What neither files nor answers say is marked TODO."""
    content: dict[str, Any] = {"tests": []}
    remarks: dict[Path, str] = {}
    for number, test in enumerate(tests, start=1):
        mode = answers.get(f"{number}.mode", test.mode or None)
        if mode == UNUSED:
            continue
        place = len(content["tests"])
        entry: dict[str, Any] = {"mode": mode}
        if mode is None:
            remarks["tests", place, "mode"] = f"TODO: {', '.join(MODES)}"
        entry |= {"file": test.file} if test.file else {}
        entry |= {"read": {"sheet": test.sheet}} if test.sheet else {}
        entry["columns"], left = _entries(test, answers, number)
        if left:
            remarks["tests", place, "columns"] = f"TODO: {'; '.join(left)}"
        needs = [n for kind in entry["columns"] if kind in KINDS for n in KINDS[kind].needs]
        if needs:
            told = {size.name: size.value for size in test.sizes}
            entry["constants"] = {need: answers.get(f"{number}.{need}", told.get(need)) for need in needs}
        timed = _timed(test, answers, number)
        if timed:
            unit = answers.get(f"{number}.time.unit", test.column(test.time).unit or "s")
            entry["columns"][TIME] = {"from": test.time, "unit": unit}
        if test.torn and not timed and answers.get(f"{number}.torn", YES) == YES:
            entry["until"] = LARGEST
        content["tests"].append(entry)
    return "\n".join([f"# How {name} becomes a table of tests of rubber.", *recipe_lines(content, remarks)]) + "\n"


def _entries(test: RubberGuess, answers: Answers, number: int) -> tuple[dict[str, Any], list[str]]:
    """The columns of a test, and what is left to be said of them."""
    entries: dict[str, Any] = {}
    left = []
    for which, kinds in (("along", ALONG), ("stress", STRESSES)):
        column, kind = chosen(test, which, answers, number), kind_chosen(test, which, answers, number)
        if column is None or not kind:
            kind = next(iter(kinds))
            left.append(f"whether it is {', '.join(kinds)}" if column else f"a column of {', '.join(kinds)}")
        entry: dict[str, Any] = {"from": column.name if column else None}
        unit = str(answers.get(f"{number}.{which}.unit", column.unit if column else ""))
        if unit:
            entry["unit"] = unit
        elif KINDS[kind].unit != "ratio":
            entry["unit"] = None
            left.append("its unit")
        elif column is not None and _unit_open(column, kind):
            entry["unit"] = "?"
            left.append('its unit, % or "1"')
        entries[kind] = entry
    return entries, left
