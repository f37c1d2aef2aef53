"""A mapping of a recipe, read key by key; what is wrong is gathered, so that all of it is told at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from freelearn.common.errors import UserError

# Larger numbers are typing errors, and no floats. Integers beyond a billion neither number samples nor lines.
LARGEST, LARGEST_INTEGER = 1e300, 1_000_000_000


def refuse_mistakes(mistakes: Sequence[str], name: str) -> None:
    """Raises UserError with all of a recipe's mistakes, each once, where there are any. name: of its file."""
    if mistakes:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        raise UserError("\n  ".join([f"{name} has {count}:", *dict.fromkeys(mistakes)]))


class Section:
    """A mapping with its place in the recipe. mistakes: shared by all sections of a recipe; reading adds to it."""

    def __init__(self, content: Any, place: str, mistakes: list[str]) -> None:
        self.place, self.mistakes = place, mistakes
        self.content: Mapping[str, Any] = {}
        if isinstance(content, Mapping):
            self.content = {str(key): value for key, value in content.items()}
        elif content is not None:
            self.say(f"is {content!r}: write a mapping, name: value")

    def __contains__(self, key: str) -> bool:
        return self.content.get(key) is not None

    def say(self, problem: str, key: str = "") -> None:
        """Adds a mistake of this section, or of a key of it."""
        self.mistakes.append(f"{self.at(key) or 'the recipe'} {problem}.")

    def at(self, key: str) -> str:
        """The place of a key."""
        return f"{self.place}.{key}" if self.place and key else self.place or key

    def only(self, known: Sequence[str], what: str = "key") -> None:
        """Keys other than these are mistakes."""
        for key in self.content:
            if key not in known:
                near = get_close_matches(key, known, n=1, cutoff=0.6)
                hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
                self.say(f"is no {what} of a recipe ({hint})", key)

    def section(self, key: str) -> Section:
        """A mapping in it, empty where there is none."""
        return Section(self.content.get(key), self.at(key), self.mistakes)

    def sections(self, key: str) -> list[Section]:
        """The entries of a list, each a mapping; none where there is no list."""
        value = self.content.get(key)
        if value is None:
            return []
        if not isinstance(value, list) or not value:
            self.say("is no list: begin each entry with -", key)
            return []
        return [Section(one, f"{self.at(key)}[{i}]", self.mistakes) for i, one in enumerate(value, start=1)]

    def items(self) -> Iterator[tuple[str, Any]]:
        """Keys and values."""
        return iter(self.content.items())

    def number(self, key: str, default: float | None = None) -> float | None:
        """A finite number."""
        value = self.content.get(key)
        if value is None:
            if key in self.content:
                self.say("is blank: fill in a number", key)
            return default
        if is_number(value):
            return float(value)
        self.say(f"is {value!r}, not a number", key)
        return default

    def integer(self, key: str, least: int) -> int | None:
        """An integer, at least this large."""
        value = self.content.get(key)
        if value is None:
            return None
        if isinstance(value, int) and not isinstance(value, bool) and least <= value <= LARGEST_INTEGER:
            return value
        self.say(f"is {value!r}: write an integer from {least} up", key)
        return None

    def text(self, key: str, default: str = "") -> str:
        """A text; a number counts as one, for columns may be named so."""
        value = self.content.get(key, default)
        if isinstance(value, str | int | float) and not isinstance(value, bool):
            return str(value)
        if value is not None:
            self.say(f"is {value!r}, not a text", key)
        return default

    def switch(self, key: str) -> bool | None:
        """True, false or nothing."""
        value = self.content.get(key)
        if value is None or isinstance(value, bool):
            return value
        self.say(f"is {value!r}: write true or false", key)
        return None

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of texts; one text is a list of itself."""
        value = self.content.get(key)
        if value is None:
            return ()
        several = value if isinstance(value, list) else [value]
        if all(isinstance(one, str | int | float) and not isinstance(one, bool) for one in several):
            return tuple(map(str, several))
        self.say(f"is {value!r}: write a list of names", key)
        return ()

    def choice(self, key: str, known: Sequence[str], default: str) -> str:
        """One of some words."""
        value = self.content.get(key, default)
        if value in known:
            return str(value)
        near = get_close_matches(str(value), known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"choose {', '.join(known)}"
        self.say(f"is {value!r} ({hint})", key)
        return default


def is_number(value: Any) -> bool:
    """Whether a value of the recipe is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -LARGEST < value < LARGEST
