"""Columns of a laboratory's file: what intake takes them for, to be changed, and the table that is made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import panel as pn

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.column_questions import said
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.draft_questions import questions
from freelearn.data.intake.guesses.guess import with_meanings
from freelearn.data.intake.guesses.guessed import WHAT, WHICH, Guess
from freelearn.data.intake.guesses.joined import Guessed
from freelearn.data.intake.guesses.meanings import MEANINGS, NOT_USED
from freelearn.data.intake.guesses.recordings_found import EVERY
from freelearn.workbench.panels.file_questions import SAY, ColumnRow, OpenQuestions
from freelearn.workbench.panels.widgets import download, give, heading, say, words
from freelearn.workbench.state.question import downloaded_recipe
from freelearn.workbench.state.session import Session

# A file with more columns is a log of everything; those that no heading explains are not shown.
MOST_COLUMNS = 40
# With the widths of what stands below them.
HEADINGS = {"column of the file": 330, "what it is": 170, "unit": 100, "sign": 150, "reading at zero": 130}
SIGNS = (
    "A force is positive in the table where the actuator pushes: a muscle's pull is negative. Force and moment are "
    "those that the actuator exerts on its mount: without pressure they fall as it is stretched, or turned the "
    "positive way."
)
UNSAID_SIGNS = {
    "force_n": "whether a positive reading is a push or a pull",
    "moment_nmm": "whether it rises or falls as the actuator is turned the positive way without pressure",
}
# What the rows of columns say is not asked a second time.
IN_THE_ROWS = (WHAT, WHICH, "unit.", "sign.")


class Mapping:
    """Shown while a file's columns are being mapped."""

    def __init__(self, session: Session) -> None:
        self.session = session
        # Of which file, and what the page itself has to say against what was chosen.
        self.of, self.said, self.named = "", "", ""
        self.guessed: Guessed | None = None
        self.rows: list[ColumnRow] = []
        self.about, self.notes, self.problem = words(), words(), words()
        self.questions = OpenQuestions(self._offer)
        self.sheet = pn.widgets.Select(name="Which sheet holds the readings?", width=330, visible=False)
        self.sheet.param.watch(lambda _: self._chosen(), "value")
        self.table = pn.Column()
        self.signs = words(SIGNS)
        self.use = pn.widgets.Button(name="Go on to the report", button_type="primary", width=180)
        self.make = pn.widgets.Button(name="Make the table only", width=180)
        self.drop = pn.widgets.Button(name="Not now", width=120)
        self.use.on_click(lambda _: self._use("discover"))
        self.make.on_click(lambda _: self._use(""))
        self.drop.on_click(lambda _: self.session.map_columns(False))
        self.view = pn.Column(
            heading("What are these columns?"), self.about, self.sheet, self.notes, self.table, self.signs,
            heading("What the file does not say", 3), self.questions.view, self.problem,
            pn.Row(self.use, self.make, self.drop),
            visible=False,
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is. What was chosen stays so until there is another file."""
        raw = self.session.raw
        self.view.visible = self.session.mapping
        if raw and raw["path"] != self.of:
            self.of = raw["path"]
            self._build(raw)
        say(self.problem, self.said.splitlines() or self.session.problem.splitlines(), "bad")
        self.use.disabled = self.make.disabled = self.drop.disabled = self.session.busy

    def _build(self, raw: dict[str, Any]) -> None:
        sheets = list(raw["guess"].get("sheets", {}))
        self.guessed = None
        every = {EVERY: EVERY} if raw["guess"]["guessed"]["found"].get("recordings") and sheets else {}
        self.sheet.param.update(options={SAY: "", **{sheet: sheet for sheet in sheets}, **every}, value="")
        self.sheet.visible = bool(sheets)
        known = "" if raw["guess"]["nearly"] else " is no measurement table yet"
        self.named = f"{raw['name']}{known}"
        self._show(Guessed.from_plain(raw["guess"]["guessed"]), raw["guess"]["notes"])

    def _chosen(self) -> None:
        """Shows the sheet that was chosen."""
        raw = self.session.raw
        if self.guessed is not None and raw and self.sheet.value == EVERY:
            self._show(Guessed.from_plain(raw["guess"]["guessed"]), raw["guess"]["notes"])
        elif self.guessed is not None and raw and self.sheet.value:
            guessed = Guessed.from_plain(raw["guess"]["sheets"][self.sheet.value])
            self._show(guessed, guessed.found.notes)

    def _show(self, guessed: Guessed, notes: Sequence[str]) -> None:
        """A guess, to be changed."""
        self.guessed, found = guessed, guessed.found
        shown = sorted(found.columns, key=lambda c: not (c.chosen or c.quantity))[:MOST_COLUMNS]
        columns = [column for column in found.columns if column in shown]
        more = len(found.columns) - len(columns)
        text = f"{self.named}: {found.rows} rows. This is a guess; change what is wrong."
        recipe = "Or drop a recipe (YAML) where you dropped the file."
        say(self.about, [text, recipe, *([f"{more} further columns are not shown."] if more else [])])
        say(self.notes, [f"! {note}" for note in notes])
        self.said = ""
        open_ones = {name for names in found.rivals for name in names}
        self.rows = [ColumnRow(column, column.name in open_ones, self._offer) for column in columns]
        titles = [pn.pane.HTML(f"<b>{title}</b>", width=width, margin=(2, 10)) for title, width in HEADINGS.items()]
        self.table.objects = [pn.Row(*titles), *(pn.Row(*row.cells) for row in self.rows)]
        self._offer()

    def _known(self) -> dict[str, str | float]:
        """What the rows of columns say."""
        return {key: value for row in self.rows for key, value in row.answers.items()}

    def _found(self, answers: dict[str, str | float]) -> Guess:
        """The guess once all of it is as the page says."""
        assert self.guessed is not None
        first = self.guessed.found
        found = with_meanings(first, {c.name: NOT_USED for c in first.columns} | said(first, answers))
        column = found.of("sample")
        return replace(found, samples=column.words if column else ())

    def _offer(self) -> None:
        """Asks what these columns leave open. An answer may bring a question, or make one needless."""
        if self.guessed is None:
            return
        known = self._known()
        for _ in range(2):
            answers = known | self.questions.answers(known)[0]
            asked = questions(self._found(answers), self.guessed.joined, answers)
            self.questions.ask([q for q in asked if not q.key.startswith(IN_THE_ROWS)])

    def _use(self, then: str) -> None:
        if self.guessed is None:
            return  # A click on a button that nobody sees.
        known = self._known()
        given, wrong = self.questions.answers(known)
        answers = known | given
        found = self._found(answers)
        wrong = [*self._unsaid(), *wrong]
        self.said = "\n".join(wrong)
        if not wrong:
            try:
                _once(self.rows, found)
                self.session.take_in(draft(found, (), self.guessed.joined, answers).encode(), then)
            except UserError as problem:
                self.said = str(problem)
        self.refresh()

    def _unsaid(self) -> list[str]:
        """Units and signs that are still to be chosen."""
        lacking = ["Which sheet holds the readings: still to be said."] if self._sheet_open() else []
        for row in self.rows:
            if not row.quantity.value:
                lacking.append(
                    f"what {row.guess.name} is: several columns seem to say the same. Choose one, not the others."
                )
            meaning = MEANINGS.get(row.quantity.value)
            name, said = row.guess.name, row.answers
            if meaning and meaning.kind not in ("", "ratio") and f"unit.{name}" not in said:
                lacking.append(f"unit of {name}: still to be said.")
            if meaning and f"sign.{name}" not in said:
                lacking.append(f"sign of {name}: say {UNSAID_SIGNS[row.quantity.value]}.")
        return lacking

    def _sheet_open(self) -> bool:
        return self.sheet.visible and not self.sheet.value


def _once(rows: list[ColumnRow], found: Guess) -> None:
    """Raises UserError where two columns are one thing; several pressures are those of several actuators, several times
    those of several clocks."""
    first: dict[str, ColumnRow] = {}
    several = (*found.pressures, *(clock.time for clock in found.clocks))
    for row in rows:
        meaning = MEANINGS.get(row.quantity.value)
        if meaning is None or row.guess.name in several or meaning.column == "pressure_kpa":
            continue
        if meaning.column in first:
            one, other = first[meaning.column].guess.name, row.guess.name
            raise UserError(
                f"The columns {one!r} and {other!r} are both the {meaning.words}: keep one, and say of the other that "
                "it is not used."
            )
        first[meaning.column] = row


# The table that intake made of a laboratory's file: what looks wrong in it, and what to take along.

# Five of them stand side by side.
WIDTH = 165


class Made:
    """Hidden where the table was given as it is."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.about, self.warnings, self.command = words(), words(), words()
        self.table, self.members = download("Table (CSV)", WIDTH), download("Actuators (CSV)", WIDTH)
        self.recipe, self.provenance = download("Recipe (YAML)", WIDTH), download("Provenance (JSON)", WIDTH)
        self.again = pn.widgets.Button(name="Change the columns", width=WIDTH)
        self.again.on_click(lambda _: self.session.map_columns(True))
        self.view = pn.Column(
            heading("The table that was made"), self.about, pn.Column(self.warnings, scroll=True, max_height=220),
            pn.FlexBox(self.table, self.members, self.recipe, self.provenance, self.again), self.command,
            visible=False,
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is."""
        made, table = self.session.made, self.session.table
        # Once rows are marked to be left out, the table is no longer the one that was made.
        self.view.visible = bool(made) and made["path"] == self.session.question.path and not self.session.mapping
        if not self.view.visible:
            return
        say(self.about, [f"Made of {made['name']}. From here on it is used as if it had been given."], "quiet")
        told = {*table.get("warnings", []), *table.get("unit_warnings", [])}
        say(self.warnings, [f"! {warning}" for warning in made["warnings"] if warning not in told])
        folder, stem = self.session.folder / made["folder"], Path(made["name"]).stem
        files = (
            (self.table, folder / "table.csv", f"{stem}_table.csv"),
            (self.members, folder / "table_members.csv", f"{stem}_table_members.csv"),
            (self.provenance, folder / "table_provenance.json", f"{stem}_table_provenance.json"),
            (self.recipe, Path(made["recipe"]), downloaded_recipe(made["name"])),
        )
        for button, path, name in files:
            give(button, path, name, button is not self.members or made["members"])
        self.again.disabled = self.session.busy
        say(self.command, [made["command"]], code=True)
