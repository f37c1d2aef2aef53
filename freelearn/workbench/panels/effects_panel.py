"""Which effects would explain the misfit, and which of them the model has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
import panel as pn

from freelearn.common.formats import chance, error_in_words
from freelearn.discovery.residuals.residual_summary import NO_HINT
from freelearn.discovery.search.next_states import NextState
from freelearn.physics.effects.registry import EFFECTS
from freelearn.report.tables.discovery_tables import next_state_lines
from freelearn.report.tables.ranking_tables import ranking_numbers
from freelearn.workbench.panels.widgets import Part, heading, say, words
from freelearn.workbench.state.fitted import of_run
from freelearn.workbench.state.question import as_on_the_page
from freelearn.workbench.state.session import Session

MOST_STATES = 3
NOWHERE = "No region stands out."
# Of effects of the history a search of other tables says nothing.
ONLY_LOGS = "only a log tells of them, a table with time_s and run"
# Reasons are long: they go on below.
WRAPPED = "label { white-space: normal; overflow-wrap: anywhere; } .bk-input-group { flex-wrap: nowrap; }"


class Effects(Part):
    """Where the latest fit fails, what the search says, and boxes to tick."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.where, self.hints = words(), words()
        self.ranking = pn.widgets.Select(name="ranking of what may be missing", options={}, visible=False, width=300)
        self.ranking.param.watch(lambda _: self._relabel(), "value")
        self.boxes = pn.widgets.CheckBoxGroup(
            name="effects in the model", options={}, inline=False, sizing_mode="stretch_width",
            stylesheets=[WRAPPED],
        )  # fmt: skip
        self.absent = pn.widgets.CheckBoxGroup(name="known to be absent", options=[], inline=False)
        self.boxes.param.watch(self._ticked, "value")
        self.absent.param.watch(lambda event: self.chosen("ruled_out", tuple(event.new)), "value")
        wide = {"sizing_mode": "stretch_width"}
        title = "Known to be absent: not tried by the search"
        absent = pn.Card(self.absent, title=title, collapsed=True, **wide)
        self.reasons = words()
        self.untold = pn.Card(
            self.reasons, title="Of these the rows cannot tell", collapsed=True, visible=False, **wide
        )
        self.failures = pn.Column(heading("Where it fails, worst first"), self.where, **wide)
        self.view = pn.Column(
            heading("What is missing"), self.hints, self.ranking, self.boxes, self.untold, absent, **wide
        )

    def _ticked(self, event: Any) -> None:
        if not self.refreshing:
            kept = tuple(name for name in self.session.question.ruled_out if name not in event.new)
            self.session.choose(effects=tuple(event.new), ruled_out=kept)

    def refresh(self) -> None:
        """Shows the session as it is."""
        runs, search = self.session.comparable(), self.session.discovery()
        about = self.session.about(runs[-1]) if runs else {}
        lines = about.get("failures", [])
        own = search if runs and self.session.adopted(runs[-1]) else None
        none = _nowhere(own) if runs else "Nothing fitted yet."
        none = "It errs by no more than measuring alone does." if about.get("as_good_as_noise") else none
        say(self.where, [f"• {line}" for line in lines] or [none], "" if lines else "quiet")
        self._rankings(search)
        told, untold = self._testable(search)
        options = self._labels(search, told)
        reasons = _untestable(untold, chosen=set(options.values())) if runs or search else []
        say(self.reasons, reasons)
        self.untold.visible = bool(reasons)
        self._hinted(search)
        chosen = [e for e in self.session.question.effects if e in options.values()]
        # What is in the model is not absent.
        question = self.session.question
        others = sorted({*told, *question.ruled_out} - {*question.effects})
        absent = [name for name in question.ruled_out if name in others]
        with self.shown():
            self.boxes.param.update(options=options, value=chosen, disabled=self.session.busy)
            self.absent.param.update(options=others, value=absent, disabled=self.session.busy)

    def _rankings(self, search: dict[str, Any] | None) -> None:
        """One ranking for each step of the search: of what might be added to what it had by then."""
        steps = {_before(search["trail"], number): number for number in _ranked_steps(search)} if search else {}
        value = self.ranking.value if self.ranking.value in steps.values() else next(iter(steps.values()), None)
        with self.shown():
            self.ranking.param.update(options=steps, value=value, visible=len(steps) > 1)

    def _relabel(self) -> None:
        if not self.refreshing:
            self.refresh()

    def _hinted(self, search: dict[str, Any] | None) -> None:
        if not search:
            say(self.hints, ["Tick effects by hand and fit again, or let the search rank them."], "quiet")
            return
        hints = [f"{s['name']}: {s['says']}" for s in search["screens"]]
        hints += [f"cannot be told apart: {', '.join(c)}" for c in search["classes"] if len(c) > 1]
        hints += next_state_lines([NextState(**p) for p in search["next_experiment"]], MOST_STATES)
        if search["remainder"] and search["remainder"]["hint"] != NO_HINT:
            hints.append(f"remaining misfit, a hint only: {search['remainder']['hint']}")
        say(self.hints, [as_on_the_page(hint) for hint in (*hints, *search["notes"])])

    @property
    def step(self) -> int:
        """The step of the search whose ranking is shown."""
        return int(self.ranking.value or 0)

    def _testable(self, search: dict[str, Any] | None) -> tuple[Sequence[str], Mapping[str, str]]:
        """The effects that the rows can tell of, and why not of others: as the search says, or as it would."""
        runs = self.session.comparable()
        if search:
            here = [c for c in search["candidates"] if c["step"] in (None, self.step)]
            return [c["effect"] for c in here if c["status"] == "tested"], {c["effect"]: c["reason"] for c in here}
        return of_run(self.session, runs[-1]).testable if runs else (_told(self.session.question.bed), {})

    def _labels(self, search: dict[str, Any] | None, told: Sequence[str]) -> dict[str, str]:
        """Every effect by what its box says: when to suspect it, or after a search the evidence. told: those that the
        rows can tell of."""
        if search:
            known = _ranked(search, self.step)
        else:
            chosen = [name for name in self.session.question.effects if name in EFFECTS]
            known = {_hint(name): name for name in sorted({*told, *chosen})}
        added = self.session.added.items()
        own = {f"{name}: written by a search, {about['formula']}": name for name, about in added}
        return {label: name for label, name in own.items() if name not in known.values()} | known


def _nowhere(search: dict[str, Any] | None) -> str:
    """What it means that the model of a search fails nowhere."""
    verdict = search["verdict"] if search else "unexplained"
    return {"unexplained": NOWHERE, "undecided": "Whether anything is left these rows cannot tell."}.get(
        verdict, "Nothing systematic is left."
    )


def _told(bed: str) -> list[str]:
    """The effects that this bed can tell of."""
    return [name for name in sorted(EFFECTS) if EFFECTS[name].untold(bed) is None]


def _hint(name: str) -> str:
    suspect = EFFECTS[name].suspect
    return f"{name}: {suspect}" if suspect else name


def _ranked_steps(search: dict[str, Any]) -> list[int]:
    """Steps at which anything was ranked."""
    last = len(search["trail"]) - 1
    return [number for number in range(last + 1) if len(ranking_numbers(search["candidates"], number))] or [0]


def _before(trail: Sequence[dict[str, Any]], number: int) -> str:
    effects = trail[number]["effects"]
    return f"with {' + '.join(effects)}" if effects else "before any was added"


def _ranked(search: dict[str, Any], step: int) -> dict[str, str]:
    """Every effect by the evidence for it at one step, and by when to suspect it."""
    labels = {}
    for row in ranking_numbers(search["candidates"], step).itertuples():
        error = "" if pd.isna(row.E_heldout) else f", E held-out {error_in_words(row.E_heldout)}"
        suspect = EFFECTS[row.effect].suspect if row.effect in EFFECTS else ""
        evidence = f"{row.effect}: effect size {row.size:.1f}, p by chance {chance(row.p_value)}{error}"
        labels[f"{evidence}. {suspect}".rstrip(". ")] = row.effect
    for name in search["trail"][step]["effects"]:
        labels.setdefault(f"{name}: in the model", name)
    for name in search["given_effects"]:
        if name not in search["trail"][step]["effects"]:
            labels[f"{name}: in the model from the start"] = name
    for c in search["candidates"]:
        failed = c["step"] in (None, step) and c["status"] == "failed"
        if failed and c["effect"] not in labels.values():
            labels[f"{c['effect']}: {c['status']}, {c['reason']}"] = c["effect"]
    return labels


def _untestable(reasons: Mapping[str, str], chosen: set[str]) -> list[str]:
    """Why the rows cannot tell of the effects that are not among those chosen; each reason once."""
    alike: dict[str, list[str]] = {}
    for name in sorted({*EFFECTS, *reasons} - chosen):
        alike.setdefault(reasons.get(name, _unsaid(name)), []).append(name)
    return [f"{', '.join(names)}: {reason}" for reason, names in alike.items()]


def _unsaid(name: str) -> str:
    return ONLY_LOGS if EFFECTS[name].port == "history" else "no candidate of this table"
