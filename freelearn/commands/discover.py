"""`python discover.py`: from a composed configuration to a verdict and its evidence."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from rich.console import Console

from freelearn.commands.job import job_key
from freelearn.commands.tables import load_table
from freelearn.commands.train import load_own_effects, seal
from freelearn.errors import UserError
from freelearn.files import write_text, write_whole
from freelearn.inference.accuracy import estimate, repeat_scale
from freelearn.inference.before_after import errors_by_set
from freelearn.inference.candidate import Candidate, StepRecord
from freelearn.inference.failures import failures, inputs_of, split_errors
from freelearn.inference.hysteresis import rising_falling
from freelearn.inference.next_experiment import next_states
from freelearn.inference.noise import sensitivities
from freelearn.inference.prepare import prepare
from freelearn.inference.question import Question
from freelearn.inference.reciprocity import reciprocity
from freelearn.inference.remainder import remainder
from freelearn.inference.search import Findings, Watch, search
from freelearn.inference.step import Step, record
from freelearn.inference.testable import assumptions, candidates
from freelearn.measurements.accuracy import PAPER, Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Rows
from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import States, kinematic_state, measured_loads
from freelearn.models.base import Model
from freelearn.models.build import build_model, save_checkpoint
from freelearn.models.effects.check import check_effects
from freelearn.render.terminal.discovery import DiscoveryView
from freelearn.results.discovery import Discovery, document
from freelearn.results.fit_report import notes as parameter_notes
from freelearn.results.run_files import check_folder
from freelearn.results.states import state_title
from freelearn.threads import one_thread
from freelearn.units import DEG, MM, NMM

PROGRESS = "progress.json"
# Standard deviations beyond which a reading is pointed out, and how many places of such are named.
OUTLYING, MOST_STATES = 6.0, 5
# Stated noise that is wrong by more than this factor is said to be.
WRONG_NOISE = 1.5


def discover(
    settings: dict[str, Any], folder: Path, console: Console, command: str = "", watch: Watch | None = None
) -> Discovery:
    """Everything that `python discover.py` does, from plain settings (see conf/discover.yaml).

    command: the shell command that repeats it, for the report. watch: told of each step. Raises UserError.
    """
    one_thread()
    check_folder(folder)
    if settings["fit"]["name"] != "levenberg_marquardt":
        raise UserError(f"discover.py fits by levenberg_marquardt; fit={settings['fit']['name']} belongs to train.py.")
    load_own_effects()
    table, warnings, provenance = load_table(settings["data"])
    seal(settings["data"], folder)
    members = samples_of(str(settings["train"]), table["sample"].to_numpy())
    usable = (table["buckled"] == 0).to_numpy()
    place = np.flatnonzero(np.isin(table["sample"], members) & usable)
    if not len(place):
        raise UserError(f"Training set {settings['train']!r} has no un-buckled rows: choose another one.")
    # Told from the whole table: buckled rows belong to a state and to what it remembers.
    everything = Rows(States.from_table(table), measured_loads(table), kinematic_state(table))
    rows = everything[torch.as_tensor(place)]
    seen = table.iloc[place].reset_index(drop=True)

    values = {k: float(v) for k, v in settings["model"].items() if k != "name"}
    name = settings["model"]["name"]

    samples = [int(n) for n in np.unique(seen["sample"])]

    def build(effects: Sequence[str]) -> Model:
        return build_model(name, values, effects, samples)

    given = list(settings["effects"] or [])
    library, untestable = candidates(build(given), given, table.columns, rows)
    for effect in [*given, *library]:
        alone = build([effect])
        check_effects(alone.effects, alone.values(), rows.states)
    if 2 * len(rows) < 4 * (len(build(given).vector()) + 1):
        raise UserError(f"{len(rows)} usable rows are too few to look for a missing effect: measure more.")
    view = DiscoveryView(console, f"{name} on {settings['train']}", bool(provenance["simulated"]))
    accuracy, notes = _accuracy(settings["data"]["accuracy"], build, rows, int(settings["seed"]), given)
    key = job_key(settings)
    past = _progress(folder, key)

    def step(found: Step, text: str) -> None:
        view.step(found, text)
        if watch:
            watch(found, text)

    def keep(steps: Sequence[Step]) -> None:
        write_text(folder / PROGRESS, json.dumps({"key": key, "steps": [record(s) for s in steps]}) + "\n")

    notes += assumptions(library, table.columns)
    question = Question(build, library, rows, accuracy, int(settings["seed"]), given)
    with view:
        findings = search(question, past, step, keep)
    whole = everything[torch.as_tensor(np.flatnonzero(usable))]
    tests = errors_by_set(findings, whole, str(settings["test"]))
    discovery = _examine(
        findings, seen, rows.states, table, tests, accuracy, [*notes, *warnings], untestable, settings, provenance
    )
    _write(discovery, folder, key)
    if settings["figures"]:
        # matplotlib costs a second to import: only when there is something to draw.
        from freelearn.render.png.discovery import draw_discovery

        draw_discovery(discovery, folder, bool(provenance["simulated"]))
    from freelearn.render.html.discovery import report_discovery

    report_discovery(discovery, folder, command, settings["figures"])
    view.end(discovery, folder)
    return discovery


def _accuracy(stated: Any, build: Any, rows: Rows, seed: int, given: list[str]) -> tuple[Accuracy, list[str]]:
    if isinstance(stated, dict):
        return Accuracy.from_settings(stated), []
    if stated != "estimate":
        raise UserError(
            f"data.accuracy = {stated!r}: give data.accuracy.force_n=… and so on, or data.accuracy=estimate."
        )
    prepared, base = prepare(Question(build, [], rows, PAPER, seed, given))
    fit, part = base.fit, prepared.rows
    sensitivity = sensitivities(fit.model, part.states)
    found = estimate(fit.raw_residual, fit.raw_jacobian, sensitivity, part.states, part.state, PAPER)
    note = (
        f"accuracy estimated from the scatter: elongation {found.length / MM:.3g} mm and twist "
        f"{found.twist / DEG:.3g}° per state (their ratio is the paper's), "
        f"force {found.force:.3g} N, moment {found.moment / NMM:.3g} N·mm"
    )
    return found, [note]


def _examine(
    findings: Findings,
    seen: pd.DataFrame,
    states: States,
    table: pd.DataFrame,
    tests: dict[str, dict[str, float]],
    accuracy: Accuracy,
    notes: list[str],
    untestable: list[Candidate],
    settings: dict[str, Any],
    provenance: dict[str, Any],
) -> Discovery:
    """What the findings mean: where the base model fails, screens, what to measure next, what is left."""
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
    proposed = [p for c in findings.classes if len(c) > 1 for p in next_states(c, table, accuracy)]
    left = None
    if findings.verdict == "unexplained":
        left = remainder(last.fit.residual, last.fit.jacobian, rows.states, last.whiten, last.left.scale)
    lost = len(seen) - len(kept)
    if lost:
        notes = [*notes, f"{lost} of {len(seen)} rows have no answer from the base model and were left out"]
    notes = [*notes, *_closing_notes(last, findings, kept)]
    about = {
        "model": settings["model"]["name"],
        "train": str(settings["train"]),
        "given_effects": list(settings["effects"] or []),
        "seed": settings["seed"],
        "rows": len(kept),
        "accuracy": vars(accuracy),
        "tests": tests,
        "splits": splits.to_dict("records"),
        "data": provenance,
    }
    content = document(findings, failed, screens, proposed, left, notes, untestable, about)
    return Discovery(findings, seen, states, accuracy, failed, splits, screens, proposed, left, notes, content)


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
            f"the scatter is {size} than data.accuracy says; the tests take the scatter as found, the noise floor is "
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


def _progress(folder: Path, key: str) -> list[StepRecord]:
    """Steps that an interrupted run of the same question left."""
    try:
        content = json.loads((folder / PROGRESS).read_text(encoding="utf-8"))
        return content["steps"] if content["key"] == key else []
    except (OSError, ValueError, KeyError):
        return []


def _write(discovery: Discovery, folder: Path, key: str) -> None:
    findings = discovery.findings
    for name, table in discovery.predictions.items():
        _write_table(table, folder / f"predictions_{name}.csv")
    _write_table(discovery.splits, folder / "splits.csv")
    save_checkpoint(findings.final.fit.model, folder / "checkpoint.ckpt")
    write_text(
        folder / "discovery.json", json.dumps(discovery.content | {"key": key}, indent=2, allow_nan=False) + "\n"
    )
    (folder / PROGRESS).unlink(missing_ok=True)


def _write_table(table: pd.DataFrame, path: Path) -> None:
    write_whole(path, lambda p: table.to_csv(p, index=False, float_format="%.10g"))
