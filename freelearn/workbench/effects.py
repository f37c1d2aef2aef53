"""Which effects would explain the misfit, and which of them the model has."""

from __future__ import annotations

from typing import Any

import pandas as pd
import panel as pn

from freelearn.inference.next_experiment import NextState
from freelearn.models.effects.registry import EFFECTS
from freelearn.results.discovery_tables import next_state_lines
from freelearn.results.ranking import ranking_numbers
from freelearn.workbench.part import Part
from freelearn.workbench.phrases import as_on_the_page
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading, say, words

MOST_STATES = 3
# Reasons are long: they go on below.
WRAPPED = "label { white-space: normal; overflow-wrap: anywhere; } .bk-input-group { flex-wrap: nowrap; }"


class Effects(Part):
    """Where the latest fit fails, what the search says, and boxes to tick."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.where, self.verdict, self.hints = words(), words(), words()
        self.boxes = pn.widgets.CheckBoxGroup(
            name="effects in the model", options={}, inline=False, width=550, stylesheets=[WRAPPED]
        )
        self.use = pn.widgets.Button(
            name="Tick what was found, and fit", button_type="success", visible=False, width=260
        )
        self.absent = pn.widgets.CheckBoxGroup(name="known to be absent", options=[], inline=False)
        self.boxes.param.watch(self._ticked, "value")
        self.absent.param.watch(lambda event: self.chosen("ruled_out", tuple(event.new)), "value")
        self.use.on_click(lambda _: self._use())
        self.view = pn.Row(
            pn.Column(heading("Where it fails, worst first"), self.where, width=380),
            pn.Column(heading("What is missing"), self.verdict, self.use, self.hints, self.boxes,
                      pn.Card(self.absent, title="Known to be absent: not tried by the search", collapsed=True,
                              width=550),
                      width=570),
        )  # fmt: skip

    def _ticked(self, event: Any) -> None:
        if not self.refreshing:
            kept = tuple(name for name in self.session.question.ruled_out if name not in event.new)
            self.session.choose(effects=tuple(event.new), ruled_out=kept)

    def _use(self) -> None:
        search = self.session.discovery()
        if search and not self.session.busy:
            self.session.choose(effects=(*search["given_effects"], *search["effects"]))
            self.session.start("train")

    def refresh(self) -> None:
        """Shows the session as it is."""
        runs, search = self.session.comparable(), self.session.discovery()
        about = self.session.read(runs[-1], "results.json") if runs else None
        lines = [f["sentence"] for f in (about or {}).get("failures", [])]
        none = "No region stands out." if runs else "Nothing fitted yet."
        say(self.where, [f"• {line}" for line in lines] or [none], "" if lines else "quiet")
        options = self._labels(search)
        self._verdict(search, set(options.values()))
        chosen = [e for e in self.session.question.effects if e in options.values()]
        # What is in the model is not absent.
        question = self.session.question
        others = [name for name in _told(question.bed) if name not in question.effects]
        absent = [name for name in question.ruled_out if name in others]
        with self.shown():
            self.boxes.param.update(options=options, value=chosen, disabled=self.session.busy)
            self.absent.param.update(options=others, value=absent, disabled=self.session.busy)

    def _verdict(self, search: dict[str, Any] | None, known: set[str]) -> None:
        wanted = [*search["given_effects"], *search["effects"]] if search else []
        # What the search wrote is not known before it is added.
        self.use.visible = bool(wanted) and set(wanted) <= known and set(wanted) != set(self.session.question.effects)
        self.use.disabled = self.session.busy
        if not search:
            say(self.verdict, ["Tick effects by hand, or let the search rank them."], "quiet")
            say(self.hints, [])
            return
        say(self.verdict, [search["says"]], "good")
        hints = [f"{s['name']}: {s['says']}" for s in search["screens"]]
        hints += [f"cannot be told apart: {', '.join(c)}" for c in search["classes"] if len(c) > 1]
        hints += next_state_lines([NextState(**p) for p in search["next_experiment"]], MOST_STATES)
        if search["remainder"]:
            hints.append(f"what is left, a hint only: {search['remainder']['hint']}")
        say(self.hints, [as_on_the_page(hint) for hint in (*hints, *search["notes"])])

    def _labels(self, search: dict[str, Any] | None) -> dict[str, str]:
        """Every effect by what its box says: when to suspect it, or after a search the evidence."""
        known = _ranked(search) if search else {_hint(name): name for name in _told(self.session.question.bed)}
        added = self.session.added.items()
        own = {f"{name}: written by a search, {about['formula']}": name for name, about in added}
        return {label: name for label, name in own.items() if name not in known.values()} | known


def _told(bed: str) -> list[str]:
    """The effects that this bed can tell of."""
    return [name for name in sorted(EFFECTS) if EFFECTS[name].untold(bed) is None]


def _hint(name: str) -> str:
    suspect = EFFECTS[name].suspect
    return f"{name}: {suspect}" if suspect else name


def _ranked(search: dict[str, Any]) -> dict[str, str]:
    labels = {}
    for row in ranking_numbers(search["candidates"]).itertuples():
        error = "" if pd.isna(row.E_heldout) else f", E held-out {100 * row.E_heldout:.3g} %"
        labels[f"{row.effect}: {row.size:.1f} σ, p by chance {row.p_value:.2g}{error}"] = row.effect
    for name in search["given_effects"]:
        labels.setdefault(f"{name}: in the model from the start", name)
    for c in search["candidates"]:
        if c["effect"] not in labels.values():
            labels[f"{c['effect']}: {c['status'].replace('_', ' ')}, {c['reason']}"] = c["effect"]
    for name in sorted(EFFECTS):
        if name not in labels.values():
            labels[name] = name
    return labels
