"""What should be known of a profile interval, in words."""

from __future__ import annotations

from collections.abc import Mapping

from freelearn.fitting.profile_end import End, Ending
from freelearn.models.parameter import Parameter

# A rise of less than this share of what an interval allows is none: the profile is flat.
FLAT = 1e-4
# Parameters that a sentence lists.
MOST_SHOWN = 8

# Of all intervals of a fit.
WEIGHTS = "Profile intervals are for physical parameters: a network's weights keep their normal ones."
NETWORK = "Profile intervals are about a least sum of squares, and a network's fit stops before it: these are normal."
EXACT = "The model fits these rows to the last digit, and a profile would show rounding: these are normal intervals."
SHARED = "Too few kinematic states tell how the readings scatter: these are normal intervals."
SEVERAL = "The profiles met one better fit after the other, so the fit is none to rely on: these are normal intervals."
# Of one.
UNTOLD = "these kinematic states do not tell its scatter"

# Endings that the rows tell.
_TOLD = {Ending.FOUND, Ending.LOST}


def beside(fitted: float, least: float, values: Mapping[str, float]) -> str:
    """That the fit ended a little above the minimum. fitted, least: sums of squares; values: at the minimum, in SI."""
    return f"{_elsewhere(fitted, least, values)}. The profile intervals are about that."


def elsewhere(fitted: float, least: float, values: Mapping[str, float]) -> str:
    """That the fit ended so far above the minimum that no interval is about it."""
    return f"{_elsewhere(fitted, least, values)}. Fit again, from there or by another fit: these are normal intervals."


def _elsewhere(fitted: float, least: float, values: Mapping[str, float]) -> str:
    shown = ", ".join(f"{name} = {value:.5g}" for name, value in list(values.items())[:MOST_SHOWN])
    shown += f" and {len(values) - MOST_SHOWN} more" if len(values) > MOST_SHOWN else ""
    return f"The fit ended at a sum of squares of {fitted:.6g}, but the least is {least:.6g}, at {shown}"


def kept(reason: str) -> str:
    """Why an interval is the normal one."""
    return f"{reason}, so this is the normal interval"


def stopped(which: str, value: float, unit: str) -> str:
    """That a search did not come to an end. which: upper or lower; value: how far it came."""
    return f"the search for its {which} end did not finish (it came to {quantity(value, unit)})"


def away(value: float, unit: str) -> str:
    """That the fit's value is outside the interval. value: at the minimum."""
    return f"the least sum of squares is far from the fit, at {quantity(value, unit)}"


def about(value: float, unit: str) -> str:
    """That the interval is about another value than the fit's. value: at the minimum."""
    return f"the interval is about {quantity(value, unit)}, where the sum of squares is least"


def interval_words(low: End, high: End, ends: tuple[float, float], spec: Parameter) -> str:
    """What should be known of an interval with these ends; "" where both were found. ends: in the parameter's unit."""
    if low.ending not in _TOLD and high.ending not in _TOLD:
        if max(low.rise, high.rise) < FLAT:
            return "the rows do not determine it: every value allowed fits equally well"
        return "the rows do not determine it: no value allowed fits clearly worse"
    said = []
    if low.ending is Ending.OPEN:
        said.append(f"only an upper limit is known: below {quantity(ends[1], spec.unit)}")
    if high.ending is Ending.OPEN:
        said.append(f"only a lower limit is known: above {quantity(ends[0], spec.unit)}")
    for end, value in zip((low, high), ends, strict=True):
        if end.ending is Ending.BOUND:
            said.append(f"its interval ends at the bound {quantity(value, spec.unit)}")
        if end.ending is Ending.LOST:
            said.append(f"its interval ends at {quantity(value, spec.unit)}, beyond which rows lose their prediction")
    return "; ".join(said)


def quantity(value: float, unit: str) -> str:
    """A value with its unit, which a pure number does not show.

    >>> quantity(32345.0, "Pa"), quantity(0.0, "1")
    ('3.23e+04 Pa', '0')
    """
    return f"{value:.3g}" if unit in ("", "1") else f"{value:.3g} {unit}"
