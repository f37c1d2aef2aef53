"""Units as exponents of length, force and time, and a change of all three."""

from __future__ import annotations

import re

from freelearn.measurements.recording import Recording
from freelearn.measurements.states import States

# Exponents of length, force and time.
UNITS = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "K": (0, 0, 0),
    "m": (1, 0, 0),
    "s": (0, 0, 1),
    "Hz": (0, 0, -1),
    "N": (0, 1, 0),
    "J": (1, 1, 0),
    "Pa": (-2, 1, 0),
}
# New sizes of the units: lengths come out this many times as large, forces, times.
SIZES = (1.7, 0.6, 2.3)


def factor(unit: str) -> float:
    """How many times as large a number in this unit becomes with SIZES.

    A unit is a product and at most one quotient of UNITS, with exponents: N·m/rad, rad/(N·m), N/m², 1/s.

    >>> factor("N·m/rad") == 1.7 * 0.6
    True

    Raises AssertionError for what is none.
    """
    above, _, below = unit.partition("/")
    value = 1.0
    for side, sign in ((above, 1), (below.strip("()"), -1)):
        for part in filter(None, side.split("·")):
            match = re.fullmatch(r"([A-Za-z1]+?)(⁻?[²³¹])?", part)
            assert match, f"{unit!r} is no unit that can be changed: use {', '.join(UNITS)}"
            assert match[1] in UNITS, f"{match[1]!r} in {unit!r} is no unit that can be changed: use {', '.join(UNITS)}"
            power = sign * _power(match[2] or "")
            for size, exponent in zip(SIZES, UNITS[match[1]], strict=True):
                value *= size ** (exponent * power)
    return value


def _power(text: str) -> int:
    size = {"": 1, "¹": 1, "²": 2, "³": 3}[text.lstrip("⁻")]
    return -size if text.startswith("⁻") else size


def rescaled(states: States) -> States:
    """The same states in the new units."""
    length, pressure, time = factor("m"), factor("Pa"), factor("s")
    lengths = ("reference_length", "inner_radius", "outer_radius", "length", "moved_length")
    changed = {name: length * getattr(states, name) for name in lengths}
    changed |= {"pressure": pressure * states.pressure, "clock": time * states.clock, "dwell": time * states.dwell}
    other = states.replace(**changed)
    if states.recording is None:
        return other
    whole = states.recording
    return other.replace(recording=Recording(rescaled(whole.states), whole.run, time * whole.time))
