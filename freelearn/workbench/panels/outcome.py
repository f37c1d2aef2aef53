"""What came out, in one look: the verdict, the error step by step, the fitted parameters, and a sealed answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
import panel as pn

from freelearn.common.formats import error_in_words
from freelearn.records.estimates import Estimate, parameter_table
from freelearn.report.html.ranking_charts import StaircaseChart
from freelearn.report.tables.run_tables import beside as learned_beside
from freelearn.workbench.panels.widgets import GOOD, beside, say, table, wide, words
from freelearn.workbench.state.session import Session


class Answer:
    """A button that opens what was hidden, once a search has said what it thinks."""

    def __init__(self, session: Session) -> None:
        self.session, self.opened = session, ""
        self.open = pn.widgets.Button(name="Open the sealed answer", width=260)
        self.told = words()
        self.open.on_click(lambda _: self._open())
        self.view = pn.Column(self.open, self.told, visible=False)

    def refresh(self) -> None:
        """Shows the session as it is. What was opened is closed again for another search."""
        folder = self.session.search["folder"] if self.session.search else ""
        hidden = self.session.question.data == "hidden" and self.session.discovery() is not None
        self.view.visible = hidden
        self.open.visible = folder != self.opened
        if self.open.visible:
            say(self.told, [])

    def _open(self) -> None:
        assert self.session.search is not None
        self.opened = self.session.search["folder"]
        answer = self.session.read(self.session.search, "sealed_answer.json") or {}
        parts = [
            f"{name} ({', '.join(f'{key} = {value:.3g}' for key, value in values.items())})" if values else name
            for name, values in answer.get("hidden", {}).items()
        ]
        say(self.told, [f"Hidden was: {'; '.join(parts) or 'nothing'}. Values in SI units."], "quiet")
        self.open.visible = False


# Beside the staircase where there is room, else above it.
COLUMNS = "repeat(auto-fit, minmax(min(440px, 100%), 1fr))"

FOUND, LIKELIEST = "Add what was found", "Add what it is most probably"
OF_THE_SEARCH = (
    "Fits of the search: they weigh each reading by its noise, and each of the states of {rows} rows was left out in "
    "turn. A single fit is tested on its own test rows alone, so its error may differ."
)


class Outcome:
    """The top of what is shown once something is fitted."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.verdict, self.title, self.parameters = words(), words(), words()
        self.use = pn.widgets.Button(name=FOUND, button_type="success", stylesheets=[GOOD], visible=False, width=260)
        self.use.on_click(lambda _: session.adopt())
        self.answer = Answer(session)
        self.staircase = StaircaseChart(width=360, height=290, what="error where it was not fitted")
        said = pn.Column(
            self.verdict, self.use, self.answer.view, self.title, self.parameters, sizing_mode="stretch_width"
        )
        self.about_steps = words()
        steps = pn.Column(wide(self.staircase.panel), self.about_steps, sizing_mode="stretch_width")
        self.view = beside(said, steps, columns=COLUMNS)

    def refresh(self, drawn: bool) -> None:
        """Shows the session as it is; there is at least one run. drawn: whether the runs are those shown already."""
        search = self.session.discovery()
        say(self.verdict, [search["says"]] if search else [], "verdict")
        found = self.session.found()
        self.use.visible = bool(found) and set(found) != set(self.session.question.effects)
        # Of an undecided table nothing was found: it may be this.
        self.use.name = LIKELIEST if search and search["verdict"] == "undecided" else FOUND
        self.use.disabled = self.session.busy
        self.answer.refresh()
        if not drawn:
            self._title()
            self._parameters()
        self._staircase(search)

    def _title(self) -> None:
        run = self.session.comparable()[-1]
        question, about = run["question"], self.session.about(run)
        source = f"measured data, {question.name}" if question.measured else "simulated data"
        effects = " + ".join(["", *question.effects])
        text = f"{question.model}{effects}, fitted on {question.train} ({source})"
        if about["E"] is not None:
            text += f": {about['error']} E {error_in_words(about['E'])} {about['rows']}".rstrip()
            floor = about["noise_floor"]
            text += f"; measuring alone leaves {100 * floor:.2g} %" if floor else ""
        elif about["rows"]:
            text += f": the model answers too few rows to tell an error ({about['rows'].removeprefix('on ')})"
        say(self.title, [text], "good")

    def _parameters(self) -> None:
        about = self.session.about(self.session.comparable()[-1])
        entries: Mapping[str, Any] = about["parameters"]
        # A network's weights tell a reader nothing.
        known = [Estimate.from_plain(name, entry) for name, entry in entries.items() if entry.get("unit")]
        shown = parameter_table(known) if known else None
        if shown is not None:
            shown = replace(shown, caption="; ".join(filter(None, [shown.caption, learned_beside(about["learned"])])))
        table(self.parameters, shown)

    def _staircase(self, search: Mapping[str, Any] | None) -> None:
        runs = self.session.comparable()
        effects = runs[-1]["question"].effects
        # A model that the user has fitted since is no step of the search.
        own = search is not None and (self.session.adopted(runs[-1]) or effects == tuple(search["given_effects"]))
        say(self.about_steps, [OF_THE_SEARCH.format(rows=search.get("rows", "all"))] if search and own else [], "quiet")
        if search and own:
            steps = [
                {"step": _name(step["effect"], number), "E_heldout": step["E_heldout"],
                 "noise_floor": step["noise_floor"]}
                for number, step in enumerate(search["trail"])
            ]  # fmt: skip
        else:
            steps = self._fits()
        if steps:
            self.staircase.show(pd.DataFrame(steps).astype({"noise_floor": float}))

    def _fits(self) -> list[dict[str, Any]]:
        steps: list[dict[str, Any]] = []
        before: tuple[str, ...] = ()
        for run in self.session.comparable():
            effects, about = run["question"].effects, self.session.about(run)
            if about["E"] is not None:
                steps.append(
                    {"step": _changed(before, effects), "E_heldout": about["E"], "noise_floor": about["noise_floor"]}
                )
            before = effects
        return steps


def _name(effect: str | None, number: int) -> str:
    if effect is None:
        return "model alone" if number == 0 else "exchanged"
    return f"+ {effect}"


def _changed(before: Sequence[str], after: Sequence[str]) -> str:
    """What a fit has more or less than the one before it, short enough for an axis."""
    added, dropped = [e for e in after if e not in before], [e for e in before if e not in after]
    parts = [
        f"{sign} {names[0] if len(names) == 1 else f'{len(names)} effects'}"
        for sign, names in (("+", added), ("−", dropped))
        if names
    ]
    return " ".join(parts) or "model alone"
