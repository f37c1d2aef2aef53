"""A recipe to edit, from the guess at a file; with answers to its questions, a recipe to use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.data.beds import BEDS
from freelearn.data.intake.guesses.clock_spans import clock_open, origin_of, shift_key, shifted
from freelearn.data.intake.guesses.clocks import WHOSE_ROWS, clocks_in_words, in_order
from freelearn.data.intake.guesses.guessed import NO, WHICH, YES, Answers, ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.joined import DesignGuess
from freelearn.data.intake.guesses.left_open import (
    COLUMN,
    CONSTANTS,
    RECORDED,
    held_open,
    member_key,
    named_samples,
    numbered,
    of_each,
    open_design,
    quantities_given,
    recordings_said,
    sample_keys,
)
from freelearn.data.intake.guesses.recipe_entries import SPELLED, column_entry, listed_files, merge, of_joined, read_of
from freelearn.data.intake.guesses.recipe_text import Path, recipe_lines
from freelearn.data.intake.headings import RUN, split_heading
from freelearn.data.intake.laboratory_units import unit_of
from freelearn.data.intake.readers.raw_table import Place
from freelearn.data.intake.readers.stamps import moment
from freelearn.data.intake.readers.told_elsewhere import Told
from freelearn.data.intake.recipes.recipe import MARKS, READINGS

# Days from the first that spreadsheets count to 1970.
EXCEL_DAYS = 25_569
# A muscle or a braid has two families of fibers.
SECOND = "a braid (McKibben, Festo) has a second family: minus the first angle"


def draft(
    found: Guess, files: Sequence[str] = (), joined: DesignGuess | None = None, answers: Answers | None = None
) -> str:
    """The recipe's text. files: names, where the data are a folder of such files. joined: designs that stand elsewhere.
    answers: by the keys of the questions. What neither guess nor answers know is left blank and marked TODO."""
    made = _Draft(found, files, joined, answers or {})
    made.make()
    head = f"# How {found.name} becomes a measurement table" + (
        "." if answers else ": a guess. Check every line, then run intake with this recipe."
    )
    unused = [c.name for c in found.columns if not c.chosen]
    tail = [f"# Not used: {', '.join(map(repr, unused))}."] if unused else []
    return "\n".join([head, *recipe_lines(made.content, made.remarks), *made.further, *tail]) + "\n"


class _Draft:
    """content: plain values of the recipe; remarks: behind them; further: lines at its end."""

    def __init__(self, found: Guess, files: Sequence[str], joined: DesignGuess | None, answers: Answers) -> None:
        self.found, self.files, self.joined, self.answers = found, files, joined, answers
        self.bed = str(answers.get("bed", found.bed))
        self.content: dict[str, Any] = {}
        self.remarks: dict[Path, str] = {}
        self.further: list[str] = []
        self.clocks = in_order(found, self.answers)
        self.joined_channels = [name for clock in self.clocks[1:] for name in clock.channels]
        # Where the rows of the table stand.
        times = [clock.time for clock in (*self.clocks, *found.clocks)]
        self.place = found.named(times[0]).place if times else Place()
        if self.place.file:
            self.files = (self.place.file,)

    def make(self) -> None:
        """Everything, in the order of the recipe."""
        found = self.found
        self.content["bed"] = self.bed
        if "bed" not in self.answers:
            self.remarks["bed",] = ", ".join(BEDS)
        if not found.recordings and (found.sheet or (read := read_of(self.place))):
            self.content["read"] = {"sheet": found.sheet} if found.sheet else read
        self._samples()
        self._constants()
        given = quantities_given(found)
        if self.clocks and "time_s" in given:
            given["time_s"] = found.named(self.clocks[0].time)
        own = {n: c for n, c in given.items() if c.name not in self.joined_channels and c.place == self.place}
        self.content["columns"] = {name: self._column(("columns", name), name, column) for name, column in own.items()}
        if not given:
            self.remarks["columns",] = "TODO: {force_n: {from: …, unit: N}, …}"
        if "time_s" in own and (origin := origin_of(own["time_s"], self.answers)):
            self.content["columns"]["time_s"]["minus"] = int(origin)
            days = EXCEL_DAYS if self.content["columns"]["time_s"]["unit"] == "day" else 0
            self._remark(("columns", "time_s"), f"time_s counts from {moment(origin - 86_400 * days)} on")
        if self.clocks:
            self._join(given)
        if found.pressures:
            self._members()
        step = found.of("step")
        self.content["step"] = {"from": step.own_name} if step else "derive"
        self.remarks["step",] = "or: derive" if step else "0, 1, … in consecutive rows of one state"
        self._recordings()
        self.content |= {mark: {marked.own_name: 1} for mark in MARKS if (marked := found.of(mark))}
        for doubt in found.doubts:
            self._doubt(doubt)
        if found.recordings:
            self.content["files"] = listed_files(found, self.clocks, self.place, self.answers, bool(self.joined))
            if RECORDED not in self.answers:
                self.remarks["files",] = (
                    "a guess: one recording each; sample: 1, 2, … where they are of several actuators, and what "
                    "differs from one to the other, constants: {gamma_deg: 20}"
                )
        elif self.files:
            self.content["files"] = [{"name": name, "sample": i} for i, name in enumerate(self.files, start=1)]
            self.remarks["files",] = "constants that differ from file to file go here, constants: {gamma_deg: 20}"

    def _samples(self) -> None:
        found, column = self.found, self.found.of("sample")
        if self.joined:
            self.content["sample"] = {"from": self.joined.sample}
            self._design(self.joined)
        elif self.files or (found.recordings and column is None):
            return
        elif column is None and found.perhaps and self.answers.get("sample") == "column":
            words = {word: number for number, word in enumerate(found.perhaps_words, start=1)}
            self.content["sample"] = {"from": found.perhaps, "as": words}
        elif column is None and found.perhaps and "sample" not in self.answers:
            self.content["sample"] = None
            name = repr(found.perhaps)
            self.remarks["sample",] = f"TODO: 1 if all rows are of one actuator; {{from: {name}}} if {name} says which"
        elif column is None:
            self.content["sample"] = 1
            self.remarks["sample",] = "all rows are of one actuator; else {from: COLUMN}"
        else:
            self.content["sample"] = {"from": column.own_name}
            if not numbered(found):
                self.content["sample"]["as"] = {word: number for number, word in sample_keys(found)}

    def _design(self, joined: DesignGuess) -> None:
        where = {"file": joined.file} if joined.file else {"sheet": joined.sheet}
        columns = {}
        for name, (column, factor) in joined.columns.items():
            unit = SPELLED.get(column.unit, column.unit) or None
            columns[name] = {"from": column.name, "unit": unit} | ({} if factor == 1 else {"scale": factor})
            if unit is None:
                self.remarks["design", "columns", name] = f"TODO: its unit (the table's is {unit_of(name)})"
            elif column.quantity == "twist_deg":
                self.remarks["design", "columns", name] = (
                    "taken for the fibers' angle to the axis: a design has no other"
                )
            elif name == "outer_radius_mm" and split_heading(column.name)[0].strip().lower() == "radius":
                self.remarks["design", "columns", name] = "taken for the outer radius; else write inner_radius_mm"
        if joined.unused:
            self.further.append(f"# Not used of the designs: {', '.join(map(repr, joined.unused))}.")
        self.content["design"] = {**where, "by": joined.by, "columns": columns}

    def _constants(self) -> None:
        found, answers = self.found, self.answers
        design = open_design(found, self.joined)
        several = named_samples(found, self.joined, answers) if found.recordings or not self.files else []
        apart = [n for n in design if several and (n == "length_mm" or answers.get("alike") == NO)]
        if apart:
            self.content["samples"] = {}
            self.remarks["samples",] = (
                "what differs from actuator to actuator; or a file of designs: intake … design=FILE"
            )
            for number, word in several:
                of = {name: answers.get(f"design.{name}.{number}") for name in apart}
                self.content["samples"][number] = of
                left = [CONSTANTS[name] for name, value in of.items() if value is None]
                if left:
                    self.remarks["samples", number] = f"TODO: {', '.join(left)} of {word}"
        constants: dict[str, Any] = {}
        same = "; if it differs, under samples" if several else ""
        for name, about in design.items():
            if name in (*apart, *of_each(found, design, answers)):
                continue
            constants[name], remark = self._part(f"design.{name}", found.told(name), about + same)
            if remark:
                self.remarks["constants", name] = remark
            if name == "gamma_deg" and answers.get("braid") == YES and constants[name] is not None:
                constants["gamma2_deg"] = -float(constants[name])
        for name in held_open(found, self.bed):
            constants[name] = answers.get(f"held.{name}")
            if constants[name] is None:
                self.remarks["constants", name] = "TODO: no column says it; 0 if it was held at 0"
        self.content["constants"] = constants
        if "gamma_deg" in constants and "braid" not in answers and "gamma2_deg" not in quantities_given(found):
            self._remark(("constants", "gamma_deg"), f"{SECOND}, as gamma2_deg")

    def _join(self, given: Mapping[str, ColumnGuess]) -> None:
        """The channels of the other clocks, as the recipe joins them by time."""
        lead, *others = self.clocks
        first = self.found.named(lead.time)
        self.content["join"] = []
        if WHOSE_ROWS not in self.answers:
            self.remarks["join",] = f"a guess: {clocks_in_words(self.found, self.clocks)}"
        for number, clock in enumerate(others):
            stamp = self.found.named(clock.time)
            time, path = self._column(("join", number, "time"), "time_s", stamp), ("join", number, "time")
            plus = self.answers.get(shift_key(clock))
            time |= shifted(first, stamp, None if plus is None else float(plus), self.answers)
            if plus is None and (left := clock_open(first, stamp, self.answers)):
                self.remarks[path] = "; ".join(filter(None, [f"TODO: {left}", self.remarks.get(path)]))
            columns = {
                name: self._column(("join", number, "columns"), name, column)
                for name, column in given.items()
                if column.name in clock.channels
            }
            where: dict[str, Any] = {}
            if stamp.place != first.place:
                where = {"file": stamp.place.file} if stamp.place.file else {}
                where |= {"read": read} if (read := read_of(stamp.place)) else {}
            self.content["join"].append({**where, "time": time, "columns": columns})
        if first.blanks:
            self.content["drop"] = [{first.own_name: "blank"}]
            self.remarks["drop",] = f"rows of the other clocks, where {first.own_name!r} has none"

    def _recordings(self) -> None:
        """What makes the table a log, where it is to be one."""
        how = recordings_said(self.found, self.answers)
        if how is None:
            return
        named = self.found.of(RUN)
        self.content[RUN] = {"from": named.own_name} if how == COLUMN and named else how
        if RUN not in self.answers:
            self.remarks[RUN,] = "a guess: a log, each row a sample in time; leave it out where rows are averages"

    def _remark(self, path: Path, text: str) -> None:
        """Says it behind a part of the recipe, after what is said there already."""
        self.remarks[path] = "; ".join(filter(None, [self.remarks.get(path), text]))

    def _column(self, path: Path, name: str, column: ColumnGuess) -> dict[str, Any]:
        entry, remarks = column_entry(column, name, self.answers)
        if name in ("force_n", "moment_nmm") and f"sign.{column.name}" not in self.answers:
            remarks.append("add sign: -1 if a push is negative here" if name == "force_n" else "sign: -1 turns it")
        for names in self.found.open_rivals(self.answers):
            if names[0] == column.name and f"{WHICH}{names[0]}" not in self.answers:
                entry["from"] = None
                remarks.insert(0, f"TODO: from {' or '.join(map(repr, names))}")
        if remarks:
            self._remark(path, f"{name}: {', '.join(remarks)}" if path[-1] == "columns" else "; ".join(remarks))
        return entry

    def _part(self, key: str, told: Told | None, about: str) -> tuple[Any, str]:
        """A part of the design, and what is to be said of it where nobody has answered."""
        if key in self.answers:
            return self.answers[key], ""
        if told is None:
            return None, f"TODO: {about}"
        return (told.value, f"{told.words}: check") if told.unit_said else (None, f"TODO: {about}; {told.words}")

    def _members(self) -> None:
        self.content["members"] = []
        own = of_each(self.found, open_design(self.found, self.joined), self.answers)
        for number, column in enumerate(c for c in self.found.columns if c.name in self.found.pressures):
            pressure, remarks = column_entry(column, "pressure_kpa", self.answers)
            member: dict[str, Any] = {"pressure": pressure}
            if remarks:
                self.remarks["members", number, "pressure"] = "; ".join(remarks)
            for name in own:
                about = f"{CONSTANTS[name]} of the actuator at {column.name}"
                if name == "gamma_deg":
                    about += ", negative for the other sense of winding; of a braid gamma2_deg, too"
                key = member_key(name, number + 1)
                member[name], remark = self._part(key, self.found.told(name, number + 1), about)
                if remark:
                    self.remarks["members", number, name] = remark
            if self.answers.get("braid") == YES and (angle := member.get("gamma_deg")) is not None:
                member["gamma2_deg"] = -float(angle)
            self.content["members"].append(member)

    def _doubt(self, doubt: Doubt) -> None:
        """What an answer, or the likely one, makes of the recipe."""
        answer = str(self.answers.get(doubt.key, doubt.proposed or ""))
        if not answer:
            choices = " | ".join(words for _, words in doubt.options)
            self.further.append(f"# To be decided: {doubt.text} ({choices})")
            return
        changes = dict(doubt.changes.get(answer, {}))
        of_pressures = {self.found.named(name).own_name: more for name, more in changes.pop("pressures", {}).items()}
        members = self.content.get("members")
        for pressure in [m["pressure"] for m in members or ()] or [self._entry("pressure_kpa")]:
            pressure |= of_pressures.get(pressure.get("from"), {})
        if doubt.key not in self.answers:
            for key in changes:
                self.remarks.setdefault((key,), f"a guess: {doubt.text}")
        if len(doubt.of) == 1 and set(doubt.of) <= set(self.joined_channels):
            changes = of_joined(self.found, doubt, changes)
        for name, gap in changes.pop("between", {}).items():
            self._between(name, gap)
        own = {c.name: c.own_name for c in self.found.columns}
        if "drop" in changes:
            changes["drop"] = [{own.get(name, name): test for name, test in one.items()} for one in changes["drop"]]
        for name, more in changes.pop("columns", {}).items():
            merge(self._entry(name, doubt.of), more)
        merge(self.content, changes)

    def _between(self, name: str, gap: float) -> None:
        """A channel of rows of its own, joined by the time of all: the table has the rows in which a load was read."""
        time = self.content["columns"]["time_s"]
        join = {"time": dict(time), "gap_s": gap, "columns": {name: self.content["columns"].pop(name)}}
        self.content.setdefault("join", []).append(join)
        reads = [c.own_name for c in self.found.columns if c.chosen and c.column in READINGS]
        if len(reads) == 1 and {reads[0]: "blank"} not in self.content.get("drop", []):
            merge(self.content, {"drop": [{reads[0]: "blank"}]})

    def _entry(self, name: str, of: Mapping[str, str] | None = None) -> dict[str, Any]:
        """What the recipe says of a column of the table, wherever that stands. of: the columns of the file that are
        meant, of which one may be the time of what is joined."""
        places = [self.content["columns"], *(join["columns"] for join in self.content.get("join", []))]
        if name == "time_s":
            stamps = [clock.time in (of or {}) for clock in self.clocks[1:]]
            places = [
                {name: join["time"]} for join, meant in zip(self.content.get("join", []), stamps, strict=True) if meant
            ] + places
        entry: dict[str, Any] = next((place[name] for place in places if name in place), {})
        return entry
