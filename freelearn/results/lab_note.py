"""A result in one paragraph, to be pasted into a laboratory's notebook."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from freelearn.package import VERSION
from freelearn.results.discovery import Discovery, final_estimates
from freelearn.results.discovery_tables import error_line, failure_lines
from freelearn.results.estimate import Estimate
from freelearn.results.formats import error_percent, number, percent
from freelearn.results.origin import Origin, Provenance
from freelearn.results.run import Run
from freelearn.results.run_scores import scores
from freelearn.results.run_tables import misfit_lines

# Of a training set of many samples each may have its own value of a parameter.
MOST_PARAMETERS = 8


def run_note(run: Run, origin: Origin) -> str:
    """What was fitted on what, the parameters, the errors, and where it fails most."""
    how = f"fitted on {run.train} by {run.method}" if run.uncertainty else f"not fitted ({run.train})"
    known = scores(run)
    parts = [
        f"Model {run.title}, {how}; seed {origin.seed}, split by {origin.split}.",
        origin.provenance.sentence().rstrip(".") + ".",
        *_parameters(run.estimates() if run.model.declared else []),
        *_own_error(run),
    ]
    if known.unseen is not None:
        parts.append(f"On sets of samples never trained on E is {error_percent(known.unseen)} % on average.")
    if known.own is None and known.unseen is None:
        parts.append(f"E over all test sets: mean {percent(known.mean)} %, median {percent(known.median)} %.")
    parts += misfit_lines(run, 1)
    return " ".join([*parts, _by()])


def _own_error(run: Run) -> list[str]:
    own = run.errors.get(run.train)
    if own is None or scores(run).own is None or not own.tells:
        return []
    return [f"E = {error_percent(own.E)} % on the {own.n} test rows of the training set."]


def discovery_note(discovery: Discovery) -> str:
    """What was looked for in what, the verdict, the errors before and after, and the last model's parameters."""
    content = discovery.content
    asked = f"What does the model {content['model']} miss on {content['train']} ({content['rows']} rows)?"
    parts = [asked, content["says"], error_line(discovery), *_parameters(final_estimates(discovery.findings))]
    if discovery.failed:
        parts.append(f"At first: {failure_lines(discovery, 1)[0]}")
    provenance = Provenance.from_plain(content["data"]).sentence().rstrip(".")
    return " ".join([*parts, f"{provenance}. Search seed {content['seed']}.", _by()])


def sweep_note(numbers: pd.DataFrame, provenance: Provenance) -> str:
    """How good each model of a sweep is. numbers: of results.summary.summary."""
    each = [
        f"{row['label']} {percent(row['mean'], 1)} % (median {percent(row['median'], 1)} %, own set "
        f"{percent(row['diagonal'], 1)} %, unseen samples {percent(row['unseen'], 1)} %)"
        for _, row in numbers.iterrows()
    ]
    data = provenance.sentence().rstrip(".")
    return f"Error E of each training set on each test set, mean over all: {'; '.join(each)}. {data}. {_version()}."


def _parameters(estimates: Sequence[Estimate]) -> list[str]:
    shown = [f"{e.name} = {_with_error(e)}" for e in estimates[:MOST_PARAMETERS]]
    if len(estimates) > len(shown):
        shown.append(f"and {len(estimates) - len(shown)} more")
    return [f"Parameters: {', '.join(shown)}."] if shown else []


def _with_error(estimate: Estimate) -> str:
    error = number(estimate.stderr, 2)
    unit = "" if estimate.unit in ("", "1") else f" {estimate.unit}"
    value = number(estimate.value, 4)
    return f"({value} ± {error}){unit}" if error != number(None) else f"{value}{unit}"


def _by() -> str:
    return f"{_version()}; ± one standard error."


def _version() -> str:
    return f"Computed by freelearn {VERSION}"
