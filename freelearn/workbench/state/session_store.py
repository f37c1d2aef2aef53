"""What a session keeps on disk, and what its runs have left there."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Len
from pydantic import TypeAdapter, ValidationError
from typing_extensions import TypedDict

from freelearn.common.files import write_bytes, write_text
from freelearn.common.formats import known_floor
from freelearn.discovery.residuals.residual_summary import NO_HINT
from freelearn.workbench.state.question import Question, stored_csv

Run = dict[str, Any]
# What a search says of a remaining misfit in which it sees nothing.
_Nothing = Annotated[dict[str, Any], Len(0, 0)]


class _Raw(TypedDict):
    path: str
    name: str
    guess: dict[str, Any]
    open: bool


class _Made(TypedDict):
    folder: str
    path: str
    name: str
    recipe: str
    warnings: list[str]
    members: bool
    command: str


@dataclass(frozen=True)
class _Run:
    folder: str
    question: Question


@dataclass(frozen=True)
class _State:
    """What state.json holds. A session of former times knows nothing of what has a default here."""

    question: Question
    table: dict[str, Any]
    problem: str
    runs: list[_Run]
    search: _Run | None
    raw: _Raw | _Nothing = field(default_factory=dict)
    made: _Made | _Nothing = field(default_factory=dict)
    confirmed: dict[str, list[str]] = field(default_factory=dict)
    banded: bool = True
    added: dict[str, dict[str, str]] = field(default_factory=dict)
    asides: dict[str, _Run] = field(default_factory=dict)


class SessionStore:
    """Kept in `folder`/state.json. version counts up at every change, so that a page sees when to draw anew.

    question: what is chosen. table: what table.json says of the data. raw: a laboratory's file that is no table: its
    {path, name}, guess.json as `guess`, and whether its columns are being mapped (`open`). made: the table that intake
    made of it, see Session. confirmed: name of a stored table → suspicions about its units that the user knows better.
    runs: each {folder, question}, in the order of fitting. search: {folder, question} of the latest discovery. banded:
    whether curves are shown with their 95 % bands. added: name of an effect that a search of the session wrote and the
    user has added → its {file, formula}. asides: by their kind, the latest answer and plan, each {folder, question}.
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
        self.asides: dict[str, Run] = {}
        self._load()

    def _load(self) -> None:
        path = self.folder / "state.json"
        try:
            kept = TypeAdapter(_State).validate_json(path.read_bytes())
        except OSError:
            return
        except ValidationError:
            # Cut short or changed by something else than the page.
            aside = path.with_name("state.json.broken")
            path.replace(aside)
            self.problem = (
                f"What was kept of this session cannot be read, so it begins anew. It is now {aside}; "
                "files and fits are still in that folder."
            )
            return
        self.question, self.table, self.problem = kept.question, kept.table, kept.problem
        self.raw, self.made = {**kept.raw}, {**kept.made}
        self.confirmed, self.banded, self.added = kept.confirmed, kept.banded, kept.added
        self.asides = {kind: {**vars(aside)} for kind, aside in kept.asides.items()}
        self.runs, self.search = [{**vars(run)} for run in kept.runs], {**vars(kept.search)} if kept.search else None

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
            "asides": {kind: _plain(aside) for kind, aside in self.asides.items()},
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

    def same_table(self) -> list[Run]:
        """All fits to the data that are chosen, whatever their model and training set, in order."""
        return [r for r in self.runs if self.question.same_data(r["question"])]

    def discovery(self) -> dict[str, Any] | None:
        """discovery.json of the latest discovery, where it is about what is chosen."""
        if self.search is None or not self.question.same_but_effects(self.search["question"]):
            return None
        return self.read(self.search, "discovery.json")

    @staticmethod
    def adopted(run: Run) -> bool:
        """Whether a run is what a search fitted itself."""
        return str(run["folder"]).startswith("discover_")

    def about(self, run: Run) -> dict[str, Any]:
        """What a run's files say: its `error` in words, E and noise_floor (None where there is none, or where it would
        tell nothing), the rows behind E in words, its parameters, the sentences on where it fails, and whether it is
        `as_good_as_noise` and so fails nowhere."""
        if self.adopted(run):
            search = self.read(run, "discovery.json") or {}
            error, left = search.get("error", {}), search.get("remainder")
            return {
                "error": "held-out error", "E": error.get("after"),
                "noise_floor": known_floor(error.get("noise_floor")),
                "rows": f"on {search['rows']} rows, each state left out in turn" if "rows" in search else "",
                "as_good_as_noise": False, "learned": 0,
                "parameters": search.get("parameters", {}),
                "failures": [left["hint"]] if left and left["hint"] != NO_HINT else [],
            }  # fmt: skip
        results = self.read(run, "results.json") or {}
        test, floor = results.get("tests", {}).get(run["question"].train, {}), known_floor(results.get("noise_floor"))
        scored, of = test.get("n", 0), test.get("of", 0)
        # Of a model that answers few of the rows those few tell no error.
        error = test.get("E") if 2 * scored >= of else None
        good = error is not None and floor is not None and error <= floor
        return {
            "error": "test error", "E": error, "noise_floor": floor, "parameters": results.get("parameters", {}),
            "rows": _scored(scored, of) if test else "",
            "failures": [] if good else [failure["sentence"] for failure in results.get("failures", [])],
            "as_good_as_noise": good, "learned": results.get("learned", 0),
        }  # fmt: skip

    def found(self) -> tuple[str, ...]:
        """The effects of the model that the latest discovery ended with, where it added any."""
        search = self.discovery()
        return (*search["given_effects"], *search["effects"]) if search and search["effects"] else ()

    def read(self, run: Run, name: str) -> dict[str, Any] | None:
        """A JSON file of a run's folder; None where there is none."""
        try:
            return dict(json.loads((self.folder / run["folder"] / name).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None


def _scored(scored: int, of: int) -> str:
    return f"on {scored} test rows" if scored == of or not of else f"on {scored} of {of} test rows"


def _plain(run: Run | None) -> dict[str, Any] | None:
    return None if run is None else {"folder": run["folder"], "question": run["question"].to_json()}
