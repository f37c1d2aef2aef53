"""What intake shows in the terminal: its guess at a file, or what became of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from freelearn.common.display import Column, DisplayTable
from freelearn.common.formats import number
from freelearn.data.intake.assemble import Intake
from freelearn.data.intake.guesses.guessed import Guess
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.rubber.rubber_convert import RubberIntake
from freelearn.data.intake.rubber.rubber_guess import RubberGuess
from freelearn.report.terminal.printed_tables import print_line, print_words, rich_table

TESTS = ("test", "loading", "rows", "stretch from", "stress from")
# A number with more characters is shown with fewer digits.
SHORT = 9
HEADINGS = ("column", "what it is", "unit", "how sure", "from … to", "first")


def show_columns(console: Console, found: Guess) -> None:
    """The columns, numbered, with what they seem to be, and what looks wrong."""
    rows = [
        (
            f"{number} {c.name}",
            MEANINGS[c.quantity].words if c.chosen and c.quantity else "–",
            c.unit,
            c.confidence if c.chosen else "",
            _range(c.low, c.high),
            _short(c.example),
        )
        for number, c in enumerate(found.columns, start=1)
    ]
    columns = tuple(Column(heading, words=True) for heading in HEADINGS)
    console.print(rich_table(DisplayTable(columns, tuple(rows), f"{found.name}: {found.rows} rows")))
    _say(console, found.notes)


def show_guess(console: Console, found: Guess, recipe: Path, command: str) -> None:
    """The columns with what they seem to be, what looks wrong, and how to go on. command: the next one."""
    show_columns(console, found)
    show_draft(console, recipe, command)


def show_draft(console: Console, recipe: Path, command: str) -> None:
    """Where the draft is, and how to go on."""
    print_line(console, f"draft: {recipe}")
    print_words(console, "Nothing was converted. Edit the draft (look for TODO), then:")
    print_line(console, f"  {command}")


def show_intake(
    console: Console, intake: Intake, files: Sequence[Path], commands: Sequence[str], going_on: bool = False
) -> None:
    """How many rows came of each file, what looks wrong, and where the table is. commands: that use it. going_on: with
    the first of them at once."""
    for file in intake.files:
        left = [f"{file['dropped']} dropped"] if file["dropped"] else []
        left += [f"{file['lost_by_joining']} outside of what is joined"] if file.get("lost_by_joining") else []
        left += [f"{file['between_plateaus']} between plateaus"] if file["between_plateaus"] else []
        rest = f" ({', '.join(left)})" if left else ""
        text = f"{file['file']}: {file['rows']} rows{rest} → {file['table_rows']} of the table"
        print_words(console, text)
    _say(console, intake.warnings)
    for path in files:
        print_line(console, f"written: {path}")
    print_words(console, "now:" if going_on else "next:")
    for command in commands:
        print_line(console, f"  {command}")


def show_tests(console: Console, tests: Sequence[RubberGuess]) -> None:
    """Tests of rubber, numbered, with what their columns seem to be, and what looks wrong."""
    rows = [
        (
            f"{number} {test.label}",
            test.mode.replace("_", " ") or "–",
            str(test.rows),
            test.along or "–",
            test.stress or "–",
        )
        for number, test in enumerate(tests, start=1)
    ]
    columns = tuple(Column(heading, words=True) for heading in TESTS)
    console.print(rich_table(DisplayTable(columns, tuple(rows), "Tests of rubber")))
    _say(console, list(dict.fromkeys(note for test in tests for note in test.notes)))


def show_rubber(
    console: Console, intake: RubberIntake, files: Sequence[Path], command: str, going_on: bool = False
) -> None:
    """How many rows came of each test, what looks wrong, and where the table is. command: the one that goes on."""
    for test in intake.records:
        print_words(console, f"{test['file']}: {test['rows']} rows, {test['mode']}")
    _say(console, intake.warnings)
    for path in files:
        print_line(console, f"written: {path}")
    print_words(console, "now:" if going_on else "next:")
    print_line(console, f"  {command}")


def _say(console: Console, notes: Sequence[str]) -> None:
    for note in notes:
        print_words(console, f"! {note}")


def _short(example: str) -> str:
    """A number with as many digits as one looks at; anything else as it is written."""
    try:
        return f"{float(example):.6g}" if len(example) > SHORT else example
    except ValueError:
        return example


def _range(low: float, high: float) -> str:
    return "text" if math.isnan(low) else f"{number(low, 4)} … {number(high, 4)}"
