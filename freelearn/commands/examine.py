"""What a search's findings mean: where the first model fails, what that rules out, what is left, what to measure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.commands.accuracy import Measuring
from freelearn.commands.search_task import Task
from freelearn.inference.accuracy import repeat_scale
from freelearn.inference.before_after import errors_by_set
from freelearn.inference.failures import failures, inputs_of, split_errors
from freelearn.inference.hysteresis import rising_falling
from freelearn.inference.next_experiment import next_states, telling
from freelearn.inference.reciprocity import reciprocity
from freelearn.inference.remainder import remainder
from freelearn.inference.search import Findings
from freelearn.inference.step import Step
from freelearn.inference.testable import assumptions
from freelearn.measurements.error import load_scale
from freelearn.results.discovery import Discovery, document
from freelearn.results.notes import notes as parameter_notes
from freelearn.results.states import state_title

# Standard deviations beyond which a reading is pointed out, and how many places of such are named.
OUTLYING, MOST_STATES = 6.0, 5
# Stated noise that is wrong by more than this factor is said to be.
WRONG_NOISE = 1.5


def examine(task: Task, findings: Findings, measured: Measuring) -> Discovery:
    """All that discovery.json and the pictures hold."""
    settings, seen = task.settings, task.table
    first, last = findings.steps[0], findings.final
    kept = seen[findings.kept].reset_index(drop=True)
    rows, scale = findings.rows, load_scale(findings.rows.loads).numpy()
    inputs = inputs_of(seen)[findings.kept].reset_index(drop=True)
    noise = first.whiten.variance.sqrt().numpy()
    failed = failures(inputs, first.fit.raw_residual.numpy(), scale, noise)
    splits = split_errors(inputs, first.fit.raw_residual.numpy(), scale)
    screens = [
        rising_falling(first.fit.raw_residual, rows.states, rows.state, first.whiten),
        reciprocity(first.fit.residual, first.fit.jacobian, rows.states, first.whiten),
    ]
    several = [c for c in findings.classes if len(c) > 1]
    proposed = [p for c in several for p in next_states(c, task.loaded.table, measured.accuracy)]
    left = None
    if findings.verdict == "unexplained":
        left = remainder(last.fit.residual, last.fit.jacobian, rows.states, last.whiten, last.left.scale)
    notes = [*measured.notes, *assumptions(task.library, seen.columns), *task.loaded.warnings]
    if lost := len(seen) - len(kept):
        notes.append(f"{lost} of {len(seen)} rows have no answer from the base model and were left out")
    notes += _closing_notes(last, findings, kept)
    about: dict[str, Any] = {
        "model": settings.model.name,
        "train": settings.train,
        "given_effects": list(settings.effects),
        "seed": settings.seed,
        "rows": len(kept),
        "accuracy": vars(measured.accuracy),
        "tests": errors_by_set(findings, task.usable, settings.test),
        "splits": splits.to_dict("records"),
        "data": task.loaded.provenance.plain(),
    }
    proposed, twins = telling(proposed)
    notes += twins
    content = document(findings, failed, screens, proposed, left, notes, task.untestable, about)
    states = task.rows.states
    return Discovery(findings, seen, states, measured.accuracy, failed, splits, screens, proposed, left, notes, content)


def _closing_notes(last: Step, findings: Findings, kept: pd.DataFrame) -> list[str]:
    factor = last.left.scale
    # No start to compare with: a search begins each fit where the one before it ended.
    start = torch.full_like(last.fit.vector, torch.nan)
    notes = [note.rstrip(".") for note in parameter_notes(last.fit.model, start)]
    far = np.flatnonzero((last.fit.residual.abs() > OUTLYING * factor).any(-1).numpy())
    if len(far) and findings.verdict != "unexplained":
        # By state and not by row: one bad reading looks like a position error to the other rows of its state.
        where = kept.iloc[far].drop_duplicates(["sample", "twist_deg", "length_mm", "elongation_mm"])
        named = "; ".join(state_title(kept.iloc[[row]]) for row in where.index[:MOST_STATES])
        more = ", among others" if len(where) > MOST_STATES else ""
        notes.append(f"readings more than {OUTLYING:g} σ off the last model, bad ones perhaps, at {named}{more}")
    if not 1 / WRONG_NOISE < factor < WRONG_NOISE:
        size = f"{factor:.2g} times larger" if factor > 1 else f"{1 / factor:.2g} times smaller"
        notes.append(
            f"the scatter is {size} than data.accuracy says; the tests take the scatter as it is, the noise floor is "
            "the stated one: correct data.accuracy, or use data.accuracy=estimate"
        )
    first, others = findings.steps[0].E_new_sample, last.E_new_sample
    if first is not None and others is not None and others > first:
        notes.append(
            f"on samples that were left out of the fit the error rises from {100 * first:.3g} to {100 * others:.3g} %: "
            "what was added may not carry over to other actuators"
        )
    repeats = repeat_scale(kept, findings.rows.state, last.fit.raw_residual, last.whiten)
    if repeats is not None and not 1 / WRONG_NOISE < repeats < WRONG_NOISE:
        notes.append(f"repeats of the same state scatter {repeats:.2g} times as much as data.accuracy says")
    return notes
