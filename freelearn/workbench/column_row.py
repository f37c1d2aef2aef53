"""One column of a laboratory's file on the page: an example, and what it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn
from markupsafe import escape

from freelearn.measurements.intake.doubt import NO, YES
from freelearn.measurements.intake.draft import Answers
from freelearn.measurements.intake.guessed import ColumnGuess
from freelearn.measurements.intake.meanings import MEANINGS, NOT_USED, UNITS
from freelearn.measurements.intake.questions import WHAT
from freelearn.measurements.intake.units import conversion, dimension
from freelearn.workbench.words import HIDDEN_LABEL, STYLE

TOLD: dict[str, str] = {NOT_USED: NOT_USED, **{meaning.words: name for name, meaning in MEANINGS.items()}}
SAY = "say which"
SIGNS = {"as it is": NO, "turned": YES}
# Of a force it is never taken for granted, but for a column with the table's own name.
SIGNS_OF_A_FORCE = {SAY: "", "a push is positive": NO, "a pull is positive": YES}


class ColumnRow:
    """guess: of the column. said: what it was said to be before, "" where nobody said. changed: called when something
    else is chosen."""

    def __init__(self, guess: ColumnGuess, said: str, changed: Callable[[], None]) -> None:
        self.guess, name = guess, guess.name
        self.about = pn.pane.HTML(_about(guess), stylesheets=[STYLE], width=330, margin=(4, 10))
        hidden = {"stylesheets": [HIDDEN_LABEL]}
        meaning = said or (guess.quantity if guess.chosen and guess.quantity else NOT_USED)
        self.quantity = pn.widgets.Select(name=f"what {name} is", options=TOLD, value=meaning, width=170, **hidden)
        self.unit = pn.widgets.Select(name=f"unit of {name}", options=[], width=100, **hidden)
        self.turned = pn.widgets.Select(name=f"sign of {name}", options=SIGNS, value=NO, width=150, **hidden)
        self.offset = pn.widgets.FloatInput(name=f"offset of {name}", value=0.0, width=130, **hidden)
        self.quantity.param.watch(lambda _: self._chosen(changed), "value")
        self.unit.param.watch(lambda _: changed(), "value")
        self._units()

    @property
    def cells(self) -> list[Any]:
        """What stands in the row."""
        return [self.about, self.quantity, self.unit, self.turned, self.offset]

    @property
    def answers(self) -> Answers:
        """What the row says; nothing of a unit or a sign that is still to be chosen."""
        name = self.guess.name
        said: dict[str, str | float] = {WHAT + name: self.quantity.value}
        if self.quantity.value == NOT_USED:
            return said
        said |= {f"unit.{name}": self.unit.value} if self.unit.value not in (None, SAY) else {}
        said |= {f"sign.{name}": self.turned.value} if self.turned.value else {}
        return said | ({f"offset.{name}": float(self.offset.value)} if self.offset.value else {})

    def _chosen(self, changed: Callable[[], None]) -> None:
        self._units()
        changed()

    def _units(self) -> None:
        meaning = MEANINGS.get(self.quantity.value)
        kind = meaning.kind if meaning else ""
        options, written = list(UNITS.get(kind, ())), self.guess.unit
        # A ratio may go without a unit; what else has none is asked for.
        value = None if not options else options[0] if kind == "ratio" else SAY
        if kind and written and dimension(written) == kind:
            value = next((option for option in options if _same(written, option)), written)
            options += [] if value in options else [written]
        elif kind and kind != "ratio":
            options = [SAY, *options]
        self.unit.param.update(options=options, value=value)
        asked = self.quantity.value == "force_n" != self.guess.name
        signs = SIGNS_OF_A_FORCE if asked else SIGNS
        if self.turned.options != signs:
            self.turned.param.update(options=signs, value=next(iter(signs.values())))
        for cell in (self.unit, self.turned, self.offset):
            cell.disabled = not kind


def _same(written: str, unit: str) -> bool:
    """Whether two spellings are one unit."""
    change = conversion(written, unit)
    return abs(change.factor - 1) < 1e-9 and abs(change.shift) < 1e-9


def _about(guess: ColumnGuess) -> str:
    """The column's name with its range or words, and what is not sure. Everything from the file is escaped."""
    if guess.numeric:
        shown = f"{guess.low:.4g} … {guess.high:.4g}, first {_short(guess.example)}"
    else:
        shown = ", ".join(guess.words[:4]) or guess.example or "blank"
    doubts = []
    if guess.chosen and MEANINGS[guess.quantity or ""].kind not in ("", "ratio"):
        doubts += [] if guess.unit else ["the heading says no unit"]
    if guess.chosen and guess.confidence != "sure":
        doubts.append(f"{guess.confidence}: check")
    doubt = f'<span class="bad"> {escape("; ".join(doubts))}</span>' if doubts else ""
    return f'<p><b>{escape(guess.name)}</b>{doubt}<br><span class="quiet">{escape(shown[:60])}</span></p>'


def _short(example: str) -> str:
    """A number with as many digits as one looks at; one with a decimal comma, say, as it is written."""
    try:
        return f"{float(example):.6g}"
    except ValueError:
        return example
