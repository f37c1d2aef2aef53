"""`discover`: from settings to a verdict and its evidence."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console

from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.examine import examine
from freelearn.api.tasks.loaded_table import job_key, load_table, seal
from freelearn.api.tasks.preparation import Measuring, Mistakes, check_numbers, estimated, known_model, resolve_device
from freelearn.api.tasks.search_task import Task, checked
from freelearn.common.cores import configure_runtime
from freelearn.common.csv_text import csv_text
from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.common.progress import watched
from freelearn.data.accuracy import PAPER
from freelearn.data.columns import RISEN, usable_rows
from freelearn.data.rows import Rows
from freelearn.data.sets import samples_of
from freelearn.discovery.checks.look import failed, useless
from freelearn.discovery.fits.journal import Entry, Journal, kept_in
from freelearn.discovery.fits.prepare import prepare
from freelearn.discovery.fits.step import Step, not_testable
from freelearn.discovery.referee.case import CANNOT, Check
from freelearn.discovery.search.first_rows import marked, risen
from freelearn.discovery.search.search import Watch, search
from freelearn.discovery.search.testable import candidates
from freelearn.fitting.options import LEVENBERG_MARQUARDT, NORMAL
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import check_model, save_checkpoint
from freelearn.physics.models.own_files import load_own_code
from freelearn.records.claims import write_referee
from freelearn.records.discovery import Discovery
from freelearn.records.provenance import Provenance, with_digests
from freelearn.records.run_files import begin_results, check_folder
from freelearn.records.suspected_readings import write_suspects
from freelearn.records.written_effects import known, write_proposals

# progress.json: the fits of a search that has not ended, from which it is taken up again.


class Progress:
    """The file in a search's folder. key: digest of all that the search's results depend on."""

    def __init__(self, folder: Path, key: str) -> None:
        self.path, self.key = folder / "progress.json", key

    def journal(self) -> Journal:
        """What an interrupted search of the same question left, and whatever is added to it kept in the file.

        A file that is damaged, or of another question, holds nothing."""
        return Journal(self._read(), self._keep)

    def end(self) -> None:
        """The search has ended: nothing is to be taken up."""
        self.path.unlink(missing_ok=True)

    def _read(self) -> list[Entry]:
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            entries: list[Entry] = content["fits"]
            return entries if content["digest"] == self._digest(entries) else []
        except (OSError, ValueError, KeyError, TypeError):
            return []

    def _keep(self, entries: Sequence[Entry]) -> None:
        write_text(self.path, json.dumps({"digest": self._digest(entries), "fits": entries}) + "\n")

    def _digest(self, entries: Sequence[Entry]) -> str:
        """Of the question and the fits: a number that was changed on the disk would lead elsewhere."""
        return hashlib.sha256((self.key + json.dumps(entries)).encode()).hexdigest()


def discover(
    settings: DiscoverSettings,
    folder: Path,
    console: Console | None = None,
    command: str = "",
    watch: Watch | None = None,
) -> Discovery:
    """Searches for the missing effects and writes what came out to `folder`. Raises UserError.

    console: where the steps and the answer are shown. command: the shell command that repeats it, for the report.
    watch: told of each step.
    """
    console = console or Console(quiet=True)
    configure_runtime()
    task = _prepared(settings, folder)
    provenance = task.loaded.provenance
    # The table of steps grows while the search runs.
    from freelearn.report.terminal.printed_discovery import DiscoveryView, show_checks

    key = job_key(settings)
    progress = Progress(folder, key)

    def step(reached: Step, text: str) -> None:
        view.step(reached, text)
        if watch:
            watch(reached, text)

    checks = checked(task)
    show_checks(console, checks, not settings.checks)
    said = [check.says for check in failed(checks)]
    view = DiscoveryView(console, f"{settings.model.name} on {settings.train}", provenance.simulated, said)
    with view, kept_in(progress.journal()), watched(view.doing):
        measured = _measuring(task)
        task = _begun(task, measured)
        lost = useless(checks) if settings.checks else None
        reason = None if lost is None else Check(lost.name, CANNOT, None, None, lost.says)
        findings = search(task.question(measured.accuracy), step, reason)
    if settings.checks and failed(checks):
        findings = replace(findings, verdict="undecided", claimed="undecided")
    # What the search wrote in this run counts as an effect until the run ends.
    with known(findings):
        discovery = examine(task, findings, measured, checks)
        _write(discovery, folder, key)
        # Pictures take seconds, for which nobody has to wait who reads the answer.
        view.answer(discovery)
        _show(discovery, folder, command, settings.figures, provenance.simulated)
        progress.end()
        view.end(folder)
    return discovery


def _prepared(settings: DiscoverSettings, folder: Path) -> Task:
    """Everything that can be wrong before a search, checked. Raises UserError with all of it."""
    load_own_code()
    mistakes = Mistakes()
    mistakes.check(lambda: known_model(settings))
    device = mistakes.check(lambda: resolve_device(settings.device))
    mistakes.check(lambda: _check_fit(settings))
    mistakes.check(lambda: _check_ruled_out(settings))
    mistakes.check(lambda: check_folder(folder))
    mistakes.tell()
    assert device is not None
    loaded = load_table(settings.data)
    seal(settings.data, folder)
    table = loaded.table
    sample = table["sample"].to_numpy()
    members = mistakes.check(lambda: samples_of(settings.train, sample))
    if settings.test != "every":
        mistakes.check(lambda: samples_of(settings.test, sample))
    mistakes.tell()
    place = np.flatnonzero(np.isin(sample, [] if members is None else members) & usable_rows(table))
    if not len(place):
        raise UserError(
            f"Training set {settings.train!r} has no rows to look at, all are buckled or left out: choose another one."
        )
    everything = Rows.from_table(table)
    task = Task(settings, loaded, everything, place, [], [], {}, device)
    base = task.build(settings.effects)
    check_numbers(task.known, base)
    library, untestable, unshown = candidates(base, settings.effects, table.columns, task.rows)
    if not settings.per_sample:
        untestable += [
            not_testable(name, "per_sample=false says that all actuators are alike")
            for name in library
            if EFFECTS[name].compares
        ]
        library = [name for name in library if not EFFECTS[name].compares]
    known = {candidate["effect"] for candidate in untestable}
    absent = [name for name in settings.ruled_out if name not in known]
    untestable += [not_testable(name, "ruled out: it is known to be absent") for name in absent]
    library = [name for name in library if name not in settings.ruled_out]
    unshown = {name: needs for name, needs in unshown.items() if name not in settings.ruled_out}
    check_model(base, task.rows.states)
    for effect in [*settings.effects, *library]:
        alone = task.build([effect])
        check_effects(alone.effects, alone.values(), task.rows.states)
    return Task(settings, loaded, everything, place, library, untestable, unshown, device)


def _check_fit(settings: DiscoverSettings) -> None:
    if settings.fit is None or settings.fit.name != LEVENBERG_MARQUARDT:
        name = settings.fit.name if settings.fit else "none"
        raise UserError(f"discover.py fits by {LEVENBERG_MARQUARDT}; fit={name} belongs to train.py.")
    if settings.fit.intervals != NORMAL:
        raise UserError(
            f"discover.py tells {NORMAL} intervals; fit.intervals={settings.fit.intervals} belongs to train.py, which "
            "fits the model that was found with its effects=[…]."
        )


def _check_ruled_out(settings: DiscoverSettings) -> None:
    for name in settings.ruled_out:
        if name not in EFFECTS:
            raise UserError(f"ruled_out names the unknown effect {name!r}: choose among {', '.join(EFFECTS)}.")
        if name in settings.effects:
            raise UserError(f"{name} is in effects and in ruled_out: leave it out of one of them.")


def _measuring(task: Task) -> Measuring:
    """The stated accuracy, or an estimate from the residuals of the model before anything is added."""
    stated = task.settings.data.accuracy
    if stated is not None:
        return Measuring(stated.si(task.rows.states.bed), [])
    prepared, fit, _ = prepare(replace(task.question(PAPER), candidates=[]))
    return estimated(fit, prepared.rows)


def _begun(task: Task, measured: Measuring) -> Task:
    """With first rows under pressure marked as reached by rising pressure, where that explains the rows better and the
    table does not say."""
    loaded = task.loaded
    if RISEN in loaded.table or not risen(task.question(measured.accuracy)):
        return task
    table = marked(loaded.table)
    says = (
        "states begin under pressure, and what depends on its direction shows in their first rows as if it had risen "
        f"to there: they were taken so; where that is wrong, say so by a column {RISEN}, 0 or 1"
    )
    loaded = replace(loaded, table=table, warnings=(*loaded.warnings, says))
    return replace(task, loaded=loaded, everything=Rows.from_table(table))


def _show(discovery: Discovery, folder: Path, command: str, figures: bool, simulated: bool) -> None:
    """Pictures and the report."""
    if figures:
        # matplotlib costs a second to import: only when there is something to draw.
        from freelearn.report.plots.discovery_plots import draw_discovery

        draw_discovery(discovery, folder, simulated)
    # Bokeh likewise: not before there are results.
    from freelearn.report.html.discovery_report import report_discovery

    report_discovery(discovery, folder, command, figures)


def _write(discovery: Discovery, folder: Path, key: str) -> None:
    findings = discovery.findings
    begin_results(folder, "discovery.json")
    for name, table in discovery.predictions.items():
        _write_table(table, folder / f"predictions_{name}.csv")
    _write_table(discovery.splits, folder / "splits.csv")
    save_checkpoint(findings.final.fit.model, folder / "checkpoint.ckpt")
    if findings.verdict == "proposed":
        write_proposals(findings.proposals, discovery.content["model"], findings.noise_floor, folder)
    write_referee(findings, folder)
    write_suspects(discovery.suspects, Provenance.from_plain(discovery.content["data"]), folder)
    tables = [f"predictions_{name}.csv" for name in discovery.predictions]
    whole = with_digests(discovery.content | {"key": key}, folder, [*tables, "checkpoint.ckpt"])
    write_text(folder / "discovery.json", json.dumps(whole, indent=2, allow_nan=False) + "\n")


def _write_table(table: pd.DataFrame, path: Path) -> None:
    write_text(path, csv_text(table))
