"""How numbers and names stand in cells and sentences: true minus signs, a dash for what is not known."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

DASH = "–"
# Beyond this an error, a fraction, is that of a model that has run away: how large it is tells nothing.
RUN_AWAY = 10.0
MINUS = "−"


def chance(value: float, digits: int = 2) -> str:
    """A probability; of one that nobody can tell from none, how little it is at most.

    >>> chance(0.0432), chance(3e-120), chance(0.0)
    ('0.043', '< 1e-16', '< 1e-16')
    """
    return "< 1e-16" if value < 1e-16 else number(value, digits)


def number(value: float | None, digits: int = 5) -> str:
    """A number with so many significant digits; a dash where there is none.

    >>> number(-0.00123456, 3), number(-2e-6), number(None), number(float("nan"))
    ('−0.00123', '−2e−06', '–', '–')
    """
    return _finished(value, f".{digits}g")


def in_words(value: float, digits: int = 3) -> str:
    """A number in a sentence: below a million without a power of ten.

    >>> in_words(1174.6), in_words(137.2, 2), in_words(-0.01234), in_words(2.46e7)
    ('1170', '140', '−0.0123', '2.46e+07')
    """
    if 1 <= abs(value) < 1e6:
        return _finished(float(f"{value:.{digits}g}"), f".{max(digits, 6)}g")
    return number(value, digits)


def fixed(value: float | None, digits: int) -> str:
    """A number with so many digits behind the point; a dash where there is none.

    >>> fixed(-2.345, 1), fixed(None, 1)
    ('−2.3', '–')
    """
    return _finished(value, f".{digits}f")


def signed(value: float | None, digits: int = 3) -> str:
    """A number that always shows its sign.

    >>> signed(1.25), signed(-4.0)
    ('+1.25', '−4')
    """
    return _finished(value, f"+.{digits}g")


def percent(value: float | None, digits: int = 2) -> str:
    """A fraction in %, without the sign; a dash where there is none.

    >>> percent(0.01234), percent(None)
    ('1.23', '–')
    """
    return fixed(None if value is None else 100 * value, digits)


def error_percent(value: float | None, digits: int = 2) -> str:
    """An error E, a fraction, in %, without the sign; of a model that has run away no more than that.

    >>> error_percent(0.01234), error_percent(7665.21), error_percent(None)
    ('1.23', '> 1000', '–')
    """
    return f"> {100 * RUN_AWAY:.0f}" if value is not None and RUN_AWAY < value < math.inf else percent(value, digits)


def short_error(value: float) -> str:
    """The same with three significant digits.

    >>> short_error(0.0038912), short_error(7665.21)
    ('0.389', '> 1000')
    """
    return error_percent(value) if value > RUN_AWAY else number(100 * value, 3)


def error_in_words(value: float) -> str:
    """The same in a sentence.

    >>> error_in_words(0.0038912), error_in_words(7665.21)
    ('0.389 %', '> 1000 %')
    """
    return f"{short_error(value)} %"


def known_floor(floor: float | None) -> float | None:
    """The error that measuring alone leaves, a fraction; None where it is not known, or where the accuracy is so coarse
    that the readings would say nothing.

    >>> known_floor(0.008), known_floor(2.01), known_floor(None)
    (0.008, None, None)
    """
    return floor if floor is not None and floor < 1 else None


def sentence(text: str) -> str:
    """Words as a sentence of their own. A name at its beginning stays as it is.

    >>> sentence("force is too high")
    'Force is too high.'
    >>> sentence("force_gain.gain is at its bound")
    'force_gain.gain is at its bound.'
    >>> sentence("has it an end already?"), sentence("it has.")
    ('Has it an end already?', 'It has.')
    """
    name = "_" in text.split(" ")[0]
    return f"{text if name else text[0].upper() + text[1:]}{'' if text.endswith(('.', '!', '?')) else '.'}"


def listed(names: Sequence[str]) -> str:
    """Names in a sentence.

    >>> listed(["a"]), listed(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def true_minus(text: str) -> str:
    """Words with minus signs before their numbers where hyphens stood; dates, names and versions keep theirs.

    >>> true_minus("-3 mm at (-60°) and 1e-05, on 2026-01-02 in run-7.csv")
    '−3 mm at (−60°) and 1e−05, on 2026-01-02 in run-7.csv'
    """
    return re.sub(r"(?<![^\s(\[±…])-(?=[\d.])|(?<=\de)-(?=\d)", MINUS, text)


def ascii_minus(text: str) -> str:
    """Text for files that other programs read: hyphens where minus signs stand.

    >>> ascii_minus("−1.5")
    '-1.5'
    """
    return text.replace(MINUS, "-")


def finite(value: float) -> float | None:
    """A number for a JSON file, which knows neither NaN nor infinity: null in their place.

    >>> finite(0.5), finite(float("nan"))
    (0.5, None)
    """
    return float(value) if math.isfinite(value) else None


def all_finite(value: Any) -> Any:
    """Nested dictionaries and lists for a JSON file: as `finite`, and lists for tuples.

    >>> all_finite({"E": (0.5, float("nan"))})
    {'E': [0.5, None]}
    """
    if isinstance(value, dict):
        return {k: all_finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [all_finite(v) for v in value]
    return finite(value) if isinstance(value, float) else value


def _finished(value: float | None, form: str) -> str:
    if value is None or not math.isfinite(value):
        return DASH
    return format(value, form).replace("-", MINUS)
