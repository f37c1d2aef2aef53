"""The one exception that a user's mistake raises."""

import difflib
from collections.abc import Collection


class UserError(Exception):
    """A mistake in what the user gave: says what is wrong, where, and what to do.

    The commands print it as one message without a traceback and exit with status 2.
    """


def unknown(what: str, name: str, known: Collection[str]) -> UserError:
    """The mistake of a name that is none of those known, with the one that was meant, perhaps.

    >>> print(unknown("effect", "fiber_tension", ["end_clamps", "fiber_tension_only"]))
    Unknown effect 'fiber_tension'. Did you mean 'fiber_tension_only'? Known: end_clamps, fiber_tension_only.
    """
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return UserError(f"Unknown {what} {name!r}.{hint} Known: {', '.join(known)}.")
