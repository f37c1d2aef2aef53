"""Fill in the blanks: what an actuator does, where its end rests, which pressure to command; of raw files, too."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

import pandas as pd
import panel as pn

from freelearn.common.csv_text import csv_text
from freelearn.data.intake.guesses.column_questions import meaning_of, said
from freelearn.data.intake.guesses.guess import with_meanings
from freelearn.data.intake.guesses.guessed import Guess
from freelearn.data.intake.guesses.joined import Guessed
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.guesses.wanted import Actuators, wanted_draft, wanted_questions
from freelearn.workbench.panels.asides import Aside
from freelearn.workbench.panels.file_questions import OpenQuestions
from freelearn.workbench.panels.widgets import Dropper, Tick, download, give, say, words
from freelearn.workbench.state.question import downloaded_recipe
from freelearn.workbench.state.session import Session

# A laboratory's file that asks something of a fit: what its columns are, and what else is to be said of it.


class AskedFile:
    """Hidden until a file was read that is no table of questions itself."""

    def __init__(self, session: Session) -> None:
        self.session = session
        # The job that read the file, and what it found.
        self.of = ""
        self.guessed: Guessed | None = None
        self.known = Actuators({1: {}}, 0, {})
        self.about, self.wrong = words(), words()
        self.all = Tick("change what the columns are", 300, lambda _: self._offer())
        self.questions = OpenQuestions(self._offer)
        self.go = pn.widgets.Button(name="Answer the file", button_type="primary", width=220)
        self.go.on_click(lambda _: self._answer())
        self.view = pn.Column(
            self.about, self.all.view, self.questions.view, self.wrong, self.go, visible=False,
            sizing_mode="stretch_width",
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows what was read last; a table of questions is answered at once."""
        latest = self.session.asides.get("asks")
        folder = latest["folder"] if latest else ""
        self.go.disabled = self.session.busy
        if folder == self.of:
            return
        self.of = folder
        content = self.session.read(latest, "asks.json") if latest else None
        self.guessed = None
        if latest and content and content["table"]:
            self.session.ask("predict", asks=latest["question"].asks)
        elif content:
            self._read(content)
        self.view.visible = self.guessed is not None

    def _read(self, content: dict[str, Any]) -> None:
        self.guessed = Guessed.from_plain(content["guessed"])
        known = content["known"]
        designs = {int(number): dict(design) for number, design in known["designs"].items()}
        self.known = Actuators(designs, int(known["members"]), dict(known["held"]))
        found = self.guessed.found
        lines = [f"{found.name}: {found.rows} rows that ask something of the latest fit."]
        for column in found.columns:
            what = MEANINGS[column.quantity].words if column.chosen and column.quantity else "not used"
            lines.append(f"{column.name}: {what}{f' [{column.unit}]' if column.unit and column.chosen else ''}")
        say(self.about, [*lines, *(f"! {note}" for note in found.notes)])
        self._offer()

    def _found(self, answers: dict[str, str | float]) -> Guess:
        assert self.guessed is not None
        return with_meanings(self.guessed.found, said(self.guessed.found, answers))

    def _offer(self) -> None:
        """Asks what is open; an answer may bring a question."""
        if self.guessed is None:
            return
        for _ in range(2):
            answers = self.questions.answers({})[0]
            asked = {q.key: q for q in wanted_questions(self._found(answers), self.known, answers)}
            if self.all.ticked:
                columns = {q.key: q for q in map(meaning_of, self.guessed.found.columns)}
                asked = columns | {key: question for key, question in asked.items() if key not in columns}
            self.questions.ask(list(asked.values()))

    def _answer(self) -> None:
        given, wrong = self.questions.answers({})
        say(self.wrong, wrong, "bad")
        latest = self.session.asides.get("asks")
        if wrong or latest is None:
            return
        recipe = self.session.stored(wanted_draft(self._found(given), self.known, given).encode(), "recipe", ".yaml")
        question = latest["question"]
        self.session.ask("predict", asks=question.asks, name=question.name, recipe=recipe)


# Fill in the blanks: what an actuator does, where its end comes to rest, which pressure to command.

ABOUT_BLANKS = (
    "Leave blank what you want to know: the loads at a place, the place where given loads leave the end (0: free), or "
    "the pressure to command. Two quantities may be blank, and one more for each further actuator."
)
DROP = "Or drop a file with a question in each row, such as a trajectory whose pressures are wanted:"


class Predicting(Aside):
    """A field for each quantity, and a place for a file of many questions."""

    kind, file, title = "predict", "answers.csv", "Predict and command"

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Fill in the blanks")
        self.of = ""
        self.fields: dict[str, pn.widgets.TextInput] = {}
        self.sample = pn.widgets.Select(name="of sample", options=[], width=110)
        self.row = pn.FlexBox(align_items="flex-end")
        self.dropped = Dropper(286, self._dropped)
        self.template = download("Template of the questions", 220, "questions.csv", self._template)
        self.asking.objects = [words(ABOUT_BLANKS), self.row]
        self.laboratory = AskedFile(session)
        self.recipe = download("Recipe of the questions (YAML)", 220, "recipe.yaml")
        self.picture = pn.pane.PNG(
            None, max_width=760, sizing_mode="scale_width", visible=False, alt_text="What was given, and the answers"
        )
        # The fields and their button first, then a file.
        above = self.view.objects.index(self.wrong)
        self.view[above:above] = [words(DROP), pn.FlexBox(self.dropped, self.template), self.laboratory.view]
        self.view.insert(self.view.objects.index(self.answer), self.picture)
        self.view.insert(self.view.objects.index(self.lines), self.recipe)

    def refresh(self) -> None:
        """Shows the session as it is."""
        runs = self.session.comparable()
        if runs and self.of != runs[-1]["folder"]:
            self._fields(self.session.folder / runs[-1]["folder"])
            self.of = runs[-1]["folder"]
        for part in (self.row, self.dropped, self.template):
            part.visible = bool(runs)
        self.laboratory.refresh()
        super().refresh()
        if problem := self.session.failure("asks"):
            say(self.wrong, problem, "bad")

    def _fields(self, folder: Path) -> None:
        """Those that the run's actuators have."""
        # torch is imported with it: not before something is fitted.
        from freelearn.data.beds import ELONGATION, FORCE, MOMENT, TWIST
        from freelearn.data.sets import samples_of
        from freelearn.queries.curves.curve_rows import pressures

        own = folder / "predictions.csv"
        rows = pd.read_csv(own if own.exists() else folder / "predictions_after.csv")
        before = {name: field.value for name, field in self.fields.items()}
        asked = (ELONGATION, TWIST, *pressures(rows), FORCE, MOMENT)
        self.fields = {
            q.column: pn.widgets.TextInput(
                name=f"{q.name} {q.symbol} [{q.unit}]", width=130, placeholder="blank: asked"
            )
            for q in asked
        }
        for name, field in self.fields.items():
            field.value = before.get(name, "")
        samples = [int(n) for n in sorted(rows["sample"].unique())]
        # The first that was fitted: of the others the model knows nothing but their designs.
        fitted = samples_of(self.session.comparable()[-1]["question"].train, rows["sample"].to_numpy())
        self.sample.param.update(options=samples, value=int(fitted[0]))
        self.row.objects = [self.sample, *self.fields.values()]

    def asked(self) -> None:
        """Asks what stands in the fields."""
        row: dict[str, str] = {"sample": str(self.sample.value)}
        for name, field in self.fields.items():
            text = (field.value_input or field.value or "").strip().replace(",", ".").replace("−", "-")
            try:
                row[name] = repr(float(text)) if text else ""
            except ValueError:
                say(self.wrong, [f"{field.name}: {text[:40]!r} is no number."], "bad")
                return
        self._ask(csv_text(pd.DataFrame([row])).encode())

    def _dropped(self, name: str, content: bytes) -> None:
        self.session.ask_file(name, content)

    def _ask(self, content: bytes) -> None:
        if not self.session.busy:
            self.session.ask(self.kind, asks=self.session.stored(content, "questions"))

    def _template(self) -> StringIO:
        names = ["sample", *self.fields]
        return StringIO(",".join(names) + f"\n{self.sample.value}" + "," * len(self.fields) + "\n")

    def _show(self, run: str, folder: Path) -> None:
        super()._show(run, folder)
        picture, question = folder / "answers.png", self.session.asides[self.kind]["question"]
        self.picture.param.update(object=str(picture) if picture.exists() else None, visible=picture.exists())
        give(self.recipe, Path(question.recipe), downloaded_recipe(question.name), bool(question.recipe))

    def told(self, folder: Path, answer: pd.DataFrame) -> list[str]:
        """How many questions have an answer."""
        good = int((answer["status"] == "ok").sum())
        return [f"{good} of {len(answer)} answered; _low and _high: 95 % for a new measurement."]
