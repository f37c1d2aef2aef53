"""What a job does with a file, and the settings that a question of the page amounts to."""

from __future__ import annotations

import json
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rich.console import Console

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import (
    CsvData,
    DataSettings,
    DiscoverSettings,
    IntakeData,
    IntakeSettings,
    TrainSettings,
    VirtualData,
)
from freelearn.api.tasks.fit_and_score import scored_rows
from freelearn.api.tasks.intake_task import PROVENANCE
from freelearn.api.tasks.loaded_table import LoadedTable, load_table
from freelearn.cli.intake_command import take_in
from freelearn.common.errors import UserError
from freelearn.common.files import missing_file, write_text
from freelearn.data.beds import BEDS, INFLATION, bed_of
from freelearn.data.columns import Columns, left_out_rows, members_in, usable_rows
from freelearn.data.intake.guesses.joined import Guessed, guess_and_table
from freelearn.data.logs import is_log, run_numbers
from freelearn.data.sets import set_names, split_rows
from freelearn.data.states import kinematic_state
from freelearn.data.table.faults import TableError
from freelearn.data.table.members_table import read_members
from freelearn.data.table.unit_suspicions import units_apart
from freelearn.workbench.state.question import MUSCLE, OWN, Question

# What a question of the page asks of the commands: settings, as the command line would give them.


def train_settings(question: Question, fits: Path) -> TrainSettings:
    """A fit's settings. Raises UserError."""
    how = [f"split={question.split}", f"fit={question.fit}", f"seed={question.fit_seed}"]
    chosen = settings(TrainSettings, [f"model={question.model}", *how, *_example(question)])
    return replace(
        chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects,
        per_sample=question.per_sample, fits=fits,
    )  # fmt: skip


def discover_settings(question: Question) -> DiscoverSettings:
    """A search's settings. Raises UserError."""
    how = [f"model={question.model}", f"seed={question.fit_seed}"]
    chosen = settings(DiscoverSettings, [*how, *_example(question)])
    return replace(
        chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects,
        per_sample=question.per_sample, ruled_out=question.ruled_out,
    )  # fmt: skip


def _example(question: Question) -> list[str]:
    """The override by which the measured example is the usual table."""
    return [f"data={MUSCLE}"] if question.data == MUSCLE else []


def _data(question: Question, usual: DataSettings) -> DataSettings:
    if question.data == OWN:
        return _measured(question, usual)
    if question.data == "hidden":
        assert isinstance(usual, VirtualData)
        return replace(usual, hidden="random", seed=question.seed)
    return usual


def _measured(question: Question, usual: DataSettings) -> CsvData:
    paths = [Path(name) for name in (question.path, question.members) if name]
    for path in paths:
        if problem := missing_file(path):
            raise UserError(problem)
    if question.members and BEDS[question.bed] is INFLATION:
        raise UserError("An inflation bed measures the diameter of one actuator: take the file of actuators away.")
    accuracy = None
    if question.accuracy is not None:
        assert usual.accuracy is not None
        accuracy = replace(usual.accuracy, **dict(question.accuracy))
    members = paths[1] if question.members else None
    return CsvData(name="csv", path=paths[0], accuracy=accuracy, bed=question.bed, members=members)


# What a job does with a file: reads it as a table, guesses at its columns, or makes a table of it by a recipe.

TABLE, GUESS, MADE = "table.json", "guess.json", "made.json"


def check(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """Reads the table; table.json says what is in it. Where it is none, guess.json says what its columns seem to be.

    Raises UserError where it can be read as neither."""
    for name in (TABLE, GUESS):
        (folder / name).unlink(missing_ok=True)
    if question.path and Path(question.path).is_dir():
        # Files that were dropped together are no table, whatever their columns.
        _write(folder / GUESS, _guess(question) | {"nearly": False})
        return
    data = train_settings(question, fits).data
    assert isinstance(data, CsvData)
    if question.members:
        read_members(question.members)
    try:
        loaded = load_table(data)
    except UserError as fault:
        _write(folder / GUESS, _guessed(question, fault, _beds_that_fit(data)))
        return
    about = _about(loaded)
    if about["unit_warnings"] and question.data == OWN:
        # So that its units can be put right on the page.
        _write(folder / GUESS, _guess(question))
    _write(folder / TABLE, about)


def convert(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """Makes table.csv by the recipe, as `intake.py` does; made.json says of which bed. Raises UserError."""
    out = folder / "table.csv"
    take_in(IntakeSettings(IntakeData(Path(question.path)), Path(question.recipe), out), folder, Console())
    path = out.with_name(f"{out.stem}{PROVENANCE}")
    provenance = json.loads(path.read_text(encoding="utf-8"))
    # The file lies here under another name than the user's.
    write_text(path, json.dumps(provenance | {"uploaded_as": question.name}, indent=1, ensure_ascii=False) + "\n")
    made = {"bed": provenance["bed"], "members": bool(provenance["members"]), "warnings": provenance["warnings"]}
    _write(folder / MADE, made)


def _about(loaded: LoadedTable) -> dict[str, Any]:
    table = loaded.table
    units, others = units_apart(loaded.warnings)
    usable, sample = usable_rows(table), table["sample"].to_numpy()
    labels, names = split_rows(table, 0, by_states=True), set_names(sample)
    return {
        "sets": names,
        "rows": len(table),
        "usable": int(usable.sum()),
        "left_out": int(left_out_rows(table).sum()),
        "samples": int(table["sample"].nunique()),
        "states": int(kinematic_state(table).max()) + 1,
        "recordings": int(run_numbers(table).max()) + 1 if is_log(table) else 0,
        "bed": bed_of(table).name,
        "members": len(members_in(table.columns)),
        # A set of one or two kinematic states has none to hold out.
        "few_states": [name for name in names if not len(scored_rows(sample, labels, name))],
        "warnings": others,
        "unit_warnings": units,
    }


def _beds_that_fit(data: CsvData) -> list[str]:
    """The other beds of which the file is a table without faults."""
    fit = []
    for bed in BEDS:
        try:
            load_table(replace(data, bed=bed))
        except UserError:
            continue
        fit.append(bed)
    return fit


def _guessed(question: Question, fault: UserError, beds: list[str]) -> dict[str, Any]:
    """The guess at a file that is no table because of `fault`, but perhaps one of other beds. Raises UserError where it
    cannot be read at all."""
    try:
        guess = _guess(question)
    except UserError as unread:
        raise (fault if isinstance(fault, TableError) else unread) from None
    other = [f"As a table of the bed {' or '.join(beds)} it has no faults: choose that bed."] if beds else []
    return guess | {"fault": "\n".join([*other, str(fault)]), "nearly": guess["nearly"] or bool(beds)}


def _guess(question: Question) -> dict[str, Any]:
    """What the columns of the file seem to be; nearly: whether it has most of a table's; sheets: the columns of each,
    where several look alike. Raises UserError."""
    found, joined, raw = guess_and_table(Path(question.path), name=question.name)
    needed = Columns(BEDS[question.bed], 1 if question.members else 0)
    named = set(raw.columns) & {*needed.required, *needed.measured}
    nearly = 2 * len(named) >= len(needed.listed)
    sheets = {sheet: _guess_at(question, sheet) for sheet in found.sheets}
    return {"guessed": Guessed(found, joined).plain(), "notes": list(found.notes), "nearly": nearly, "sheets": sheets}


def _guess_at(question: Question, sheet: str) -> dict[str, Any]:
    found, joined, _ = guess_and_table(Path(question.path), name=question.name, wanted=sheet)
    return Guessed(found, joined).plain()


def _write(path: Path, content: dict[str, Any]) -> None:
    write_text(path, json.dumps(content) + "\n")
