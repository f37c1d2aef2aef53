"""The names of the library's effects, without what they need to be loaded: a mistyped one is told at once."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from pathlib import Path

from freelearn.common.errors import UserError

NAME = re.compile(r'^    name(?:: [^=\n]+)? = "(\w+)"$', re.MULTILINE)
REGISTRY = "freelearn.physics.effects.registry"


def check_names(names: Sequence[str]) -> None:
    """Raises UserError for a name that no effect of the library has. Where the registry is loaded, or a user has
    effects of their own, that is asked instead, later."""
    if REGISTRY in sys.modules or os.environ.get("FREELEARN_EFFECTS"):
        return
    known = [
        name for path in sorted(Path(__file__).parent.rglob("*.py")) for name in NAME.findall(path.read_text("utf-8"))
    ]
    for name in names:
        if name not in known:
            raise unknown_effect(name, known)


def unknown_effect(name: str, known: Collection[str]) -> UserError:
    """The mistake of a name that is none of those known."""
    close = get_close_matches(str(name), known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else " If it is your own, name its file in FREELEARN_EFFECTS."
    return UserError(f"Unknown effect {name!r}.{hint} Available: {', '.join(known)}.")
