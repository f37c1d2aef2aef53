"""What a search's findings mean: where the first model fails, what that rules out, what is left, what to measure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch

from freelearn.api.tasks.preparation import Measuring
from freelearn.api.tasks.search_task import Task
from freelearn.data.columns import LEFT_OUT, left_out_rows
from freelearn.data.error import load_scale
from freelearn.data.logs import is_log
from freelearn.data.sets import samples_of
from freelearn.discovery.checks.look import failed as failing
from freelearn.discovery.checks.table_check import TableCheck
from freelearn.discovery.fits.estimated_accuracy import repeat_scale
from freelearn.discovery.fits.step import Step
from freelearn.discovery.proposals.unknown_function import unknown
from freelearn.discovery.residuals.failures import failures, inputs_of, split_errors
from freelearn.discovery.residuals.hysteresis import rising_falling
from freelearn.discovery.residuals.reciprocity import reciprocity
from freelearn.discovery.residuals.residual_summary import summarize_residuals
from freelearn.discovery.search.before_after import errors_by_set
from freelearn.discovery.search.measuring_order import DRIFT, telling_repeat
from freelearn.discovery.search.next_states import NextState, next_states, telling
from freelearn.discovery.search.search import Findings
from freelearn.discovery.search.set_pressures import level_notes
from freelearn.discovery.search.testable import assumptions
from freelearn.queries.curves.run_curves import search_curves, search_predictions
from freelearn.queries.next_measurements.next_recordings import next_recordings
from freelearn.records.discovery import Discovery, document, rise_notes, unshown_notes
from freelearn.records.estimates import notes as parameter_notes
from freelearn.records.sampling import sampling_notes
from freelearn.records.suspected_readings import flagged, suspected_readings
from freelearn.records.verdict_words import WRONG_NOISE, noise_notes
from freelearn.records.written_effects import ProposalCurve


def examine(task: Task, findings: Findings, measured: Measuring, checks: Sequence[TableCheck] = ()) -> Discovery:
    """All that discovery.json and the pictures hold. checks: of the table, before the search."""
    settings, seen = task.settings, task.table
    first, last = findings.steps[0], findings.final
    kept = seen[findings.kept].reset_index(drop=True)
    rows = findings.rows
    inputs = inputs_of(seen)[findings.kept].reset_index(drop=True)
    noise = first.whiten.variance.sqrt().numpy()
    suspects = suspected_readings(findings.suspects, seen, task.loaded.lines[task.place])
    # A slipped reading says nothing of where the model fails.
    trusted = (flagged(seen, findings.suspects)[findings.kept][LEFT_OUT] == 0).to_numpy()
    scale = load_scale(rows.loads[torch.tensor(trusted)]).numpy()
    told = torch.where(rows.readings.present, first.fit.raw_residual, torch.nan)
    inputs, raw = inputs[trusted].reset_index(drop=True), told.numpy()[trusted]
    bed = rows.states.bed
    failed = failures(inputs, raw, scale, noise[trusted], bed)
    splits = split_errors(inputs, raw, scale, bed)
    screens = [
        rising_falling(first.fit.raw_residual, rows.states, rows.state, first.whiten),
        reciprocity(first.fit.residual, first.fit.jacobian, rows.states, first.whiten),
    ]

    def shown(steps: Mapping[str, Step]) -> dict[str, Step]:
        """Without what no state tells by itself: it is told what rows would."""
        return {name: step for name, step in steps.items() if not set(step.effects) & set(task.unshown)}

    several = [alike for alike in map(shown, findings.classes) if len(alike) > 1]
    recorded = is_log(kept)

    def next_of(alike: Mapping[str, Step]) -> list[NextState]:
        if recorded:
            return next_recordings(alike, kept, rows)
        return next_states(alike, task.loaded.table, measured.accuracy)

    proposed = [p for alike in several for p in next_of(alike)]
    if not proposed and len(rivals := shown(findings.rivals)) > 1:
        proposed = next_of(rivals)
    repeats = [telling_repeat(last, rows, name, measured.accuracy) for name in findings.sorted_by]
    proposed += repeats
    left = None
    if findings.verdict == "unexplained":
        left = summarize_residuals(last.fit.residual, last.fit.jacobian, rows.states, last.whiten, last.left.scale)
    notes = [*measured.notes, *assumptions(task.library, seen.columns), *task.loaded.warnings]
    if lost := len(seen) - len(kept):
        notes.append(f"{lost} of {len(seen)} rows have no answer from the base model and were left out")
    looked_at = task.loaded.table["sample"].isin(samples_of(settings.train, task.loaded.table["sample"].to_numpy()))
    if left_out := int(left_out_rows(task.loaded.table)[looked_at].sum()):
        notes.append(f"rows that are marked to be left out: {left_out}")
    notes += [note.rstrip(".") for note in sampling_notes(last.fit.model, kept)]
    looked = task.rows
    untold = looked.readings.present & ~looked.told().readings.present
    if dark := int(untold.any(-1).sum()):
        notes.append(
            f"what was read in {dark} of {len(seen)} rows, right after a move of which too few rows tell when it began "
            "and ended, was left out: record more rows a second"
        )
    notes += level_notes(rows)
    notes += unshown_notes(findings, task.unshown)
    notes += _closing_notes(last, findings, task.settings.data.accuracy is not None)
    stopping = failing(checks)
    if stopping and not settings.checks:
        notes.append(f"checks=off overrules a look at the table: {' '.join(check.says for check in stopping)}")
        stopping = []
    about: dict[str, Any] = {
        "model": settings.model.name,
        "train": settings.train,
        "given_effects": list(settings.effects),
        "unshown": dict(task.unshown),
        "per_sample": settings.per_sample,
        "seed": settings.seed,
        "rows": len(kept),
        "left_out": left_out,
        "accuracy": vars(measured.accuracy),
        "tests": errors_by_set(findings, task.usable, settings.test),
        "splits": splits.to_dict("records"),
        "data": task.loaded.provenance.plain(),
        "checks": [check.plain() for check in checks],
    }
    proposed, twins = telling(proposed, "recording" if recorded else "state")
    notes += twins
    content = document(findings, failed, screens, proposed, left, suspects, notes, task.untestable, about, stopping)
    predictions = search_predictions(findings, seen, task.rows.states)
    curves = search_curves(findings, predictions["before"], task.rows.states, measured.accuracy, settings.bands)
    return Discovery(
        findings, predictions, curves, failed, splits, screens, proposed, left, notes, content, suspects,
        _unknowns(task, findings),
    )  # fmt: skip


def _unknowns(task: Task, findings: Findings) -> dict[str, ProposalCurve]:
    """What the data say of each written function without its form, where they can."""
    found = {}
    for proposal in findings.proposals:
        effects = proposal.step.effects
        curve = unknown(proposal, findings.rows, lambda more, effects=effects: task.build([*effects, *more]))  # type: ignore[misc]
        if curve is not None:
            found[proposal.written.name] = ProposalCurve.from_unknown(proposal.written, curve)
    return found


def _closing_notes(last: Step, findings: Findings, stated: bool) -> list[str]:
    # No start to compare with: a search begins each fit where the one before it ended.
    start = torch.full_like(last.fit.vector, torch.nan)
    notes = [note.rstrip(".") for note in parameter_notes(last.fit.model, start)]
    notes += noise_notes(last, stated)
    notes += [
        f"the states were measured in the order of {name}: the data cannot tell {DRIFT} from something that depends on "
        f"{name}; measure one of the first states once more at the end"
        for name in findings.sorted_by
    ]
    notes += rise_notes(findings)
    first, others = findings.steps[0].E_new_sample, last.E_new_sample
    if first is not None and others is not None and others > first:
        notes.append(
            f"on samples that were left out of the fit the error rises from {100 * first:.3g} to {100 * others:.3g} %: "
            "what was added may not carry over to other actuators"
        )
    repeats = repeat_scale(last.fit.raw_residual, findings.rows, last.whiten)
    if repeats is not None and not 1 / WRONG_NOISE < repeats < WRONG_NOISE:
        said = "data.accuracy says" if stated else "was estimated"
        notes.append(f"repeats of the same state scatter {repeats:.2g} times as much as {said}")
    return notes
