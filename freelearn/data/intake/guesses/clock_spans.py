"""When the clocks of a file run: in which unit, and how far apart those that have no common start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from freelearn.data.intake.guesses.guessed import Clock, ColumnGuess, Guess
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.readers.stamps import seconds_of

# Units that a clock without one may have, and the share of the longer recording in which both then run.
UNITS, OVERLAP = ("s", "ms", "min"), 0.5
# Question → answer.
Answers = Mapping[str, str | float]


@dataclass(frozen=True)
class Spans:
    """From when to when two clocks run [s]."""

    lead: tuple[float, float]
    other: tuple[float, float]

    @property
    def apart(self) -> bool:
        """Whether they have no time in common."""
        return self.other[1] < self.lead[0] or self.other[0] > self.lead[1]


def spans(lead: ColumnGuess, other: ColumnGuess, answers: Answers) -> Spans | None:
    """When two clocks run; None where a unit is not known, or one of them says dates."""
    units = [str(answers.get(f"unit.{c.name}", c.unit)) for c in (lead, other)]
    if not all(units) or lead.dates or other.dates:
        return None
    factors = [conversion(unit, "s").factor for unit in units]
    return Spans((factors[0] * lead.low, factors[0] * lead.high), (factors[1] * other.low, factors[1] * other.high))


def likely_unit(found: Guess, other: ColumnGuess, answers: Answers) -> str | None:
    """The unit in which a clock without one runs as one with a unit does; None where none does, or several."""
    fitting = []
    known = {key: value for key, value in answers.items() if key != f"unit.{other.name}"}
    clocks = [found.named(clock.time) for clock in found.clocks if clock.time != other.name]
    for unit in UNITS:
        each = (spans(clock, replace(other, unit=unit), known) for clock in clocks)
        both = next((one for one in each if one is not None), None)
        if both is None:
            return None
        common = min(both.lead[1], both.other[1]) - max(both.lead[0], both.other[0])
        longest = max(both.lead[1] - both.lead[0], both.other[1] - both.other[0])
        fitting += [unit] if longest > 0 and common >= OVERLAP * longest else []
    return fitting[0] if len(fitting) == 1 else None


def shift_key(clock: Clock) -> str:
    """The key of the question how far a clock is behind the first."""
    return f"plus.{clock.time}"


def start_of(dates: ColumnGuess) -> float:
    """The whole second at which a clock of dates begins."""
    return float(math.floor(seconds_of(dates.example) or 0.0))


def shifted(lead: ColumnGuess, other: ColumnGuess, second: float) -> dict[str, float]:
    """What the recipe says of a clock beside a leading one. second: that are added to it; of one in dates, or beside
    one, that of the counted seconds at which the first date was."""
    if other.dates:
        return {"minus": (seconds_of(other.example) or 0.0) - second}
    if lead.dates:
        return {"plus": (seconds_of(lead.example) or 0.0) - start_of(lead) - second}
    return {"plus": second} if second else {}


def clock_open(lead: ColumnGuess, other: ColumnGuess, answers: Answers) -> str:
    """What is to be said of two clocks without a time in common; "" where nothing is."""
    if lead.dates != other.dates:
        dated, counted = (lead, other) if lead.dates else (other, lead)
        return (
            f"{dated.name!r} holds dates, from {dated.example} on, and {counted.name!r} counts seconds: say when these "
            f"begin, with minus: seconds since 1970 for {dated.name!r}"
        )
    both = spans(lead, other, answers)
    if both is None or not both.apart:
        return ""
    (start, end), (first, last) = both.lead, both.other
    return (
        f"{other.name!r} runs from {first:.10g} to {last:.10g} s, {lead.name!r} from {start:.10g} to {end:.10g} s: add "
        "plus: or minus: seconds, that they have a common start"
    )
