"""A recipe as text to read and edit: plain values with remarks behind them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

# Sections of which each entry has a line of its own; of the others all of it stands on one.
BLOCKS = ("constants", "columns", "samples", "design", "members", "join", "tests")
# A list that may be long, each entry on a line.
LINES = ("files",)

Path = tuple[str | int, ...]


def recipe_lines(content: Mapping[str, Any], remarks: Mapping[Path, str]) -> Iterator[str]:
    """The lines of the recipe. remarks: by the path of what they stand behind; TODO: what is left to be filled in."""
    for key, value in content.items():
        yield from _entry(key, value, (key,), remarks)


def _entry(key: str, value: Any, path: Path, remarks: Mapping[Path, str]) -> Iterator[str]:
    pad = "  " * (len(path) - 1)
    remark = f"   # {remarks[path]}" if path in remarks else ""
    block = path[-1] in BLOCKS and value
    if block and isinstance(value, Mapping):
        yield f"{pad}{key}:{remark}"
        for name, inner in value.items():
            yield from _entry(str(name), inner, (*path, name), remarks)
    elif block and isinstance(value, list):
        yield f"{pad}{key}:{remark}"
        for number, one in enumerate(value):
            for place, (name, inner) in enumerate(one.items()):
                told = remarks.get((*path, number, name))
                shown = _pair(name, inner) + (f"   # {told}" if told else "")
                yield f"{pad}  {'-' if not place else ' '} {shown}"
    elif path == LINES and value:
        yield f"{pad}{key}:{remark}"
        yield from (f"{pad}  - {flow(one)}" for one in value)
    else:
        yield f"{pad}{_pair(quoted(key) if path[0] in ('slack', 'drop') else key, value)}{remark}"


def _pair(key: str, value: Any) -> str:
    shown = flow(value)
    return f"{key}: {shown}" if shown else f"{key}:"


def flow(value: Any) -> str:
    """A value on one line; nothing for what is left blank.

    >>> flow({"from": "Kraft [N]", "unit": None, "sign": -1})
    '{from: "Kraft [N]", unit: , sign: -1}'
    """
    if value is None:
        return ""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)}: {flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    return quoted(value) if isinstance(value, str) else str(value)


def _key(key: Any) -> str:
    return quoted(key) if isinstance(key, str) else str(key)


def quoted(text: str) -> str:
    """A text as YAML takes it for one."""
    plain_word = text.replace("_", "").isalnum() and text.isascii() and not text[:1].isdigit()
    words = {"null", "true", "false", "yes", "no", "on", "off"}
    return text if plain_word and text.lower() not in words else _escaped(json.dumps(text, ensure_ascii=False))


def _escaped(text: str) -> str:
    """Characters that no YAML may hold, as their numbers."""
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)
