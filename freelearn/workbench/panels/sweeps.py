"""Studies: every model on every training set, and heat maps of those and of other sweeps that are finished."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
import panel as pn

from freelearn.cli.command_line import command_line
from freelearn.common.errors import UserError
from freelearn.records.provenance import read_document
from freelearn.workbench.panels.python_lines import python_lines
from freelearn.workbench.panels.widgets import Part, heading, say, table, words
from freelearn.workbench.state.own_code import models
from freelearn.workbench.state.question import started
from freelearn.workbench.state.session import Session

if TYPE_CHECKING:
    from freelearn.workbench.panels.cell_curves import CellCurves


ABOUT = (
    "Every model that is ticked is fitted to every training set, of the data, effects and choices on the left, and "
    "tested on every test set: the paper's heat maps. Linear and continuum models take about a second a fit, networks "
    "many times as long. What was fitted once is taken from there again."
)
FIRST = ("linear", "continuum")


class Studying(Part):
    """Models and training sets to tick."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.models = pn.widgets.CheckBoxGroup(name="models", options=models(), value=list(FIRST), inline=True)
        self.trains = pn.widgets.CheckBoxGroup(name="training sets", options=[], value=[], inline=True)
        self.go = pn.widgets.Button(name="Run the study", button_type="primary", width=220)
        self.go.on_click(lambda _: self.asked())
        self.wrong, self.lines = words(), words()
        self.view = pn.Column(
            heading("Run a study"), words(ABOUT), heading("Models", 3), self.models, heading("Training sets", 3),
            self.trains, self.go, self.wrong, self.lines, sizing_mode="stretch_width",
        )  # fmt: skip

    def asked(self) -> None:
        """Runs it."""
        wrong = [] if self.models.value and self.trains.value else ["Tick a model and a training set at least."]
        wrong = wrong or self._impossible()
        say(self.wrong, wrong, "bad")
        if not wrong:
            self.session.study(self.models.value, self.trains.value)

    def _impossible(self) -> list[str]:
        """Why models that are ticked cannot have the effects that were added."""
        # torch is imported with them: not before somebody asks for a study.
        from freelearn.physics.models.build import build_model

        reasons = []
        for name in self.models.value:
            try:
                build_model(name, effects=self.session.question.effects)
            except UserError as problem:
                reasons.append(f"{problem} Untick one of them.")
        return reasons

    def refresh(self) -> None:
        """Shows the session as it is."""
        sets, busy = self.session.sets, self.session.busy
        if self.trains.options != sets:
            with self.shown():
                self.trains.param.update(options=sets, value=list(sets))
        self.go.disabled = busy or not self.session.ready
        latest = self.session.asides.get("study")
        say(self.wrong, self.session.failure("study"), "bad")
        asked = latest["question"] if latest else None
        lines = [asked.command("study"), "\n".join(python_lines(asked, "study"))] if asked else []
        say(self.lines, lines, code=True)

    @property
    def latest(self) -> Path | None:
        """The table of the study that was run last."""
        done = self.session.asides.get("study")
        path = self.session.folder / done["folder"] / "heatmap.csv" if done else None
        return path if path and path.exists() else None


MOST_MAPS = 6
HINT = "Click a cell: its curves stand below."


class Sweeps:
    """The tab of studies: one to run, and those that are finished. Looks for these under a folder when asked, because
    new ones end at any time."""

    def __init__(self, folder: Path, session: Session) -> None:
        self.folder, self.session = folder, session
        self.studying = Studying(session)
        # The study of the session that was shown last.
        self.latest: Path | None = None
        self.choice = pn.widgets.Select(name="finished sweep", options=[], width=560)
        self.again = pn.widgets.Button(name="Look again", width=120, align="end")
        self.note = words()
        self.maps = pn.FlexBox(sizing_mode="stretch_width")
        self.hint = words()
        # Where a study has curves, they come with its maps.
        self.curves: CellCurves | None = None
        self.chosen = pn.Column(sizing_mode="stretch_width")
        self.paper, self.differ = words(), words()
        self.published = pn.Column(heading("Beside the paper's maps"), self.differ, self.paper, visible=False)
        self.again.on_click(lambda _: self.look())
        self.choice.param.watch(lambda _: self._draw(), "value")
        self.view = pn.Column(
            self.studying.view, heading("Finished studies and sweeps"), pn.Row(self.choice, self.again), self.note,
            self.maps, self.hint, self.chosen, self.published, sizing_mode="stretch_width",
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is: a study that has ended meanwhile comes first."""
        self.studying.refresh()
        latest = self.studying.latest
        if latest is not None and latest != self.latest:
            self.latest = latest
            self.look()
            self.choice.value = latest

    def look(self) -> None:
        """Looks for finished sweeps anew."""
        own = {"run here": self.latest} if self.latest else {}
        sweeps = sorted(self.folder.glob("**/heatmap.csv"), key=lambda path: -path.stat().st_mtime)
        options = own | {str(path.parent.relative_to(self.folder)): path for path in sweeps if path != self.latest}
        if not options:
            words = started("train")
            say(
                self.note,
                [f"No sweep under {self.folder} yet: {command_line(words, ['-m', 'experiment=study'])} makes one."],
                "quiet",
            )
        self.choice.options = options

    def _draw(self) -> None:
        # Bokeh's plotting takes a second to import: not before the page is there.
        from freelearn.records.sweep_records import read_gathered
        from freelearn.report.html.heatmap_chart import heatmap_chart
        from freelearn.report.tables.sweep_tables import PUBLISHED, beside_the_paper, cells, summary, where_they_differ

        self.maps.clear()
        say(self.hint, [])
        if self.curves is not None:
            self.curves.hide()
        self.published.visible = False
        if self.choice.value is None:
            return
        try:
            gathered = read_gathered(self.choice.value)
            shown, numbers = cells(gathered), summary(gathered)
        except UserError as problem:
            say(self.note, [str(problem)], "bad")
            return
        # As in the paper: its models first.
        order = list(PUBLISHED)
        labels = sorted(dict.fromkeys(shown["label"]), key=lambda n: order.index(n) if n in order else len(order))
        more = f" First {MOST_MAPS} of {len(labels)}." if len(labels) > MOST_MAPS else ""
        say(
            self.note,
            [f"Error E of every training set on every test set; one color scale.{more}", *_absent(gathered)],
            "quiet",
        )
        self.maps.objects = [
            pn.pane.Bokeh(heatmap_chart(shown, label, tapped=partial(self._tapped, gathered, label)))
            for label in labels[:MOST_MAPS]
        ]
        say(self.hint, [HINT], "quiet")
        paper = beside_the_paper(numbers)
        self.published.visible = paper is not None
        table(self.paper, paper)
        simulated = _simulated(self.choice.value.parent, str(gathered["run"].iloc[0]))
        say(self.differ, where_they_differ(shown, numbers, simulated))

    def _tapped(self, gathered: pd.DataFrame, label: str, train: str, test: str) -> None:
        """Shows the curves behind a cell; of several seeds those of the first."""
        # torch is imported with it: not before there is a curve.
        from freelearn.workbench.panels.cell_curves import CellCurves

        if self.curves is None:
            self.curves = CellCurves()
            self.chosen.objects = [self.curves.view]
        here = (gathered["label"] == label) & (gathered["train"] == train) & (gathered["test"] == test)
        row = gathered[here & (gathered["error"] == "")].iloc[0]
        run = self.choice.value.parent / str(row["run"])
        try:
            self.curves.show(run, label, train, test, float(row["E"]), int(row["n"]))
            say(self.hint, [HINT], "quiet")
        except (OSError, UserError) as problem:
            self.curves.hide()
            say(self.hint, [f"The run of this cell cannot be shown: {problem}"], "bad")


def _absent(gathered: pd.DataFrame) -> list[str]:
    """What has no cell, and why: of each reason how many fits, and the first of them."""
    failed = gathered[gathered["error"] != ""]
    alike = failed.groupby(["label", "error"], sort=False)["run"].nunique()
    return [f"No cell: {count} of {label}, {reason}" for (label, reason), count in alike.items()]


def _simulated(sweep: Path, run: str) -> bool:
    """Whether the sweep's data were simulated, as one of its runs says; no where that is gone."""
    try:
        return bool(read_document(sweep / run / "results.json")["data"]["simulated"])
    except (UserError, KeyError, TypeError):
        return False
