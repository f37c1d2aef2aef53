"""Reading a recipe (YAML): plain values only, each key once; nothing in it is executed."""

from __future__ import annotations

import re
from collections.abc import Hashable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import yaml

from freelearn.errors import UserError
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.intake.recipe_parse import parse_recipe
from freelearn.measurements.text_file import read_text

# A recipe is a page of text.
LARGEST = 200_000


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """Plain values; a key that stands twice and names for repeated parts (& and *) are errors."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for place, (key, (at, _)) in enumerate(zip(keys, node.value, strict=True)):
            if not isinstance(key, Hashable):
                raise yaml.MarkedYAMLError(problem="a key must be a word or a number", problem_mark=at.start_mark)
            if key in keys[:place]:
                raise yaml.MarkedYAMLError(problem=f"key {key!r} stands twice: keep one", problem_mark=at.start_mark)
        return dict(super().construct_mapping(node, deep))

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.MarkedYAMLError(problem="* stands for a part named with &: write it out", problem_mark=mark)
        return super().compose_node(parent, index)


# Dates, times of day such as 12:30 and words such as on or no stay texts: columns are called so. 1e-3 is a number.
_Loader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?\d+", list("-+0123456789")),
    ("float", r"[-+]?(\d+\.\d*|\.\d+|\d+)([eE][-+]?\d+)?|[-+]?\.inf|\.nan", list("-+0123456789.")),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), _first)


def read_recipe(path: str | Path) -> Recipe:
    """The recipe in a file. Raises UserError with every mistake in it."""
    return recipe_of(recipe_text(path), str(path))


def recipe_text(path: str | Path) -> str:
    """A recipe's text. Raises UserError where there is none, or far too much."""
    file = Path(path)
    if file.parent.is_dir() and not file.exists():
        names = [f.name for f in file.parent.iterdir() if f.suffix in (".yaml", ".yml")]
        near = get_close_matches(file.name, names, n=1, cutoff=0.4)
        raise UserError(f"There is no recipe {path}{f': did you mean {near[0]}?' if near else '.'}")
    text = read_text(path)
    if len(text) > LARGEST:
        raise UserError(f"{path} is too long for a recipe: look whether it is the data instead.")
    return text


def recipe_of(text: str, name: str) -> Recipe:
    """The recipe in a text. name: for messages. Raises UserError with every mistake in it."""
    return parse_recipe(content_of(text, name), name)


def content_of(text: str, name: str) -> dict[str, Any]:
    """The plain values in a recipe's text. name: for messages. Raises UserError."""
    try:
        content = yaml.load(text, _Loader)  # A safe loader, with less.
    except yaml.constructor.ConstructorError as problem:
        raise UserError(
            f"{name}{_line(problem)}: {problem.problem}: a recipe holds plain values, no tags (!…)."
        ) from None
    except yaml.MarkedYAMLError as problem:
        raise UserError(f"{name}{_line(problem)}: {problem.problem or 'is no YAML'}.") from None
    except (yaml.YAMLError, RecursionError, ValueError) as problem:
        raise UserError(f"{name} is no YAML: {str(problem).splitlines()[0]}.") from None
    if not isinstance(content, dict):
        raise UserError(f"{name} is no recipe: write bed:, columns: and constants:, or let intake draft one.")
    return content


def _line(problem: yaml.MarkedYAMLError) -> str:
    return f", line {problem.problem_mark.line + 1}" if problem.problem_mark else ""
