"""The left column: data, model, fit, search, and what to take away."""

from __future__ import annotations

import panel as pn

from freelearn.workbench.panels.data_step import Given
from freelearn.workbench.panels.widgets import Part, Tick, download, heading, say, words
from freelearn.workbench.state.own_code import models
from freelearn.workbench.state.question import FITS, SPLITS
from freelearn.workbench.state.session import Session


class AdvancedOptions(Part):
    """Folded up until somebody asks for it."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        inner = width - 20
        self.fit = pn.widgets.Select(name="fitted by", options=_turned(FITS), width=inner)
        self.split = pn.widgets.Select(name="tested on", options=_turned(SPLITS), width=inner)
        self.seed = pn.widgets.IntInput(name="seed of the split and of networks", start=0, end=10**6, width=inner)
        for widget, name in ((self.fit, "fit"), (self.split, "split"), (self.seed, "fit_seed")):
            widget.param.watch(lambda event, name=name: self.chosen(name, event.new), "value")
        self.view = pn.Card(
            self.fit, self.split, self.seed, title="More choices", collapsed=True, width=width, margin=(5, 10)
        )

    def refresh(self) -> None:
        """Shows the session as it is."""
        question, busy = self.session.question, self.session.busy
        with self.shown():
            self.fit.param.update(value=question.fit, disabled=busy)
            self.split.param.update(value=question.split, disabled=busy or self.session.few_states)
            self.seed.param.update(value=question.fit_seed, disabled=busy)


def _turned(options: dict[str, str]) -> dict[str, str]:
    """By what the reader sees."""
    return {text: key for key, text in options.items()}


WIDTH = 286
DOING = {"check": "Reading the file", "convert": "Making the table", "train": "Fitting", "discover": "Searching"}
DOING |= {
    "asks": "Reading the questions",
    "predict": "Filling in the blanks",
    "plan": "Planning",
    "rubber": "Fitting the rubber",
    "tests": "Reading the tests",
    "compare": "Setting them side by side",
    "study": "Studying",
}


class Steps(Part):
    """What can be chosen and started."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        wide = {"width": WIDTH - 24}
        self.given = Given(session, WIDTH - 24)
        self.model = pn.widgets.Select(name="model", options=models(), **wide)
        self.train = pn.widgets.Select(name="training set", options=[], **wide)
        self.further = AdvancedOptions(session, WIDTH - 24)
        self.per_sample = Tick("each sample has its own mounting", WIDTH - 24, lambda on: self.chosen("per_sample", on))
        self.effects = words()
        self.fit = pn.widgets.Button(name="Fit", button_type="primary", **wide)
        self.find = pn.widgets.Button(name="Find what is missing", button_type="primary", **wide)
        self.cancel = pn.widgets.Button(name="Cancel", visible=False, **wide)
        self.bar = pn.indicators.Progress(value=-1, max=100, visible=False, height=20, **wide)
        self.doing = words()
        self.report = download("Report", WIDTH - 24, "report.html")
        self.checkpoint = download("Fitted model", WIDTH - 24, "checkpoint.ckpt")
        self.search_report = download("Report of the search", WIDTH - 24, "report.html")
        self.take = pn.Column(heading("Take it with you"), self.report, self.checkpoint, self.search_report)
        self._watch()
        self.view = pn.Column(
            heading("1  Data"), self.given.view,
            heading("2  Model"), self.model, self.train, self.per_sample.view, self.further.view,
            heading("3  Fit, and see where it fails"), self.effects, self.fit,
            heading("4  See what is missing"), self.find,
            self.cancel, self.bar, self.doing, self.take,
            width=WIDTH,
        )  # fmt: skip

    def _watch(self) -> None:
        for widget, name in ((self.model, "model"), (self.train, "train")):
            widget.param.watch(lambda event, name=name: self.chosen(name, event.new), "value")
        self.fit.on_click(lambda _: self.session.start("train"))
        self.find.on_click(lambda _: self.session.start("discover"))
        self.cancel.on_click(lambda _: self.session.cancel())

    def refresh(self) -> None:
        """Shows the session as it is."""
        with self.shown():
            self._refresh()

    def _refresh(self) -> None:
        question, busy = self.session.question, self.session.busy
        self.given.refresh()
        self.model.param.update(value=question.model, disabled=busy)
        sets = self.session.sets
        self.train.param.update(options=sets, value=question.train if sets else None, disabled=busy or not sets)
        self.further.refresh()
        self.per_sample.show(question.per_sample, visible=self._several(), disabled=busy)
        chosen = "with " + " + ".join(question.effects) if question.effects else "no effect added"
        say(self.effects, [chosen, *self._hints()], "quiet")
        self.fit.disabled = self.find.disabled = not self.session.ready
        self._refresh_job()
        self._refresh_take()

    def _hints(self) -> list[str]:
        """Why there can be no fit yet, or what is particular about it."""
        if not self.session.sets:
            return ["The fit waits for data."]
        if self.session.doubted:
            return ["The fit waits until you have looked at the units above."]
        if self.session.few_states:
            return [
                "The training set has too few kinematic states to hold some of them out: it is tested on single rows."
            ]
        return []

    def _several(self) -> bool:
        """Whether the training set may hold more than one sample."""
        samples = self.session.table.get("samples", 1) if self.session.question.measured else 2
        return samples > 1 and not self.session.question.train.startswith("sample")

    def _refresh_job(self) -> None:
        job = self.session.job
        running = self.session.busy
        self.cancel.visible = self.bar.visible = running
        if job is None:
            say(self.doing, [])
        elif running:
            self.bar.value = -1 if job.share is None else max(1, min(100, round(100 * job.share)))
            say(self.doing, [f"{DOING[job.kind]}: {job.text}"], "quiet")
        else:
            ended = {"done": "done", "canceled": "canceled", "failed": job.text}[job.status]
            say(self.doing, [f"{DOING[job.kind]}: {ended}"], "bad" if job.status == "failed" else "quiet")

    def _refresh_take(self) -> None:
        runs, search = self.session.comparable(), self.session.search
        # Of other data than those that are chosen now.
        search = search if search and self.session.question.same_data(search["question"]) else None
        self.take.visible = bool(runs) or search is not None
        last = runs[-1] if runs else None
        for button, run in ((self.report, last), (self.checkpoint, last), (self.search_report, search)):
            button.visible = run is not None
            if run is not None:
                button.file = str(self.session.folder / run["folder"] / button.filename)
