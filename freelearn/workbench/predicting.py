"""Fill in the blanks: what an actuator does, where its end comes to rest, which pressure to command."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import pandas as pd
import panel as pn

from freelearn.csv_text import csv_text
from freelearn.workbench.aside import Aside
from freelearn.workbench.asked_file import AskedFile
from freelearn.workbench.controls import Dropper, download
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words

ABOUT = (
    "Leave blank what you want to know: the loads at a place, the place where given loads leave the end (0: free), or "
    "the pressure to command. Two quantities may be blank, and one more for each further actuator."
)
DROP = "Or drop a file with a question in each row, such as a trajectory whose pressures are wanted:"


class Predicting(Aside):
    """A field for each quantity, and a place for a file of many questions."""

    kind, file, title = "predict", "answers.csv", "Predict and command"

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Fill in the blanks")
        self.of, about, drop = "", words(), words()
        self.fields: dict[str, pn.widgets.TextInput] = {}
        self.sample = pn.widgets.Select(name="of sample", options=[], width=110)
        self.row = pn.FlexBox(align_items="flex-end")
        self.dropped = Dropper(286, self._dropped)
        self.template = download("Template of the questions", 220, "questions.csv", self._template)
        say(about, [ABOUT], "quiet")
        say(drop, [DROP], "quiet")
        self.asking.objects = [about, self.row]
        self.laboratory = AskedFile(session)
        self.recipe = download("Recipe (YAML)", 220, "recipe.yaml")
        self.picture = pn.pane.PNG(
            None, max_width=760, sizing_mode="scale_width", visible=False, alt_text="What was given, and the answers"
        )
        # The fields and their button first, then a file.
        above = self.view.objects.index(self.wrong)
        self.view[above:above] = [drop, pn.FlexBox(self.dropped, self.template), self.laboratory.view]
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
        job = self.session.job
        if job is not None and job.kind == "asks" and job.status == "failed":
            say(self.wrong, [job.text], "bad")

    def _fields(self, folder: Path) -> None:
        """Those that the run's actuators have."""
        # torch is imported with it: not before something is fitted.
        from freelearn.measurements.beds import ELONGATION, FORCE, MOMENT, TWIST
        from freelearn.measurements.sets import samples_of
        from freelearn.results.quantities import pressures

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
        self.recipe.param.update(file=question.recipe or None, visible=bool(question.recipe))
        self.recipe.filename = f"{Path(question.name).stem}_recipe.yaml"

    def told(self, folder: Path, answer: pd.DataFrame) -> list[str]:
        """How many questions have an answer."""
        good = int((answer["status"] == "ok").sum())
        return [f"{good} of {len(answer)} answered; _low and _high: 95 % for a new measurement."]
