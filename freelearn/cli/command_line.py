"""The shell command that gives a run's numbers again, and how a command ends where it cannot go on."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from freelearn.common.errors import UserError, cannot_write

# Variables that name files of the user's own code.
OWN_CODE = ("FREELEARN_EFFECTS", "FREELEARN_MODELS")
# Where nobody has said how well a bed measures.
ESTIMATED = "data.accuracy=estimate"
# The installed command.
INSTALLED = "freelearn"


def command_line(program: Sequence[str], overrides: Sequence[str]) -> str:
    """`program overrides`, with the user's own effects and models where there are some."""
    own = [f"{name}={shlex.quote(value)}" for name in OWN_CODE if (value := os.environ.get(name))]
    return " ".join([*own, *map(shlex.quote, [*program, *overrides])])


def program(name: str, script: Sequence[str] = ()) -> list[str]:
    """How a command is started as this process was: by the installed `freelearn name`, or else by `script`; in words
    that run in this folder.

    script: by default a checkout's `python name.py`.
    """
    started = Path(sys.argv[0])
    if started.name.startswith(f"{INSTALLED} "):
        return [_as_found(started.with_name(INSTALLED)), name]
    interpreter = Path(sys.executable).with_name("python")
    _, *words = script or ["python", f"{name}.py"]
    return [_as_found(interpreter if interpreter.exists() else Path(sys.executable)), *words]


def called(name: str) -> str:
    """The first word of the command line of `freelearn name`, for a command that goes on as another one."""
    started = Path(sys.argv[0])
    if not started.name.startswith(INSTALLED):  # python -m freelearn
        started = Path(sys.executable)
    return str(started.with_name(f"{INSTALLED} {name}"))


def installed(name: str) -> str:
    """Another package's program, installed beside the interpreter, as it runs in this folder."""
    path = Path(sys.executable).with_name(name)
    return _as_found(path) if path.exists() else name


def resumed(where: str, folder: Path) -> str:
    """How a command that was interrupted goes on. where: hydra.run.dir or hydra.sweep.dir."""
    return f"the same command with {shlex.quote(option(where, folder))} goes on from here"


def _as_found(path: Path) -> str:
    """A program by its name where the shell finds it so, else by its path from here."""
    found = shutil.which(path.name)
    if path.parent == Path() or (found and Path(found).parent == path.parent.absolute()):
        return path.name
    relative = os.path.relpath(path)
    if relative.startswith(os.pardir):
        return str(path)
    return relative if os.sep in relative else os.path.join(os.curdir, relative)


def option(name: str, path: Path) -> str:
    """name=path, with the quotes that Hydra wants round a path of other than plain characters."""
    text = str(path)
    if re.fullmatch(r"[A-Za-z0-9_/.\- ]+", text):
        return f"{name}={text}"
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'{name}="{escaped}"'


# How a command ends where it cannot go on: one sentence and exit status 1, no traceback.


@contextmanager
def exit_on_user_error(interrupted: str, folder: Path | None = None) -> Iterator[None]:
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
