"""Whole commands in this process: the words of a command line in, status and what was printed out."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from pathlib import Path
from unittest.mock import patch

from ended import Ended
from hydra.core.global_hydra import GlobalHydra

from freelearn.__main__ import main


def command(name: str, *words: str, folder: Path) -> Ended:
    """`freelearn NAME WORDS` in a working folder. What no command foresees is raised here, not printed."""
    out, err, before = io.StringIO(), io.StringIO(), Path.cwd()
    GlobalHydra.instance().clear()
    status = 0
    os.chdir(folder)
    try:
        with (
            patch.object(sys, "argv", ["freelearn", name, *words]),
            patch.dict(os.environ, {"HYDRA_FULL_ERROR": "1", "COLUMNS": "200"}),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            main()
    except SystemExit as end:
        # As the interpreter does it: a text is printed and makes the status 1.
        if isinstance(end.code, str):
            err.write(end.code + "\n")
            status = 1
        else:
            status = int(end.code or 0)
    finally:
        os.chdir(before)
        GlobalHydra.instance().clear()
    return Ended(status, out.getvalue(), err.getvalue())
