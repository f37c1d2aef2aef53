"""A result in one paragraph, for a laboratory's notebook, and as a text with headings and tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.formats import error_percent, number, percent
from freelearn.common.package import VERSION
from freelearn.physics.chain.known_parameters import FIXED
from freelearn.records.claims import checks_table, models_table, shares_table
from freelearn.records.discovery import Discovery, final_estimates, trail_numbers
from freelearn.records.estimates import Estimate, shown_value
from freelearn.records.provenance import Origin, Provenance
from freelearn.records.run import Run
from freelearn.report.tables.discovery_tables import (
    error_line,
    failure_lines,
    final_parameters,
    note_lines,
    rows_told,
)
from freelearn.report.tables.ranking_tables import staircase_table
from freelearn.report.tables.run_tables import (
    beside,
    error_table,
    misfit_lines,
    parameter_notes,
    row_notes,
    run_parameters,
)
from freelearn.report.tables.sweep_tables import scores

# A result in one paragraph, to be pasted into a laboratory's notebook.

# Of a training set of many samples each may have its own value of a parameter.
MOST_PARAMETERS = 8


def run_note(run: Run, origin: Origin) -> str:
    """What was fitted on what, the parameters, the errors, and where it fails most."""
    how = f"fitted on {run.train} by {run.method}" if run.uncertainty else f"not fitted ({run.train})"
    known = scores(run)
    parts = [
        f"Model {run.title}, {how}; seed {origin.seed}, split by {origin.split}.",
        origin.provenance.sentence().rstrip(".") + ".",
        *_parameters(run.estimates() if run.model.declared else [], run.model.coefficients),
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
    rows = "one test row" if own.n == 1 else f"{own.n} test rows"
    return [f"E = {error_percent(own.E)} % on the {rows} of the training set."]


def discovery_note(discovery: Discovery) -> str:
    """What was looked for in what, the verdict, the errors before and after, and the last model's parameters."""
    content = discovery.content
    asked = f"What does the model {content['model']} miss on {content['train']} ({rows_told(discovery)})?"
    parts = [asked, content["says"], error_line(discovery), *_parameters(final_estimates(discovery.findings))]
    if discovery.failed:
        parts.append(f"At first: {failure_lines(discovery, 1)[0]}")
    provenance = Provenance.from_plain(content["data"]).sentence().rstrip(".")
    return " ".join([*parts, f"{provenance}. Search seed {content['seed']}.", _by()])


def sweep_note(numbers: pd.DataFrame, provenance: Provenance) -> str:
    """How good each model of a sweep is. numbers: of sweep_tables.summary."""
    each = [
        f"{row['label']} {percent(row['mean'], 1)} % (median {percent(row['median'], 1)} %, own set "
        f"{percent(row['diagonal'], 1)} %, unseen samples {percent(row['unseen'], 1)} %)"
        for _, row in numbers.iterrows()
    ]
    data = provenance.sentence().rstrip(".")
    return f"Error E of each training set on each test set, mean over all: {'; '.join(each)}. {data}. {_version()}."


def _parameters(estimates: Sequence[Estimate], coefficients: int = 0) -> list[str]:
    shown = [_with_error(e) for e in estimates[:MOST_PARAMETERS]]
    if len(estimates) > len(shown):
        shown.append(f"and {len(estimates) - len(shown)} more")
    shown += filter(None, [beside(coefficients)])
    return [f"Parameters: {', '.join(shown)}."] if shown else []


def _with_error(estimate: Estimate) -> str:
    """Name = value ± standard error, unit."""
    if estimate.untold:
        return f"{estimate.name} not determined by these rows"
    error = number(None if estimate.beforehand == FIXED else estimate.stderr, 2)
    unit = "" if estimate.unit in ("", "1") else f" {estimate.unit}"
    value = number(shown_value(estimate.value), 4)
    said = f"({value} ± {error}){unit}" if error != number(None) else f"{value}{unit}"
    return f"{estimate.name} = {said}{f' ({FIXED})' if estimate.beforehand == FIXED else ''}"


def _by() -> str:
    return f"{_version()}; ± one standard error."


def _version() -> str:
    return f"Computed by freelearn {VERSION}"


# A result as text with headings and tables in Markdown, for TensorBoard.

MOST_FAILURES = 5


def run_story(run: Run, origin: Origin) -> str:
    """A run: in one paragraph, its errors, its parameters, where it fails, what to know."""
    parameters = run_parameters(run)
    return _parts(
        [
            plain(run_note(run, origin)),
            markdown(error_table(run)),
            plain(parameters) if isinstance(parameters, str) else markdown(parameters),
            listed(misfit_lines(run, MOST_FAILURES)),
            listed([*row_notes(run), *parameter_notes(run), *origin.notes]),
        ]
    )


def discovery_story(discovery: Discovery) -> str:
    """A search: in one paragraph, its steps, whether its claim stands and what else would fit as well, the last model's
    parameters, where the first one failed, what to know."""
    content = discovery.content
    checks = checks_table(content["referee"], asked=content["refereed"])
    claim = [checks, models_table(content["models"]), shares_table(content["shares"])]
    return _parts(
        [
            plain(discovery_note(discovery)),
            markdown(staircase_table(trail_numbers(content))),
            *(markdown(table) for table in claim if table),
            markdown(final_parameters(discovery)),
            listed(failure_lines(discovery, MOST_FAILURES)),
            listed(note_lines(discovery)),
        ]
    )


def markdown(table: DisplayTable) -> str:
    """The table under its title, its caption below.

    >>> print(markdown(DisplayTable.from_rows(["set"], ["E %"], [["a|b", "1.2"]], "errors")))
    **errors**
    <BLANKLINE>
    | set | E % |
    | :-- | --: |
    | a\\|b | 1.2 |
    """
    head = [column.heading for column in table.columns]
    sides = [":--" if column.words else "--:" for column in table.columns]
    lines = [_row(map(plain, head)), _row(sides), *(_row(map(plain, row)) for row in table.rows)]
    parts = [f"**{plain(table.title)}**" if table.title else "", "\n".join(lines), plain(table.caption)]
    return _parts(parts)


def listed(lines: Sequence[str]) -> str:
    """Lines as a list."""
    return "\n".join(f"- {plain(line)}" for line in lines)


def plain(text: str) -> str:
    """Words in which Markdown finds nothing to do: names of effects keep their underscores.

    >>> plain("end_clamps *")
    'end\\\\_clamps \\\\*'
    """
    for mark in "\\`*_|<[":
        text = text.replace(mark, f"\\{mark}")
    return text


def _parts(parts: Iterable[str]) -> str:
    return "\n\n".join(part for part in parts if part)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"
