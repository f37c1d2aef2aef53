"""A value with an error, as one types it: 1.2e6±0.2e6."""

from __future__ import annotations

import re

# ± needs quotes in Hydra's grammar, the others do not.
BETWEEN = re.compile(r"±|\+/-|\+-")


def plus_minus(text: str) -> tuple[float, float] | None:
    """Value and error; None where the text is none.

    >>> plus_minus("1.2e6±0.2e6"), plus_minus("1e6 +- 2e5"), plus_minus("soft")
    ((1200000.0, 200000.0), (1000000.0, 200000.0), None)
    """
    parts = BETWEEN.split(text)
    try:
        value, error = map(float, parts)
    except ValueError:
        return None
    return value, error


def quoted(word: str) -> str:
    """A word of the command line as Hydra takes it: every value with a ± in quotes.

    >>> quoted("model.C1=1e6±2e5,2e6±2e5"), quoted("train=sample3")
    ("model.C1='1e6±2e5','2e6±2e5'", 'train=sample3')
    """
    name, equals, value = word.partition("=")
    if "±" not in value or any(sign in value for sign in "'\"[{"):
        return word
    return f"{name}{equals}" + ",".join(f"'{part}'" for part in value.split(","))
