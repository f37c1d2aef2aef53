"""What runs for a session, one job at a time, and what becomes of it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from freelearn.workbench.state.job import Job
from freelearn.workbench.state.question import ASIDES, VIRTUAL_SETS, Question, as_on_the_page
from freelearn.workbench.state.session_store import SessionStore


class Running(SessionStore):
    """job: the latest. asked: its question. then: the kind of job that follows when it is done. goal: the one that is
    to follow once a table was made, and was read without doubts."""

    def __init__(self, folder: Path) -> None:
        self.job: Job | None = None
        self.asked: Question | None = None
        self.then = self.goal = ""
        super().__init__(folder)

    @property
    def busy(self) -> bool:
        """Whether a job runs."""
        return self.job is not None and self.job.status == "running"

    @property
    def sets(self) -> list[str]:
        """Training sets to choose from; none before a table was read."""
        return list(self.table.get("sets", [])) if self.question.measured else VIRTUAL_SETS

    @property
    def few_states(self) -> bool:
        """Whether the training set has too few kinematic states to hold some of them out."""
        return self.question.train in self.table.get("few_states", [])

    @property
    def ready(self) -> bool:
        """Whether there are data to fit, in units that nobody doubts."""
        return bool(self.sets) and not self.busy and not self.doubted

    def failure(self, kind: str) -> list[str]:
        """Why the latest job failed, if it is of this kind, and did."""
        job = self.job
        return [job.text] if job is not None and job.kind == kind and job.status == "failed" else []

    def start(self, kind: str) -> None:
        """Starts a `check`, `train` or `discover`, unless one runs; after a fit that runs comes a search that is asked
        for meanwhile. A search begins with the fit that it is about."""
        if self.busy and kind == "discover" and self.job is not None and self.job.kind == "train":
            self.then = kind
        if self.busy or (kind != "check" and self.doubted):
            return
        self.then = ""
        asked = self.with_added(self.question)
        fit = asked.about("train")
        if kind == "discover" and all(r["question"].about("train") != fit for r in self.comparable()):
            kind, self.then = "train", "discover"
        self.begin(kind, asked)

    def with_added(self, question: Question) -> Question:
        """The question with the files of the effects in its model that a search wrote."""
        own = [self.added[name]["file"] for name in question.effects if name in self.added]
        return replace(question, own=tuple(own))

    def begin(self, kind: str, asked: Question) -> None:
        """Starts a job."""
        about = json.dumps(asked.about(kind).to_json())
        name = f"{kind}_{hashlib.sha256(about.encode()).hexdigest()[:10]}"
        self.asked = asked
        self.job = Job(kind, asked, self.folder / name, self.folder.parent / "fits")
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
        if self.job.kind in ("check", "convert"):
            self._heard()
        elif self.job.status == "done" and self.job.kind == "train":
            self.runs = [r for r in self.runs if r["folder"] != ended["folder"]] + [ended]
        elif self.job.status == "done" and self.job.kind in ASIDES:
            self.asides[self.job.kind] = ended
        elif self.job.status == "done":
            self.search = ended
        self.save()
        if self.then and self.job is not None and self.job.status == "done":
            kind, self.then = self.then, ""
            self.start(kind)

    def _heard(self) -> None:
        """What came of reading or converting a file."""
        assert self.job is not None
        assert self.asked is not None
        if self.job.status != "done":
            self.problem, self.goal = self.named(self.job.text), ""
            self.job = None
        elif self.job.kind == "convert":
            self._converted(self.job.folder, self.asked)
        else:
            self._checked(_content(self.job.folder / "table.json"), _content(self.job.folder / "guess.json"))

    def _checked(self, table: dict[str, Any], guess: dict[str, Any]) -> None:
        """Goes on with the table, or with what its columns seem to be; both where its units are doubted."""
        assert self.asked is not None
        self.table = table
        if guess:
            # What has most of a table's columns is a table with faults; anything else is still to be mapped.
            nearly = guess["nearly"] or bool(self.made)
            self.problem = self.named(guess.pop("fault", "")) if nearly else ""
            guess["notes"] = [self.named(note) for note in guess["notes"]]
            about = {"path": self.asked.path, "name": self.asked.name}
            self.raw = self.raw if self.made else {**about, "guess": guess, "open": not (table or nearly)}
        if table:
            self.settle()
            # Where its units are doubted somebody looks first.
            self.then, self.goal = self.then or ("" if self.doubted else self.goal), ""

    def _converted(self, folder: Path, asked: Question) -> None:
        """Goes on with the table that was made, as if it had been given."""
        made: dict[str, Any] = json.loads((folder / "made.json").read_text(encoding="utf-8"))
        path = self.stored((folder / "table.csv").read_bytes())
        members = self.stored((folder / "table_members.csv").read_bytes(), "members") if made["members"] else ""
        warnings = [self.named(warning) for warning in made["warnings"]]
        self.made = {
            "folder": folder.name, "path": path, "name": asked.name, "recipe": asked.recipe, "warnings": warnings,
            "members": made["members"], "command": asked.command("intake"),
        }  # fmt: skip
        self.raw["open"] = False
        self.table, self.problem, self.then = {}, "", "check"
        name = f"{Path(asked.name).stem}_table.csv"
        self.question = replace(
            self.question, path=path, name=name, bed=made["bed"], members=members, train="all", effects=(), ruled_out=()
        )

    def settle(self) -> None:
        """Keeps the training set one that the data have, and tests it on whole kinematic states if it has enough."""
        train = self.question.train if self.question.train in self.sets or not self.sets else "all"
        self.question = replace(self.question, train=train)
        if self.few_states:
            self.question = replace(self.question, split="rows")

    def named(self, text: str) -> str:
        """A sentence with the names by which the user knows the files, and what is chosen on a page."""
        assert self.asked is not None
        for path, name in ((self.asked.path, self.asked.name), (self.asked.recipe, "the recipe"),
                           (self.asked.members, "the file of actuators")):  # fmt: skip
            if path:
                text = text.replace(path, name).replace(Path(path).name, name)
        return as_on_the_page(text)


def _content(path: Path) -> dict[str, Any]:
    """Of a job's JSON file; nothing where it wrote none."""
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else {}
