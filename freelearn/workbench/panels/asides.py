"""Tabs that ask something of the latest fit, those that ask which rows to measure next and that set two
fits side by side among them."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import panel as pn

from freelearn.workbench.panels.python_lines import python_lines
from freelearn.workbench.panels.widgets import Part, download, heading, say, table, words
from freelearn.workbench.state.question import Question
from freelearn.workbench.state.session import Session

# A tab that asks something of the latest fit, and shows the answer with the command and the Python that give it.

# Rows of a long answer that are shown; all of them are in the file.
MOST_ROWS = 60
FIRST = "Fit a model first: it is the latest fit that answers."
# Of every row alike, or for the program alone: in the file.
UNTOLD = ("gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "buckled", "step")
OLD = "This answer is of an earlier fit: ask again."


class Aside(Part):
    """kind: of the job; file: of its folder, the answer as a table. Those that derive from it put what is asked into
    `asking`."""

    kind: str
    file: str
    title: str
    # What is said while there is nothing to ask.
    first = FIRST

    def __init__(self, session: Session, label: str) -> None:
        super().__init__(session)
        self.asking = pn.Column()
        self.go = pn.widgets.Button(name=label, button_type="primary", width=220)
        # A message to the page's socket clicks what no mouse could.
        self.go.on_click(lambda _: None if self.go.disabled else self.asked())
        self.wrong, self.said, self.answer, self.lines = words(), words(), words(), words()
        self.save = download(f"Save {self.file}", 220, self.file)
        self.view = pn.Column(
            heading(self.title), self.asking, self.go, self.wrong, self.said, self.answer, self.save, self.lines,
            sizing_mode="stretch_width",
        )  # fmt: skip

    def asked(self) -> None:
        """Begins the job."""
        raise NotImplementedError

    @property
    def possible(self) -> bool:
        """Whether there is something to ask."""
        return bool(self.session.comparable())

    def told(self, folder: Path, answer: pd.DataFrame) -> list[str]:
        """Sentences above the answer."""
        return []

    def refresh(self) -> None:
        """Shows the session as it is."""
        latest = self.session.asides.get(self.kind)
        self.go.disabled = self.session.busy or not self.possible
        say(self.wrong, self.session.failure(self.kind), "bad")
        if latest is None:
            say(self.said, [] if self.possible else [self.first], "quiet")
            return
        self._show(latest["question"].run, self.session.folder / latest["folder"])
        question = latest["question"]
        say(self.lines, self.lines_of(question), code=True)

    def lines_of(self, question: Question) -> list[str]:
        """The command, and the lines of Python, with the same answer."""
        return [question.command(self.kind), "\n".join(python_lines(question, self.kind))]

    def _show(self, run: str, folder: Path) -> None:
        # Pandas' table and torch come with it: not before there is an answer.
        from freelearn.common.display import DisplayTable

        path = folder / self.file
        if not path.exists():
            say(self.said, [f"{path} is gone: ask again."], "bad")
            return
        answer = pd.read_csv(path)
        runs = self.session.comparable()
        old = not runs or run != str((self.session.folder / runs[-1]["folder"]).resolve())
        more = [f"First {MOST_ROWS} of {len(answer)} rows."] if len(answer) > MOST_ROWS else []
        say(self.said, [*([OLD] if old else []), *self.told(folder, answer), *more], "quiet")
        table(self.answer, DisplayTable.from_frame(_shown(answer.head(MOST_ROWS))))
        self.save.param.update(file=str(path), visible=True)


def _shown(answer: pd.DataFrame) -> pd.DataFrame:
    """The columns that a reader looks at, under names with their units."""
    # torch is imported with it: not before there is an answer.
    from freelearn.data.beds import BEDS
    from freelearn.queries.curves.curve_rows import pressures

    known = [q for bed in BEDS.values() for q in (*bed.imposed, *bed.measured)]
    pressed = pressures(answer)
    names = {q.column: f"{q.name} {q.unit}" for q in (*known, *pressed)}
    # Those of several actuators by their numbers: two columns of one name would be one.
    names |= {q.column: f"pressure {q.symbol} {q.unit}" for q in pressed} if len(pressed) > 1 else {}
    names |= {f"{column}_{end}": f"{name} {end}" for column, name in names.items() for end in ("low", "high")}
    shown = answer.drop(columns=[*UNTOLD], errors="ignore").dropna(axis="columns", how="all")
    numbers = dict.fromkeys(shown.select_dtypes("number"), float)
    return shown.astype(numbers).rename(columns=names)


# The rows that are worth measuring next.

ABOUT_PLAN = (
    "The rows that would tell most of what the latest fit left open: those that split effects which look alike, or "
    "else those that halve the widest interval. A fit that a search made tells most. Of a log these are samples, which "
    "make whole recordings: ask for as many as one has, or more."
)
MOST_PLANNED = 5000


class Planning(Aside):
    """How many rows there is time for."""

    kind, file, title = "plan", "plan.csv", "What to measure next"

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Choose the rows")
        self.rows = pn.widgets.IntInput(name="rows to measure", value=12, start=1, end=MOST_PLANNED, width=140)
        self.asking.objects = [words(ABOUT_PLAN), self.rows]

    def asked(self) -> None:
        """Plans so many rows."""
        self.session.ask(self.kind, rows=int(self.rows.value or 1))

    def told(self, folder: Path, answer: pd.DataFrame) -> list[str]:
        """What is expected of the rows, and how good the choice is."""
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        said = [str(plan[name]) for name in ("says", "certificate_says") if plan.get(name)]
        return said + [
            f"Run {each['run']}, sample {each['sample']}: {each['do']}." for each in plan.get("recordings", [])
        ]


ABOUT = "compare.txt"


class Sides(Aside):
    """A choice of two of the fits that can be compared."""

    kind, file, title = "compare", "comparison.html", "Two fits side by side"
    first = "There is one fit only: make another, with an effect or with another model."

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Set them side by side")
        self.one = pn.widgets.Select(name="A", options={}, width=340)
        self.other = pn.widgets.Select(name="B", options={}, width=340)
        self.asking.objects = [pn.FlexBox(self.one, self.other)]
        self.save = download("Page with curves", 220, self.file)
        self.view[-2] = self.save

    @property
    def possible(self) -> bool:
        """Whether there are two."""
        return len(self.session.same_table()) > 1

    def refresh(self) -> None:
        """Shows the session as it is."""
        runs = self.session.same_table()
        options = {f"{place}  {_words(run['question'])}": run["folder"] for place, run in enumerate(runs, start=1)}
        for choice, place in ((self.one, 0), (self.other, -1)):
            kept = choice.value if choice.value in options.values() else None
            # The latest stands beside the first until somebody chooses otherwise.
            kept = None if choice is self.other and kept == self.one.value else kept
            choice.param.update(options=options, value=kept or (list(options.values())[place] if options else None))
        self.view.visible = bool(runs)
        super().refresh()

    def asked(self) -> None:
        """Compares the two."""
        if self.one.value == self.other.value:
            say(self.wrong, ["A and B are the same fit: choose another."], "bad")
            return
        self.session.set_beside(self.one.value, self.other.value)

    def _show(self, run: str, folder: Path) -> None:
        text, page = folder / ABOUT, folder / self.file
        if not (text.exists() and page.exists()):
            say(self.said, [f"{page} is gone: ask again."], "bad")
            return
        say(self.said, [])
        lines = text.read_text(encoding="utf-8").splitlines()
        say(
            self.answer,
            ["\n".join(line.rstrip() for line in lines if not line.startswith("page: ")).strip()],
            code=True,
        )
        self.save.param.update(file=str(page), visible=True)


def _words(question: object) -> str:
    model, effects, train = (getattr(question, name) for name in ("model", "effects", "train"))
    return f"{' + '.join([model, *effects])}, on {train}"
