"""From a composed configuration to settings, or to one error with every mistake in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from freelearn.api.settings.settings import CsvData, DiscoverSettings, Settings, VirtualData
from freelearn.common.errors import UserError
from freelearn.common.files import missing_file
from freelearn.data.beds import BEDS, INFLATION
from freelearn.physics.effects.names import check_names

Chosen = TypeVar("Chosen", bound=Settings)
Anything = TypeVar("Anything")


def parse(kind: type[Chosen], config: Mapping[str, Any]) -> Chosen:
    """Settings from a composed configuration's plain values. Raises UserError with every mistake."""
    content = dict(config)
    if isinstance(content.get("exclude"), list):
        content["exclude"] = tuple(content["exclude"])
    elif "exclude" in content and content["exclude"] is None:
        content["exclude"] = ()
    settings = parsed(kind, content)
    check_names([*settings.effects, *(settings.ruled_out if isinstance(settings, DiscoverSettings) else ())])
    if isinstance(settings.data, VirtualData) and settings.data.accuracy is None:
        raise UserError("data.accuracy=estimate is for measured data: the simulated bed needs to know its noise.")
    if isinstance(settings.data, CsvData):
        _check_file(settings.data.path)
        if settings.data.members is not None:
            _check_file(settings.data.members)
        if settings.data.members is not None and BEDS[settings.data.bed] is INFLATION:
            raise UserError("data.bed=inflation measures the diameter of one actuator: leave data.members out.")
    return settings


def parsed(kind: type[Anything], config: Mapping[str, Any]) -> Anything:
    """Settings of a kind from plain values. Raises UserError with every mistake."""
    try:
        return TypeAdapter(kind).validate_python(dict(config))
    except ValidationError as problem:
        raise mistakes_error([_sentence(error) for error in problem.errors(include_url=False)]) from None


def mistakes_error(sentences: list[str]) -> UserError:
    """One error for all mistakes."""
    if len(sentences) == 1:
        return UserError(sentences[0])
    return UserError("\n  ".join([f"{len(sentences)} mistakes:", *sentences]))


def _check_file(path: Path) -> None:
    """A mistyped path is told before anything heavy is loaded; what else may be wrong with a file is for its reader."""
    if problem := missing_file(path):
        raise UserError(problem)


# Parts of an error's place that are ours and not the user's.
_INNER = {("data", "virtual"), ("data", "csv"), ("model", "values"), ("model", "errors")}

_WHAT = {
    "int_type": "is not an integer",
    "int_from_float": "is not an integer",
    "float_type": "is not a number",
    "finite_number": "is not a finite number",
    "bool_type": "is neither true nor false",
    "string_type": "is not a text",
    "missing": "is missing",
    "extra_forbidden": "is no option here",
    "unexpected_keyword_argument": "is no option here",
}
_LIMITS = {
    "greater_than_equal": ("ge", "is too small: choose at least {}"),
    "greater_than": ("gt", "is too small: choose more than {}"),
    "less_than_equal": ("le", "is too large: choose at most {}"),
    "less_than": ("lt", "is too large: choose less than {}"),
}


def _sentence(error: Any) -> str:
    """What is wrong and what to do, from one of pydantic's error records."""
    place = [str(part) for part in error["loc"]]
    shown = [part for i, part in enumerate(place) if i == 0 or (place[i - 1], part) not in _INNER]
    name, kind, value = ".".join(shown), error["type"], error["input"]
    if kind == "value_error":
        text = str(error["ctx"]["error"])
        return f"{text}." if text.startswith(("data=", "intake", name)) or not name else f"{name} = {value!r}: {text}."
    if kind in _LIMITS:
        limit, text = _LIMITS[kind]
        return f"{name} = {value!r} {text.format(format(error['ctx'][limit], '.12g'))}."
    if kind in ("missing", "extra_forbidden", "unexpected_keyword_argument"):
        return f"{name} {_WHAT[kind]}."
    if kind == "literal_error":
        return f"{name} = {value!r} is not possible: choose {error['ctx']['expected']}."
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return f"{name} is of no known kind: choose data=virtual or data=csv."
    said = _WHAT.get(kind, "is not possible: " + error["msg"])
    return f"{name} = {value!r} {said}."
