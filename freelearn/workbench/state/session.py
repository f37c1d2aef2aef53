"""One researcher's work, which outlives the page, so that reloading loses nothing; and all sessions of a folder."""

from __future__ import annotations

import re
import secrets
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from freelearn.common.errors import UserError
from freelearn.data.table.records import mark_left_out
from freelearn.workbench.state.dropped_files import kept_in_folder, unpacked
from freelearn.workbench.state.question import MUSCLE, OWN, Question
from freelearn.workbench.state.running import Running

# One researcher's work: what was chosen, what ran, what runs. Outlives the page, so that reloading loses nothing.

MEGABYTE = 2**20
LARGEST_CSV = 64 * MEGABYTE
LONGEST_NAME = 200
# Endings by which intake knows a file; every other one is kept as text.
FORMATS = (".xlsx", ".xlsm", ".xls", ".ods", ".mat", ".pkl", ".pickle")
RECIPES = (".yaml", ".yml")
# What is chosen at first of these data. Few beds measure like the paper's. The muscle's braid angle is assumed; its
# load cell and gauge were calibrated.
FIRST: dict[str, dict[str, Any]] = {
    OWN: {"train": "all", "accuracy": None},
    MUSCLE: {
        "name": "Festo DMSP-20-300", "train": "all", "bed": "isometric", "effects": ("fiber_misalignment",),
        "ruled_out": ("force_gain", "pressure_gain"),
    },
}  # fmt: skip


def shown_name(name: str) -> str:
    """A name by which a page may call a file: not long, and without what turns, breaks or ends a line.

    >>> shown_name("rig\\n\\u202efdp.csv")
    'rig__fdp.csv'
    """
    return "".join(c if c.isprintable() else "_" for c in name)[:LONGEST_NAME]


class Session(Running):
    """What is chosen and given on the page. made: {folder, path, name, recipe, warnings, members, command}: the table
    that intake made, by which recipe, of the file that the user calls `name`."""

    def choose(self, **changes: Any) -> None:
        """Takes over what was chosen; keeps the training set one that the data have. Another bed, or other actuators,
        make another table of the same file: it is read again."""
        question = replace(self.question, **changes)
        if question == self.question:
            return
        if "train" in changes:
            question = replace(question, split=Question().split)
        other = question.data != self.question.data
        again = other or (question.bed, question.members) != (self.question.bed, self.question.members)
        if again and self.busy:
            self._refuse("Something is running: wait for it or cancel it, then choose again.")
            return
        if other:
            question = Question(question.data, question.seed, model=question.model, **FIRST.get(question.data, {}))
            self.problem, self.table, self.raw, self.made = "", {}, {}, {}
        if again and (question.path or question.data == MUSCLE):
            self._read(question)
            return
        self.question = question
        self.settle()
        self.save()

    def show_bands(self, banded: bool) -> None:
        """Takes over whether curves are shown with their 95 % bands: no question, and so nothing is computed anew."""
        if banded != self.banded:
            self.banded = banded
            self.save()

    def upload(self, name: str, content: bytes) -> None:
        """Stores a table, or what is to become one, and has it checked; a recipe is used."""
        if self._refused(content):
            return
        ending = Path(name).suffix.lower()
        try:
            if several := unpacked(content, LARGEST_CSV) if ending == ".zip" else {}:
                self.upload_several(several, name)
                return
        except UserError as problem:
            self._refuse(str(problem))
            return
        if ending in RECIPES:
            if self.raw:
                self.take_in(content)
            else:
                self._refuse("A recipe says what the columns of a laboratory's file are: drop that file first.")
            return
        if ending in FORMATS or content.startswith((b"PK\x03\x04", b"MATLAB")):
            path = self.stored(content, "raw", ending if ending in FORMATS else ".raw")
        else:
            path = self.stored(content)
        self._begin_with(path, name)

    def upload_several(self, files: Mapping[str, bytes], name: str = "") -> None:
        """Stores files that were dropped together, recordings or channels of one test, and has them looked at. name:
        that the user gave all of them."""
        if self._refused(b"".join(files.values())):
            return
        recipes = [one for one in files if one.lower().endswith(RECIPES)]
        if recipes or len(files) < 2:
            # Of a recipe and its file each is dropped by itself.
            for one in sorted(files, key=lambda one: one in recipes)[:1]:
                self.upload(one, files[one])
            return
        self._begin_with(str(kept_in_folder(files, self.folder)), name or f"a folder of {len(files)} files")

    def _begin_with(self, path: str, name: str) -> None:
        """Has what was stored read."""
        # Actuators that a recipe named are those of its file alone.
        members = "" if self.made else self.question.members
        self.raw, self.made = {}, {}
        about: dict[str, Any] = {
            "data": OWN,
            "path": path,
            "name": shown_name(name),
            "members": members,
            "train": "all",
        }
        first = FIRST[OWN] if self.question.data != OWN else {}
        self._read(replace(self.question, **first | about, effects=(), ruled_out=()))

    def give_members(self, content: bytes) -> None:
        """Stores the file of an end block's actuators, and has the table read with them."""
        if not self._refused(content):
            self.choose(members=self.stored(content, "members"))

    def map_columns(self, again: bool) -> None:
        """Shows what the columns of the laboratory's file are, to be changed; or not."""
        if self.raw and self.raw["open"] != again:
            self.raw["open"] = again
            self.save()

    def take_in(self, recipe: bytes, then: str = "") -> None:
        """Makes a table of the laboratory's file by a recipe, and goes on with it. then: a `discover`, or nothing."""
        if self._refused(recipe) or not self.raw:
            return
        path = self.stored(recipe, "recipe", ".yaml")
        self.problem, self.goal = "", then
        self.begin("convert", Question(OWN, path=self.raw["path"], name=self.raw["name"], recipe=path))

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
        path = self.stored(content)
        # Marks change no unit.
        self.confirmed[Path(path).name] = self.confirmed.get(Path(asked.path).name, [])
        self.question = replace(asked, path=path, name=self.question.name)
        # The counts of rows first; then the search, and before it the fit that it is about.
        self.start("check")
        self.then = "discover"

    def add_proposal(self, name: str) -> None:
        """Makes an effect that the latest search wrote one of the session's, and has it in the model. Raises UserError
        where its file is not as the search wrote it."""
        if self.busy or self.search is None:
            return
        # Here, not above: torch is imported with it.
        from freelearn.workbench.state.proposed import proposed

        found = proposed(self.folder / self.search["folder"] / f"proposed_{name}.py", self.folder)
        self.added[name] = {"file": str(found.path), "formula": found.written.formula}
        self.choose(effects=(*(e for e in self.question.effects if e != name), name))
        self.save()

    def ask(self, kind: str, asks: str = "", rows: int = 0, name: str = "", recipe: str = "") -> None:
        """Asks something of the latest fit: a `predict` of a stored table with blanks, or of a laboratory's file by a
        recipe (`asks` tells what that file seems to hold); or a `plan` of so many rows."""
        runs = self.comparable()
        if self.busy or not runs:
            return
        folder = str((self.folder / runs[-1]["folder"]).resolve())
        own = runs[-1]["question"].own
        self.begin(kind, Question(own=own, run=folder, asks=asks, rows=rows, name=name, recipe=recipe))

    def ask_file(self, name: str, content: bytes) -> None:
        """Has a file read that asks something of the latest fit."""
        if not self._refused(content):
            ending = Path(name).suffix.lower()
            path = self.stored(content, "questions", ending if ending in FORMATS else ".raw")
            self.ask("asks", asks=path, name=shown_name(name))

    def add_tests(self, name: str, content: bytes) -> None:
        """Has a file of tests of rubber read, beside those that are there; one of the same name takes its place."""
        if self._refused(content):
            return
        ending = Path(name).suffix.lower()
        path = self.stored(content, "rubber", ending if ending in FORMATS else ".raw")
        before = dict(self.asides["tests"]["question"].sheets) if "tests" in self.asides else {}
        self.begin("tests", Question(sheets=tuple((before | {shown_name(name): path}).items())))

    def forget_tests(self) -> None:
        """Begins anew with the files of tests of rubber."""
        if not self.busy and "tests" in self.asides:
            del self.asides["tests"]
            self.save()

    def fit_rubber(self, recipe: bytes, effects: Collection[str]) -> None:
        """Fits the rubber to its own tests. recipe: how their files are read; effects: energies that it has, none to
        compare all of them."""
        if not self.busy and "tests" in self.asides:
            sheets = self.asides["tests"]["question"].sheets
            path = self.stored(recipe, "recipe", ".yaml")
            self.begin("rubber", Question(sheets=sheets, effects=tuple(effects), recipe=path))

    def set_beside(self, one: str, other: str) -> None:
        """Sets two fits side by side. one, other: their folders."""
        if not self.busy:
            a, b = (str((self.folder / folder).resolve()) for folder in (one, other))
            own = [name for run in self.runs if run["folder"] in (one, other) for name in run["question"].own]
            self.begin("compare", Question(run=a, beside=b, own=tuple(dict.fromkeys(own))))

    def study(self, models: Collection[str], trains: Collection[str]) -> None:
        """Fits every one of these models to every one of the training sets, of the data and with the effects chosen."""
        if self.ready:
            asked = self.with_added(self.question)
            self.begin("study", replace(asked, models=tuple(models), trains=tuple(trains)))

    def adopt(self) -> None:
        """Goes on with the model that the latest search found, as the search fitted it: with the error it promised."""
        effects = self.found()
        if self.busy or not effects or self.search is None:
            return
        # What the search wrote belongs to the session from now on.
        for name in effects:
            if name not in self.added and (self.folder / self.search["folder"] / f"proposed_{name}.py").exists():
                self.add_proposal(name)
        asked = self.with_added(replace(self.search["question"], effects=effects))
        run = {"folder": self.search["folder"], "question": asked}
        self.runs = [r for r in self.runs if r["folder"] != run["folder"]] + [run]
        self.question = replace(self.question, effects=effects)
        self.save()

    def _read(self, question: Question) -> None:
        self.question, self.table, self.problem = question, {}, ""
        self.start("check")

    def _refused(self, content: bytes) -> bool:
        """Whether a file cannot be taken, which is then said."""
        if self.busy:
            self._refuse("Something is running: wait for it or cancel it, then drop the file again.")
            return True
        if len(content) > LARGEST_CSV:
            limit = f"{LARGEST_CSV / MEGABYTE:.3g} MB"
            self._refuse(
                f"The file is more than the page takes ({limit}): use the command line, which has no such limit."
            )
            return True
        return False

    def _refuse(self, problem: str) -> None:
        self.problem = problem
        self.save()


ID = re.compile(r"[0-9a-f]{16}")


class Sessions:
    """By the id in the page's address."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.open: dict[str, Session] = {}

    def known(self, asked: str) -> bool:
        """Whether there is a session of that id."""
        return bool(ID.fullmatch(asked)) and (asked in self.open or (self.folder / asked).is_dir())

    def get(self, asked: str) -> tuple[str, Session]:
        """The session of that id, or a new one where there is no such id."""
        name = asked if self.known(asked) else secrets.token_hex(8)
        if name not in self.open:
            self.open[name] = Session(self.folder / name)
        return name, self.open[name]

    def close(self) -> None:
        """Stops every running job."""
        for session in self.open.values():
            if session.job is not None:
                session.job.cancel()
