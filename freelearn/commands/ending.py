"""How a command ends where it cannot go on: one sentence and exit status 1, no traceback."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from freelearn.commands.command_line import command_line, program
from freelearn.errors import UserError, cannot_write


@contextmanager
def one_sentence(interrupted: str, folder: Path | None = None) -> Iterator[None]:
    """Ends the process where the user made a mistake, the system refuses a file, or the user interrupts.

    interrupted: what to say then. folder: where the command writes.
    """
    # TensorBoard's writers meet a refusal in a thread of theirs, and raise it once more in the one that tells them to
    # write; the thread's traceback says nothing else.
    threading.excepthook = _but_refusals
    try:
        yield
    except UserError as mistake:
        sys.exit(f"error: {mistake}{_way_on(mistake)}")
    except OSError as refusal:
        # Writers say this themselves; here it is what libraries write on their own account.
        sys.exit(f"error: {cannot_write(refusal.filename or folder, refusal)}")
    except KeyboardInterrupt:
        sys.exit(f"error: {interrupted}")


def _way_on(mistake: UserError) -> str:
    """How a laboratory's own file becomes what was asked for. Not in the mistake itself: the page does it otherwise."""
    if not mistake.foreign:
        return ""
    words = command_line(program("intake"), [f"data.path={mistake.foreign}"])
    return f"\nA laboratory's own file becomes such a table by\n  {words}"


def _but_refusals(told: threading.ExceptHookArgs) -> None:
    if not isinstance(told.exc_value, OSError):
        threading.__excepthook__(told)
