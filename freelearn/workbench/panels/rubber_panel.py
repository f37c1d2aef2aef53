"""The rubber alone, fitted to its own tests, from the files as laboratories have them."""

from __future__ import annotations

import json
from pathlib import Path

import panel as pn

from freelearn.data.intake.rubber.rubber_guess import RubberGuess, tests_of
from freelearn.data.intake.rubber.rubber_questions import rubber_draft, rubber_questions
from freelearn.workbench.panels.asides import Aside
from freelearn.workbench.panels.file_questions import OpenQuestions
from freelearn.workbench.panels.python_lines import rubber_lines
from freelearn.workbench.panels.widgets import Dropper, Tick, download, give, say, words
from freelearn.workbench.state.question import Question, downloaded_recipe
from freelearn.workbench.state.session import Session

ABOUT = (
    "Tests of rubber alone, a sheet or a strip in tension, in equibiaxial tension, in pure shear: drop their files one "
    "after another, or a workbook with a sheet for each. A model of an actuator can take over what comes out."
)
ENERGIES = (
    "limited_extensibility",
    "second_invariant",
    "second_invariant_log",
    "small_strain_stiffness",
    "wall_stiffening",
)
CHOICE = "Energies besides the neo-Hookean; with none ticked all are compared, and what the tests ask for is fitted:"


class Rubber(Aside):
    """A place for files, what else is to be said of them, and the energies that the rubber may have."""

    kind, file, title = "rubber", "specimen.json", "Rubber alone"
    first = "Drop a file first."

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Fit the rubber")
        latest = session.asides.get(self.kind)
        # Which files the tests were read from.
        self.of = ""
        self.tests: list[RubberGuess] = []
        about, self.given, choice = words(ABOUT), words(), words(CHOICE)
        self.dropped = Dropper(420, session.add_tests)
        self.dropped.visible = True
        self.anew = pn.widgets.Button(name="Begin anew", width=120, visible=False)
        self.anew.on_click(lambda _: session.forget_tests())
        self.all = Tick("change what the files seem to say", 300, lambda _: self._offer())
        self.questions = OpenQuestions(self._offer)
        self.effects = pn.widgets.CheckBoxGroup(name="energies", options=list(ENERGIES))
        self.effects.param.update(value=list(latest["question"].effects) if latest else [])
        self.report = download("Report of the rubber", 220, "report.html")
        self.recipe = download("Recipe of the tests (YAML)", 220, "recipe.yaml")
        self.picture = pn.pane.PNG(
            None,
            max_width=1100,
            sizing_mode="scale_width",
            visible=False,
            alt_text="Stress against stretch, measured and fitted",
        )
        files = pn.FlexBox(self.dropped, self.anew)
        self.asking.objects = [about, files, self.given, self.all.view, self.questions.view, choice, self.effects]
        self.verdict = words()
        above = self.view.objects.index(self.answer)
        self.view[above:above] = [self.verdict, self.picture]
        self.view.insert(-1, pn.FlexBox(self.report, self.recipe))

    @property
    def possible(self) -> bool:
        """Whether there is a test."""
        return bool(self.tests)

    def asked(self) -> None:
        """Fits the tests."""
        given, wrong = self.questions.answers({})
        say(self.wrong, wrong, "bad")
        if not wrong:
            names = ", ".join(name for name, _ in self.session.asides["tests"]["question"].sheets)
            recipe = rubber_draft(self.tests, given, names)
            self.session.fit_rubber(recipe.encode(), self.effects.value)

    def refresh(self) -> None:
        """Shows the session as it is."""
        there = self.session.asides.get("tests")
        folder = there["folder"] if there else ""
        if folder != self.of:
            self.of, self.tests = folder, self._read(folder)
            self._offer()
        lines = [
            f"{number}  {test.label}: {test.mode.replace('_', ' ') or 'which loading?'}, {test.rows} rows, stretch "
            f"from {test.along or '?'}, stress from {test.stress or '?'}"
            for number, test in enumerate(self.tests, start=1)
        ]
        say(self.given, [*lines, *dict.fromkeys(f"! {note}" for test in self.tests for note in test.notes)])
        self.anew.visible = bool(self.tests)
        self.all.show(self.all.ticked, visible=bool(self.tests), disabled=self.session.busy)
        self.dropped.disabled = self.anew.disabled = self.session.busy
        super().refresh()
        if problem := self.session.failure("tests"):
            say(self.wrong, problem, "bad")

    def _read(self, folder: str) -> list[RubberGuess]:
        path = self.session.folder / folder / "tests.json"
        return tests_of(json.loads(path.read_text(encoding="utf-8"))) if folder and path.exists() else []

    def _offer(self) -> None:
        """Asks what is open; an answer may bring a question."""
        for _ in range(2):
            answers = self.questions.answers({})[0]
            self.questions.ask(list(rubber_questions(self.tests, answers, self.all.ticked)))

    def _show(self, run: str, folder: Path) -> None:
        path, text = folder / self.file, folder / "rubber.txt"
        if not (path.exists() and text.exists()):
            say(self.said, [f"{path} is gone: fit again."], "bad")
            return
        told, verdict = _apart(text.read_text(encoding="utf-8"))
        say(self.verdict, [verdict] if verdict else [], "verdict")
        say(self.answer, [told], code=True)
        self.picture.param.update(object=str(folder / "curves.png"), visible=True)
        question = self.session.asides[self.kind]["question"]
        for button, of, name in (
            (self.save, path, self.file),
            (self.report, folder / "report.html", "report.html"),
            (self.recipe, Path(question.recipe), downloaded_recipe(question.sheets[0][0])),
        ):
            give(button, of, name, of.exists())

    def lines_of(self, question: Question) -> list[str]:
        """The command, and how a fit in Python takes over what came out."""
        folder = self.session.asides[self.kind]["folder"]
        found = self.session.read({"folder": folder}, self.file) or {}
        specimen = self.session.folder / folder / self.file
        lines = rubber_lines(self.session.question, specimen.resolve(), found.get("effects", ()))
        return [question.command(self.kind), "\n".join(lines)]


def _apart(text: str) -> tuple[str, str]:
    """What the command printed, without its paths, and the sentence on what the tests ask for."""
    lines = [line.rstrip() for line in text.splitlines() if not line.startswith(("files: ", "report: ", "table: "))]
    begin = next((i for i, line in enumerate(lines) if line.startswith("These tests ask for")), None)
    if begin is None:
        return "\n".join(lines).strip(), ""
    end = next((i for i, line in enumerate(lines) if i > begin and line.startswith("error E")), len(lines))
    return "\n".join([*lines[:begin], "", *lines[end:]]).strip(), " ".join(lines[begin:end]).strip()
