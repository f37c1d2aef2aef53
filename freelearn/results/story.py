"""A result as text with headings and tables in Markdown, for TensorBoard."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from freelearn.results.claim_tables import checks_table, models_table, shares_table
from freelearn.results.discovery import Discovery, trail_numbers
from freelearn.results.discovery_tables import failure_lines, final_parameters, note_lines
from freelearn.results.lab_note import discovery_note, run_note
from freelearn.results.origin import Origin
from freelearn.results.run import Run
from freelearn.results.run_tables import error_table, misfit_lines, parameter_notes, row_notes, run_parameters
from freelearn.results.staircase import staircase_table
from freelearn.results.tables import DisplayTable

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
    claim = [checks_table(content["referee"]), models_table(content["models"]), shares_table(content["shares"])]
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

    >>> print(markdown(DisplayTable.of(["set"], ["E %"], [["a|b", "1.2"]], "errors")))
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
