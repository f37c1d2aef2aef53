"""What a session keeps on disk, and what its runs have left there."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from freelearn.files import write_bytes, write_text
from freelearn.workbench.question import Question, stored_csv

Run = dict[str, Any]


class Kept:
    """Kept in `folder`/state.json. version counts up at every change, so that a page sees when to draw anew.

    question: what is chosen. table: what table.json says of the data. raw: a laboratory's file that is no table: its
    {path, name}, guess.json as `guess`, and whether its columns are being mapped (`open`). made: the table that intake
    made of it, see Session. confirmed: name of a stored table → suspicions about its units that the user knows better.
    runs: each {folder, question}, in the order of fitting. search: {folder, question} of the latest discovery. banded:
    whether curves are shown with their 95 % bands. added: name of an effect that a search of the session wrote and the
    user has added → its {file, formula}.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.version = folder, 0
        self.question, self.problem = Question(), ""
        self.table: dict[str, Any] = {}
        self.raw: dict[str, Any] = {}
        self.made: dict[str, Any] = {}
        self.confirmed: dict[str, list[str]] = {}
        self.runs: list[Run] = []
        self.search: Run | None = None
        self.banded = True
        self.added: dict[str, dict[str, str]] = {}
        self._load()

    def _load(self) -> None:
        try:
            content = json.loads((self.folder / "state.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        self.question, self.table = Question.from_json(content["question"]), content["table"]
        self.problem = content["problem"]
        # A session of former times knows none of these.
        self.raw, self.made = content.get("raw", {}), content.get("made", {})
        self.confirmed, self.banded = content.get("confirmed", {}), content.get("banded", True)
        self.added = content.get("added", {})
        self.runs, self.search = [_read(r) for r in content["runs"]], _read(content["search"])

    def save(self) -> None:
        """Keeps the session on disk, whole or not at all, and counts its version up."""
        self.version += 1
        content = {
            "question": self.question.to_json(),
            "table": self.table,
            "problem": self.problem,
            "raw": self.raw,
            "made": self.made,
            "confirmed": self.confirmed,
            "runs": [_plain(r) for r in self.runs],
            "search": _plain(self.search),
            "banded": self.banded,
            "added": self.added,
        }
        self.folder.mkdir(parents=True, exist_ok=True)
        write_text(self.folder / "state.json", json.dumps(content, indent=1) + "\n")

    def stored(self, content: bytes, kind: str = "measurements", ending: str = ".csv") -> str:
        """Keeps a file; its path."""
        path = stored_csv(self.folder, hashlib.sha256(content).hexdigest(), kind, ending)
        self.folder.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
        return str(path.resolve())

    @property
    def mapping(self) -> bool:
        """Whether the columns of a laboratory's file are being mapped."""
        return bool(self.raw) and bool(self.raw["open"])

    # --- about units ----------------------------------------------------------------------------------------

    @property
    def unit_warnings(self) -> list[str]:
        """Suspicions about the units of the table."""
        return list(self.table.get("unit_warnings", []))

    @property
    def doubted(self) -> list[str]:
        """Those of them that the user has not yet answered: until then nothing is fitted."""
        known = self.confirmed.get(Path(self.question.path).name, [])
        return [warning for warning in self.unit_warnings if warning not in known]

    def confirm_units(self, right: bool) -> None:
        """The user says that the units of this table are right as they are, or takes it back."""
        known = self.unit_warnings if right else []
        if self.confirmed.get(Path(self.question.path).name, []) != known:
            self.confirmed[Path(self.question.path).name] = known
            self.save()

    # --- results --------------------------------------------------------------------------------------------

    def comparable(self) -> list[Run]:
        """The fits of the model and rows that the latest fit to the chosen data is about, in order."""
        runs = [r for r in self.runs if self.question.same_data(r["question"])]
        return [r for r in runs if runs[-1]["question"].same_but_effects(r["question"])]

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


def _plain(run: Run | None) -> dict[str, Any] | None:
    return None if run is None else {"folder": run["folder"], "question": run["question"].to_json()}


def _read(run: dict[str, Any] | None) -> Any:
    return None if run is None else {"folder": run["folder"], "question": Question.from_json(run["question"])}
