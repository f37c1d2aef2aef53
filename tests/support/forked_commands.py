"""Commands in processes of their own that import nothing anew: a server has everything loaded, and forks for each.

A command starts in a few milliseconds instead of seconds, and ends as from a shell: with an exit status, what it
printed, and its own locks, limits and signals.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import resource
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn

from ended import Ended

ROOT = Path(__file__).resolve().parents[2]
# What the commands would else import as they go.
LOADED = """
cli.fit_commands api.tasks.train_task api.tasks.discover_task cli.sweep_job cli.run_commands api.tasks.plan_task
cli.intake_command cli.gathering cli.paper_figures cli.specimen_fits cli.callbacks fitting.fit report.html.run_report
report.html.discovery_report report.plots.discovery_plots report.plots.plan_plot report.plots.tensorboard_figures
report.terminal.printed_run report.terminal.printed_discovery report.terminal.fit_progress queries.fitted_model
"""


class Commands:
    """The server, as a context."""

    def __init__(self, folder: Path, before: str = "") -> None:
        """folder: for what the commands print. before: Python that the server executes before it loads anything."""
        self.folder, self.before = folder, before
        self.told: dict[int, Path] = {}

    def __enter__(self) -> Commands:
        line = [sys.executable, __file__, self.before]
        env = {"OMP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
        self.server = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env)
        self._ask({"ready": True})
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self.server.stdin
        assert self.server.stdout
        self.server.stdin.close()
        self.server.stdout.close()
        self.server.wait(60)

    def start(self, *words: str, cwd: Path | None = None, largest: int | None = None, out: str = "", **env: str) -> int:
        """Starts `freelearn words`; its process number.

        largest: no file of it may exceed so many bytes (ulimit -f). out: a file that takes what it prints instead."""
        place = self.folder / f"command_{len(self.told)}"
        request = {"words": words, "cwd": str(cwd or self.folder), "largest": largest, "env": env, "out": out}
        pid = int(self._ask(request | {"told": str(place)}))
        self.told[pid] = place
        return pid

    def wait(self, pid: int) -> Ended:
        """Waits for its end."""
        status, place = int(self._ask({"wait": pid})), self.told[pid]
        return Ended(status, *(place.with_suffix(f".{name}").read_text(errors="replace") for name in ("out", "err")))

    def run(self, *words: str, **options: Any) -> Ended:
        """What `freelearn words` gives; options of `start`."""
        return self.wait(self.start(*words, **options))

    def _ask(self, request: dict[str, Any]) -> Any:
        assert self.server.stdin
        assert self.server.stdout
        self.server.stdin.write(json.dumps(request) + "\n")
        self.server.stdin.flush()
        answer = self.server.stdout.readline()
        assert answer, "the server has died"
        return json.loads(answer)


def _serve() -> dict[str, Any] | None:
    """Answers until there is nothing more to do; in a forked process what that is to do."""
    answers = os.fdopen(os.dup(1), "w")
    # A command's limit on the size of files shall not meet what it prints: that goes through pipes.
    readers: dict[int, list[subprocess.Popen[bytes]]] = {}
    for line in sys.stdin:
        request = json.loads(line)
        answer: Any = True
        if "wait" in request:
            answer = os.waitstatus_to_exitcode(os.waitpid(request["wait"], 0)[1])
            for reader in readers.pop(request["wait"]):
                reader.wait()
        elif "words" in request:
            ends, cats = [], []
            for ending in (".out", ".err"):
                reading, writing = os.pipe()
                with open(request["told"] + ending, "w") as file:
                    cats.append(subprocess.Popen(["cat"], stdin=reading, stdout=file))
                os.close(reading)
                ends.append(writing)
            answer = os.fork()
            if answer == 0:
                return dict(request) | {"ends": ends}
            readers[answer] = cats
            for end in ends:
                os.close(end)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
    return None


def _become(request: dict[str, Any]) -> None:
    for descriptor, end in enumerate(request["ends"], 1):
        os.dup2(end, descriptor)
        os.close(end)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    if request["out"]:
        os.dup2(os.open(request["out"], os.O_WRONLY), 1)
    os.chdir(request["cwd"])
    os.environ.update(request["env"])
    if request["largest"] is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest"], resource.RLIM_INFINITY))
    # What a shell runs in its background inherits that interrupts are ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = ["freelearn", *request["words"]]


def _end(main: Callable[[], None]) -> NoReturn:
    """Ends as Python does, but for taking everything loaded to pieces, which takes seconds."""
    status: Any = 0
    try:
        main()
    except SystemExit as ended:
        status = ended.code or 0
    except BaseException:
        traceback.print_exc()
        status = 1
    if isinstance(status, str):
        print(status, file=sys.stderr)
        status = 1
    try:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError as refusal:
        # What Python itself says and does then.
        os.write(2, f"Exception ignored in: {refusal}\n".encode())
        status = 120
    os._exit(status)


if __name__ == "__main__":
    import importlib

    exec(sys.argv[1])
    for module in ("pandera.pandas", *(f"freelearn.{name}" for name in LOADED.split())):
        importlib.import_module(module)
    from freelearn.__main__ import main

    # What is loaded stays shared with the forked ones.
    gc.freeze()
    if (todo := _serve()) is not None:
        _become(todo)
        _end(main)
