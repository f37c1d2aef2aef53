"""What a job does, in a process of its own: the same as the commands with the same settings."""

from __future__ import annotations

import json
import os
import traceback
from dataclasses import asdict, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from freelearn.api.settings.configuration import composed
from freelearn.api.settings.run_settings import PredictSettings, QuestionsData, plan_settings
from freelearn.api.tasks.discover_task import discover
from freelearn.api.tasks.intake_task import actuators_of, asked_of, run_rows
from freelearn.api.tasks.plan_task import planned, write_plan
from freelearn.api.tasks.rubber_intake import rubber_taken_in
from freelearn.api.tasks.train_task import train
from freelearn.cli.comparing import compare
from freelearn.cli.gathering import gather_folders
from freelearn.cli.run_commands import predict
from freelearn.cli.specimen_fits import compare_specimens, fit_specimens
from freelearn.cli.sweep_job import sweep_job
from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes, write_text
from freelearn.common.formats import error_in_words
from freelearn.common.progress import watched
from freelearn.data.columns import Columns
from freelearn.data.intake.guesses.joined import Guessed, guess_and_table
from freelearn.data.intake.rubber.rubber_guess import guess_tests, plain_tests
from freelearn.data.specimen_table import read_specimens
from freelearn.data.table.questions import read_questions
from freelearn.discovery.fits.step import Step
from freelearn.records.sweep_records import collect
from freelearn.report.terminal.fit_progress import Epochs
from freelearn.workbench.state.proposed import proposed
from freelearn.workbench.state.question import Question, named, quoted_value
from freelearn.workbench.state.reading import check, convert, discover_settings, train_settings

# Imported here so that the process from which jobs are forked has them: a fit then starts at once.
from freelearn.discovery.residuals import failures  # noqa: F401  isort:skip
from freelearn.report.plots import discovery_plots  # noqa: F401  isort:skip
from freelearn.report.html import run_report  # noqa: F401  isort:skip
from freelearn.report.html.discovery_report import report_discovery  # noqa: F401  isort:skip


def work(kind: str, question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """Does one job and tells `pipe` of it: ("progress", fields), then ("done", "") or ("failed", message)."""
    # Whatever is printed belongs to the job, not to the terminal of the page.
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "log.txt", "w", encoding="utf-8") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            # Nothing is run but what a search of this session wrote.
            own = [str(proposed(Path(path), folder.parent).path) for path in question.own]
            with named(own):
                JOBS[kind](question, folder, fits, pipe)
            pipe.send(("done", ""))
        except UserError as mistake:
            pipe.send(("failed", str(mistake)))
        except Exception as problem:
            traceback.print_exc()
            text = f"{type(problem).__name__}: {problem} (more in {folder / 'log.txt'})"
            pipe.send(("failed", text))


def _train(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    settings = train_settings(question, fits)
    most = settings.fit.max_epochs if settings.fit else 1

    def tell(epoch: int, fitted: float, validation: float) -> None:
        text = f"epoch {epoch}: E {100 * fitted:.3g} %"
        if validation != fitted:
            text += f", validation {100 * validation:.3g} %"
        pipe.send(("progress", {"text": text, "share": epoch / most}))

    train(settings, folder, command=question.command("train"), progress=lambda: Epochs(tell))


def _discover(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    reached = ""

    def watch(step: Step, text: str) -> None:
        nonlocal reached
        reached = f"{text}: E held-out {error_in_words(step.E_heldout)}. Now "

    def tell(words: str, done: int, total: int) -> None:
        pipe.send(("progress", {"text": f"{reached}{words}", "share": done / total}))

    with open(folder / "discovery.txt", "w", encoding="utf-8") as file:
        console = Console(file=file, width=110)
        with watched(tell):
            discover(discover_settings(question), folder, console, question.command("discover"), watch)


def _asks(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """asks.json says whether the file is a table of questions, or else what it seems to hold."""
    asked = Path(question.asks)
    try:
        read_questions(asked, Columns.from_table(pd.read_csv(run_rows(Path(question.run)))))
        about: dict[str, Any] = {"table": True}
    except UserError:
        found, joined, _ = guess_and_table(asked, name=question.name, by_time=False)
        known = asdict(actuators_of(Path(question.run)))
        about = {"table": False, "guessed": Guessed(found, joined).plain(), "known": known}
    write_text(folder / "asks.json", json.dumps(about) + "\n")


def _predict(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    pipe.send(("progress", {"text": "answering"}))
    asks = Path(question.asks)
    if question.recipe:
        known = actuators_of(Path(question.run))
        asks = asked_of(asks, Path(question.recipe), known, folder / "questions.csv").path
    settings = PredictSettings(run=Path(question.run), data=QuestionsData(asks))
    with open(folder / "answers.txt", "w", encoding="utf-8") as file:
        predict(settings, folder, Console(file=file, width=110))


def _plan(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    pipe.send(("progress", {"text": "choosing rows"}))
    write_plan(planned(plan_settings({"run": question.run, "rows": question.rows})), folder, figures=False)


def _tests(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    tests = guess_tests({name: read_bytes(path) for name, path in question.sheets})
    write_text(folder / "tests.json", json.dumps(plain_tests(tests)) + "\n")


def _rubber(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    pipe.send(("progress", {"text": "comparing energies" if not question.effects else "fitting"}))
    files = {name: Path(path) for name, path in question.sheets}
    made = rubber_taken_in(files, Path(question.recipe), folder / "tests.csv")
    data = read_specimens([str(made.path)])
    with open(folder / "rubber.txt", "w", encoding="utf-8") as file:
        console = Console(file=file, width=100)
        if question.effects:
            fit_specimens(data, question.effects, (), folder, console)
        else:
            compare_specimens(data, folder, console, best=True)


def _compare(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    with open(folder / "compare.txt", "w", encoding="utf-8") as file:
        compare(Path(question.run), Path(question.beside), folder / "comparison.html", Console(file=file, width=110))


def _study(question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """As a multirun: each job in a folder of its own, which is found again; then all are gathered."""
    pairs = [(m, t) for m in question.models for t in question.trains if m == "continuum" or t != "constituent"]
    command = question.command("study")
    with open(folder / "study.txt", "w", encoding="utf-8") as file:
        for number, (model, train) in enumerate(pairs):
            share = {"share": number / len(pairs)}
            pipe.send(("progress", {"text": f"{model} on {train}, {number + 1} of {len(pairs)} fits", **share}))
            one = replace(question, model=model, train=train)
            words = [*one.overrides("train"), "figures=false", f"fits={quoted_value(str(fits))}"]
            place = folder / str(number)
            place.mkdir(exist_ok=True)
            sweep_job(composed("train", words), number, place, command)
        failed = gather_folders([folder], folder, Console(file=file, width=110), command)
    if failed == len(pairs):
        raise UserError(str(collect([folder])["error"].iloc[0]))


JOBS = {
    "check": check, "convert": convert, "train": _train, "discover": _discover, "predict": _predict, "plan": _plan,
    "asks": _asks, "compare": _compare, "study": _study, "tests": _tests, "rubber": _rubber,
}  # fmt: skip
