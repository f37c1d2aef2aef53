"""One table of few states: searched as discover.py does, and the answer judged by the states between those measured."""

from __future__ import annotations

import signal
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from hidden_effects import few
from hidden_effects.ahead import ahead, of_library

from freelearn.common.csv_text import csv_text
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import BED, BEDS
from freelearn.data.columns import usable_rows
from freelearn.data.error import set_error
from freelearn.data.rows import Rows
from freelearn.data.table.measurement_table import read_table
from freelearn.discovery.checks.look import failed, looked_over
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.search.search import Findings, search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.queries.averages import predictive_shares, weighted_mean
from freelearn.queries.curves.run_curves import step_bands
from freelearn.queries.inverse.miss import NORMAL
from freelearn.testing.reference import other_beds

# A search that takes longer [s] has no answer.
LIMIT = 600


def examine_few(job: dict[str, Any]) -> dict[str, Any]:
    """Makes a table, searches it, and says what came out; all JSON."""
    torch.set_num_threads(1)
    made = few.make(job)
    table = as_read(made.table, made.bed)
    seen = table[usable_rows(table)].reset_index(drop=True)
    question = asked(seen, made.told, job["seed"] % 1000)
    size, alone = sizes(made)
    result = job | {"rows": len(seen), "values": made.hidden, "sizes": size, "alone": alone, "floor": made.floor}
    began = time.perf_counter()
    try:
        with within(LIMIT):
            stopped = [check.name for check in failed(looked_over(seen, build, [], question.accuracy))]
            found = search(question)
    except Exception as problem:  # a failure is a result too
        reason = f"{type(problem).__name__}: {problem}"
        return result | {"verdict": "failed", "reason": reason, "effects": [], "classes": [], "stopped": []} | {
            "fresh": None, "fresh_together": None, "fresh_before": None, "claimed": "", "banded": None,
            "seconds": time.perf_counter() - began,
        }  # fmt: skip
    return result | said(found, stopped) | {
        "fresh": fresh(found.final.fit.model, made), "fresh_together": fresh_together(found, question, made),
        "fresh_before": fresh(found.steps[0].fit.model, made), "banded": banded(found, question, made),
        "seconds": time.perf_counter() - began, "ahead": ahead(found, question, made),
    }  # fmt: skip


def asked(seen: pd.DataFrame, accuracy: Mapping[str, float], seed: int) -> Question:
    """What discover.py asks of a table's usable rows, of all that they can tell. accuracy: in the table's units."""
    rows, built = Rows.from_table(seen), partial(build, samples=sorted(set(seen["sample"])))
    return question_of_rows(built, seen.columns, rows, told(accuracy), seed)


@contextmanager
def within(seconds: int) -> Iterator[None]:
    """Raises TimeoutError where what is inside takes longer."""

    def late(*_: object) -> None:
        raise TimeoutError(f"no answer in {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def said(found: Findings, stopped: Sequence[str]) -> dict[str, Any]:
    """The answer, as discover.py tells it. stopped: checks of the table that let nothing be claimed."""
    if stopped:
        found = replace(found, verdict="undecided")
    return {
        "verdict": found.verdict,
        "claimed": found.claimed,
        "effects": found.effects,
        "classes": [list(members) for members in found.classes],
        "formulas": [p.written.name for p in found.proposals],
        "stopped": list(stopped),
        "E": found.final.E_heldout,
        "told_floor": found.final.floor,
    }


def build(names: Sequence[str], samples: Sequence[int] = (1,)) -> Model:
    """The model that is asked about; few states are those of one tube."""
    return build_model("continuum", {}, names, samples)


def told(accuracy: Mapping[str, float]) -> Accuracy:
    """As the search takes it: of what a bed neither imposes nor measures, what is usual, since nothing is exact."""
    return Accuracy.engineering(**{name: value or other_beds.ACCURACY[name] for name, value in accuracy.items()})


def as_read(table: pd.DataFrame, bed: str) -> pd.DataFrame:
    """The table as a user's file of it is read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "few.csv"
        path.write_text(csv_text(table.drop(columns=BED, errors="ignore")))
        return read_table(path, BEDS[bed]).table


def fresh(model: Model, made: few.Few) -> float:
    """Error of a new measurement between the states, over what its noise alone makes: 1 of a perfect model.

    A row without an answer counts as an answer of zero, which is what a model without one commands."""
    rows = between(made)
    return _floors(_answered(model, rows), rows, made)


def fresh_together(found: Findings, question: Question, made: few.Few) -> float:
    """The same of the mean of all sets that are as good, as `predict` has it with average=true."""
    rows = between(made)
    told = of_library(found, question)
    answers = []
    for each in told:
        model = question.build([*question.given, *each.effects])
        model.set_values(each.parameters)
        answers.append(_answered(model, rows).numpy())
    if not answers:
        return fresh(found.final.fit.model, made)
    states = len(np.unique(question.rows.state))
    shares = predictive_shares([each.probability for each in told], [each.E_heldout for each in told], states)
    mean, _, there = weighted_mean(np.stack(answers), shares)
    last = _answered(found.final.fit.model, rows).numpy()
    return _floors(torch.as_tensor(np.where(there, mean, last)), rows, made)


def banded(found: Findings, question: Question, made: few.Few) -> list[float]:
    """Of a new measurement between the states the share within the answer's 95 % bands, and how wide these are: the
    root mean square of σ as told over that of what is missed."""
    bands, measured = step_bands(found.final, found.rows, question.accuracy), usable(made.fresh, made.bed)
    assert bands is not None
    shown = _answered(found.final.fit.model, measured)
    half = torch.as_tensor(bands.half(measured.states, shown))
    missed = measured.readings.missed(shown)
    there = measured.readings.informative_mask(shown) & half.isfinite() & missed.isfinite()
    inside, (told, lies) = (missed.abs() <= half)[there], (t[there].square().mean().sqrt() for t in (half, missed))
    return [float(inside.double().mean()), float(told / NORMAL / lies)]


def between(made: few.Few) -> Rows:
    """What is true between the states."""
    return usable(made.between, made.bed)


def usable(table: pd.DataFrame, bed: str) -> Rows:
    """The rows of a table that count, as read."""
    table = as_read(table, bed)
    return Rows.from_table(table[usable_rows(table)].reset_index(drop=True))


def _answered(model: Model, rows: Rows) -> torch.Tensor:
    """What the model says, NaN where it has no answer, (N, 2) SI."""
    with torch.no_grad():
        answer = model(rows.states)
    return torch.where((answer.status == Status.OK)[:, None], answer.loads, torch.nan)


def _floors(shown: torch.Tensor, rows: Rows, made: few.Few) -> float:
    missed = set_error(rows, shown.nan_to_num(nan=0.0), torch.ones(len(rows), dtype=torch.bool)).E
    return float(np.hypot(missed, made.floor) / made.floor)


def sizes(made: few.Few) -> tuple[dict[str, float], dict[str, float]]:
    """σ of each hidden effect on the table by the true accuracy: after refitting C1 and C2, and of that what the other
    hidden effects cannot do in its place."""
    tables = {name: as_read(table, made.bed) for name, table in made.without.items()}
    if not tables:
        return {}, {}
    exact = as_read(made.exact, made.bed)
    good = np.all([usable_rows(table) for table in (exact, *tables.values())], axis=0)
    rows = Rows.from_table(exact[good].reset_index(drop=True))
    others = {name: Rows.from_table(table[good].reset_index(drop=True)) for name, table in tables.items()}
    model = build_model("continuum", dict(zip(("C1", "C2"), made.material, strict=True)), [])
    state, readings = torch.as_tensor(rows.state), rows.readings
    felt = readings.present & ~readings.slack[:, None]
    sensitivity = torch.nan_to_num(sensitivities(model, rows.states))
    whiten = Whitener(sensitivity, state, told(made.true), None, rows.states.bed, readings.present)
    jacobian = Problem(model, rows, torch.ones(2).double()).jacobians(model.vector()[None].detach())[0]
    seen = torch.where(felt[:, :, None], jacobian.reshape(len(rows), 2, -1).nan_to_num(), 0.0)
    span = orthonormal(whiten(seen).flatten(0, 1))
    changes = {}
    for name, other in others.items():
        change = torch.where(felt & ~other.readings.slack[:, None], other.readings.value - readings.value, 0.0)
        white = whiten(change).reshape(-1)
        changes[name] = white - span @ (span.T @ white)
    alone = {}
    for name, change in changes.items():
        beside = [other for key, other in changes.items() if key != name]
        taken = orthonormal(torch.stack(beside, dim=1)) if beside else change.new_zeros(len(change), 0)
        alone[name] = float((change - taken @ (taken.T @ change)).norm())
    return {name: float(change.norm()) for name, change in changes.items()}, alone
