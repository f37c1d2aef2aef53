"""The one exception that a user's mistake raises."""

import difflib
import errno
from collections.abc import Collection
from pathlib import Path


class UserError(Exception):
    """A mistake in what the user gave: says what is wrong, where, and what to do.

    The commands print it as one message without a traceback and exit with status 1. foreign: the path of a file that is
    none of the program's tables, but perhaps what a laboratory wrote; "" otherwise.
    """

    foreign = ""


def unknown(what: str, name: str, known: Collection[str]) -> UserError:
    """The mistake of a name that is none of those known, with the one that was meant, perhaps.

    >>> print(unknown("effect", "fiber_tension", ["end_clamps", "fiber_tension_only"]))
    Unknown effect 'fiber_tension'. Did you mean 'fiber_tension_only'? Known: end_clamps, fiber_tension_only.
    """
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return UserError(f"Unknown {what} {name!r}.{hint} Known: {', '.join(known)}.")


# What to do where the system refuses to write.
_REMEDIES = {
    errno.ENOSPC: "make room there",
    errno.EDQUOT: "make room there",
    errno.EFBIG: "raise the limit on the size of files (ulimit -f)",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def cannot_write(place: str | Path | None, problem: Exception, instead: str = "choose another folder") -> UserError:
    """The mistake of a place that cannot be written to, with the system's own reason.

    instead: what to do about it where nothing better is known.

    >>> print(cannot_write("run", PermissionError(13, "Permission denied")))
    Cannot write to run: Permission denied. What to do: choose another folder.
    """
    reason, number = getattr(problem, "strerror", None) or problem, getattr(problem, "errno", None)
    there = f"to {_shown(place)}" if place else "its results"
    return UserError(f"Cannot write {there}: {reason}. What to do: {_REMEDIES.get(number or 0, instead)}.")


def _shown(place: str | Path) -> str:
    """A path that may be shown: long ones cut, characters that no terminal should get as escapes."""
    text = str(place).encode("unicode_escape").decode() if not str(place).isprintable() else str(place)
    return text if len(text) <= 300 else f"{text[:140]}…{text[-140:]}"
