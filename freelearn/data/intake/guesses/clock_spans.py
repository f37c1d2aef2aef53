"""When the clocks of a file run: in which unit, and how far apart those that have no common start."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from freelearn.data.intake.guesses.guessed import Answers, Clock, ColumnGuess, Guess
from freelearn.data.intake.laboratory_units import conversion

# Units that a clock without one may have, and the share of the longer recording in which both then run.
UNITS, OVERLAP = ("s", "ms", "min"), 0.5
# More seconds are counted since 1970, or from another such day.
SINCE_1970 = 1e8


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


def origin_of(lead: ColumnGuess, answers: Answers) -> float:
    """The whole second from which the table counts: where a clock of dates, or of seconds since 1970, begins; 0 for one
    that counts from a beginning of its own, or in a unit that nobody has said."""
    if lead.dates:
        return float(math.floor(lead.began))
    unit = str(answers.get(f"unit.{lead.name}", lead.unit))
    begins = conversion(unit, "s").factor * lead.low if unit else 0.0
    return float(math.floor(begins)) if begins >= SINCE_1970 else 0.0


def shifted(lead: ColumnGuess, other: ColumnGuess, second: float | None, answers: Answers) -> dict[str, float]:
    """What the recipe says of a clock beside a leading one. second: that are added to it; of one in dates, or beside
    one, that of the counted seconds at which the first date was; None where nothing was said."""
    origin = origin_of(lead, answers)
    if lead.dates != other.dates and second is not None:
        return {"minus": other.began - second + origin} if other.dates else {"plus": lead.began - origin - second}
    both = {"plus": second} if second and not other.dates else {}
    return both | ({"minus": origin} if origin else {})


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
