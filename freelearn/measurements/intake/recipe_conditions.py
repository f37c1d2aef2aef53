"""The conditions of a recipe: which cells rows must have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from freelearn.measurements.intake.recipe import Condition, Test
from freelearn.measurements.intake.section import Section, is_number

TEST_KEYS = ("is", "is_not", "below", "above", "blank")


def condition_of(section: Section) -> Condition:
    """Column → test; empty conditions are mistakes."""
    if not section.content:
        section.say("is empty: write column: value")
    return {name: _test(value, section, name) for name, value in section.items()}


def _test(value: Any, section: Section, name: str) -> Test:
    if value == "blank" or value is None:
        return Test(blank=True)
    if isinstance(value, dict):
        inner = section.section(name)
        inner.only(TEST_KEYS)
        if not inner.content:
            inner.say(f"tests nothing: write one of {', '.join(TEST_KEYS)}")
        below, above = inner.number("below"), inner.number("above")
        return Test(_cells(inner, "is"), _cells(inner, "is_not"), below, above, inner.switch("blank"))
    return Test(is_=_cells(section, name))


def _cells(section: Section, key: str) -> tuple[str | float, ...]:
    value = section.content.get(key)
    several = value if isinstance(value, list) else [] if value is None else [value]
    if not all(isinstance(one, str) or is_number(one) for one in several):
        section.say(f"is {value!r}: write texts or numbers", key)
        return ()
    return tuple(one if isinstance(one, str) else float(one) for one in several)


def conditions_of(section: Section, key: str) -> tuple[Condition, ...]:
    """One condition or a list of them."""
    value = section.content.get(key)
    if isinstance(value, Mapping):
        return (condition_of(section.section(key)),)
    return tuple(condition_of(one) for one in section.sections(key))
