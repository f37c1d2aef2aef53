"""One researcher's work: what was chosen, what ran, what runs. Outlives the page, so that reloading loses nothing."""

from __future__ import annotations

import hashlib
import json
import re
import secrets
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from freelearn.files import write_bytes, write_text
from freelearn.measurements.mark import mark_left_out
from freelearn.workbench.job import Job
from freelearn.workbench.question import VIRTUAL_SETS, Question, stored_csv

ID = re.compile(r"[0-9a-f]{16}")
MEGABYTE = 2**20
LARGEST_CSV = 64 * MEGABYTE
Run = dict[str, Any]


class Session:
    """Kept in `folder`/state.json. version counts up at every change, so that a page sees when to draw anew.

    question: what is chosen. sets: training sets to choose from. table: what table.json says of the data. runs: each
    {folder, question}, in the order of fitting. search: {folder, question} of the latest discovery.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.version = folder, 0
        self.question, self.problem = Question(), ""
        self.table: dict[str, Any] = {}
        self.runs: list[Run] = []
        self.search: Run | None = None
        self.job: Job | None = None
        self.asked: Question | None = None
        self.then = ""
        self._load()

    # --- kept on disk ---------------------------------------------------------------------------------------

    def _load(self) -> None:
        try:
            content = json.loads((self.folder / "state.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        self.question, self.table = Question.from_json(content["question"]), content["table"]
        self.problem = content["problem"]
        self.runs, self.search = [_read(r) for r in content["runs"]], _read(content["search"])

    def save(self) -> None:
        """Keeps the session on disk, whole or not at all, and counts its version up."""
        self.version += 1
        content = {
            "question": self.question.to_json(),
            "table": self.table,
            "problem": self.problem,
            "runs": [_plain(r) for r in self.runs],
            "search": _plain(self.search),
        }
        self.folder.mkdir(parents=True, exist_ok=True)
        write_text(self.folder / "state.json", json.dumps(content, indent=1) + "\n")

    # --- choosing -------------------------------------------------------------------------------------------

    @property
    def sets(self) -> list[str]:
        """Training sets to choose from; none before a table was read."""
        if self.question.data == "csv":
            return list(self.table.get("sets", []))
        return VIRTUAL_SETS

    @property
    def ready(self) -> bool:
        """Whether there are data to fit."""
        return bool(self.sets) and not self.busy

    @property
    def busy(self) -> bool:
        """Whether a job runs."""
        return self.job is not None and self.job.status == "running"

    def choose(self, **changes: Any) -> None:
        """Takes over what was chosen; keeps the training set one that the data have."""
        question = replace(self.question, **changes)
        if question == self.question:
            return
        if question.data != self.question.data:
            self.problem = ""
            self.table = {}
            if question.data == "csv":
                question = replace(question, path="", name="")
        self.question = question
        self._settle()
        self.save()

    def _settle(self) -> None:
        if self.sets and self.question.train not in self.sets:
            self.question = replace(self.question, train="sample3" if "sample3" in self.sets else self.sets[0])

    def upload(self, name: str, content: bytes) -> None:
        """Stores a CSV and has it checked."""
        if self.busy:
            self._refuse("Something is running: wait for it or cancel it, then drop the file again.")
            return
        if len(content) > LARGEST_CSV:
            size = f"{len(content) / MEGABYTE:.0f} MB"
            self._refuse(f"{size} is more than the page takes ({LARGEST_CSV // MEGABYTE} MB): use the command line.")
            return
        self.question = replace(self.question, data="csv", path=self._stored(content), name=name[:200], effects=())
        self.table, self.problem = {}, ""
        self.start("check")

    def _stored(self, content: bytes) -> str:
        """Keeps a table; its path."""
        path = stored_csv(self.folder, hashlib.sha256(content).hexdigest())
        self.folder.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
        return str(path.resolve())

    def leave_out(self, lines: Collection[int]) -> None:
        """Repeats the latest discovery on a copy of its table in which the rows that begin at these lines are marked to
        be left out."""
        if self.busy or self.discovery() is None or not lines:
            return
        assert self.search is not None
        asked: Question = self.search["question"]
        try:
            content = mark_left_out(Path(asked.path).read_bytes(), lines)
        except OSError as problem:
            self._refuse(f"{self.question.name} cannot be read any more ({problem.strerror}): drop it again.")
            return
        self.question = replace(asked, path=self._stored(content), name=self.question.name)
        # The counts of rows first; then the search, and before it the fit that it is about.
        self.start("check")
        self.then = "discover"

    def _refuse(self, problem: str) -> None:
        self.problem = problem
        self.save()

    # --- running --------------------------------------------------------------------------------------------

    def start(self, kind: str) -> None:
        """Starts a `check`, `train` or `discover`, unless one runs. A search begins with the fit that it is about."""
        if self.busy:
            return
        self.then = ""
        if kind == "discover" and all(r["question"] != self.question for r in self.comparable()):
            kind, self.then = "train", "discover"
        self._start(kind)

    def _start(self, kind: str) -> None:
        asked = self.question.about(kind)
        name = f"{kind}_{hashlib.sha256(json.dumps(asked.to_json()).encode()).hexdigest()[:10]}"
        self.asked = self.question
        self.job = Job(kind, self.question, self.folder / name, self.folder.parent / "fits")
        self.save()

    def cancel(self) -> None:
        """Stops the running job."""
        if self.busy:
            assert self.job is not None
            self.then = ""
            self.job.cancel()
            self.save()

    def poll(self) -> None:
        """Takes in what the running job has said. Any number of pages may ask."""
        if self.job is None or not self.job.poll():
            return
        self.version += 1
        if self.job.status == "running":
            return
        assert self.asked is not None
        ended = {"folder": self.job.folder.name, "question": self.asked}
        if self.job.kind == "check":
            self._checked()
        elif self.job.status == "done" and self.job.kind == "train":
            self.runs = [r for r in self.runs if r["folder"] != ended["folder"]] + [ended]
        elif self.job.status == "done":
            self.search = ended
        self.save()
        if self.then and self.job is not None and self.job.status == "done":
            kind, self.then = self.then, ""
            self.start(kind)

    def _checked(self) -> None:
        assert self.job is not None
        if self.job.status == "done":
            self.table = json.loads((self.job.folder / "table.json").read_text(encoding="utf-8"))
            self._settle()
        else:
            # The user knows the file by the name that it was dropped with.
            self.problem = self.job.text.replace(self.question.path, self.question.name)
            self.job = None

    # --- results --------------------------------------------------------------------------------------------

    def comparable(self) -> list[Run]:
        """The fits of the model and rows that the latest fit is about, in order."""
        if not self.runs:
            return []
        latest = self.runs[-1]["question"]
        return [r for r in self.runs if latest.same_but_effects(r["question"])]

    def discovery(self) -> dict[str, Any] | None:
        """discovery.json of the latest discovery, where it is about what is chosen."""
        if self.search is None or not self.question.same_but_effects(self.search["question"]):
            return None
        return self.read(self.search, "discovery.json")

    def read(self, run: Run, name: str) -> dict[str, Any] | None:
        """A JSON file of a run's folder; None where there is none."""
        try:
            return dict(json.loads((self.folder / run["folder"] / name).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None


class Sessions:
    """All sessions under one work folder, by the id in the page's address."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.open: dict[str, Session] = {}

    def get(self, asked: str) -> tuple[str, Session]:
        """The session of that id, or a new one where there is no such id."""
        known = bool(ID.fullmatch(asked)) and (asked in self.open or (self.folder / asked).is_dir())
        name = asked if known else secrets.token_hex(8)
        if name not in self.open:
            self.open[name] = Session(self.folder / name)
        return name, self.open[name]

    def close(self) -> None:
        """Stops every running job."""
        for session in self.open.values():
            if session.job is not None:
                session.job.cancel()


def _plain(run: Run | None) -> dict[str, Any] | None:
    return None if run is None else {"folder": run["folder"], "question": run["question"].to_json()}


def _read(run: dict[str, Any] | None) -> Any:
    return None if run is None else {"folder": run["folder"], "question": Question.from_json(run["question"])}
