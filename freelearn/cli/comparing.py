"""`compare`: two runs side by side, in the terminal and on a page."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from freelearn.cli.command_line import exit_on_user_error
from freelearn.common.display import Column, DisplayTable
from freelearn.common.errors import UserError
from freelearn.common.formats import fixed, number, short_error

if TYPE_CHECKING:
    from rich.console import Console

    from freelearn.api.compared import Compared

# States whose curves are drawn: those at which the runs differ most.
MOST_STATES = 6


def main() -> None:
    """`compare`, from the words of the command line."""
    parser = argparse.ArgumentParser(
        prog="freelearn compare",
        description="Two runs of train or discover side by side: parameters, errors on the same rows, curves.",
    )
    parser.add_argument("a", type=Path, help="the folder of a run")
    parser.add_argument("b", type=Path, help="the folder of another")
    parser.add_argument("--out", type=Path, default=Path("comparison.html"), help="the page (comparison.html)")
    asked = parser.parse_args()
    with exit_on_user_error("interrupted; no page was written.", asked.out.parent):
        for folder in (asked.a, asked.b):
            if not folder.is_dir():
                raise UserError(f"No folder at {folder}: give that of a run of train or discover.")
        compare(asked.a, asked.b, asked.out)


def compare(a: Path, b: Path, out: Path, console: Console | None = None) -> None:
    """Prints the comparison and writes its page. Raises UserError."""
    from rich.console import Console

    from freelearn.api.compared import compared
    from freelearn.api.fitted_run import FittedRun
    from freelearn.report.html.html_page import Section, write_page
    from freelearn.report.terminal.printed_tables import print_line, rich_table

    runs = [FittedRun.from_folder(folder) for folder in (a, b)]
    found = compared(runs)
    console = console or Console()
    names = [f"{letter}: {run.title}, fitted on {run.run.content['train']}, in {run.folder}"
             for letter, run in zip("AB", runs, strict=True)]  # fmt: skip
    for name in names:
        print_line(console, name)
    tables = [errors_table(found), parameters_table(found)]
    for table in tables:
        console.print(rich_table(table))
    sections = [Section("The two runs", names), *(Section.of_table(table) for table in tables)]
    numbers = {"comparison.csv": found.rows}
    drawn = charts(found)
    said = ["Readings (dots) and both models (A solid, B dashed), at the states where the models differ most."]
    sections.append(Section("Curves", said, charts=drawn, numbers=numbers))
    out.parent.mkdir(parents=True, exist_ok=True)
    simulated = any(bool((run.run.content.get("data") or {}).get("simulated")) for run in runs)
    write_page(out, "Two runs side by side", simulated, sections)
    print_line(console, f"page: {out}")


def errors_table(found: Compared) -> DisplayTable:
    """E of both on the same rows."""
    columns = (Column("rows", words=True), Column("number"), Column("A: E %"), Column("B: E %"))
    rows = tuple(
        (str(one.rows), str(one.n), short_error(one.a), short_error(one.b)) for one in found.errors.itertuples()
    )
    return DisplayTable(columns, rows, "Errors on the same rows")


def parameters_table(found: Compared) -> DisplayTable:
    """Parameters of both with their standard errors, and by how many of them they differ."""
    # Here, because it loads torch: a mistyped folder is told before.
    from freelearn.report.tables.run_tables import beside

    columns = (
        Column("parameter", words=True),
        Column("unit", words=True),
        Column("A"),
        Column("B"),
        Column("apart, σ"),
    )
    rows = []
    for name, one in found.parameters.iterrows():
        errors = [math.nan if one[f"{run}_untold"] else one[f"{run}_stderr"] for run in "ab"]
        spread = math.hypot(*errors)
        apart = fixed(abs(one["a"] - one["b"]) / spread, 1) if spread > 0 else ""
        cells = [_value(one[run], error, one[f"{run}_untold"]) for run, error in zip("ab", errors, strict=True)]
        rows.append((str(name), str(one["unit"] or ""), *cells, apart))
    untold = [str(name) for name, one in found.parameters.iterrows() if one["a_untold"] or one["b_untold"]]
    lines = [f"{letter}: {beside(count)}" for letter, count in zip("AB", found.learned, strict=True) if count]
    lines += [f"without ±: not determined by its rows ({', '.join(untold)})"] if untold else []
    return DisplayTable(columns, tuple(rows), "Parameters (SI)", "; ".join(lines))


def _value(value: float, error: float, untold: bool) -> str:
    """Value ± standard error; few digits where the rows say nothing of it."""
    shown = number(value, 2 if untold else 4)
    return f"{shown} ± {number(error, 2)}" if math.isfinite(error) else shown


def charts(found: Compared) -> list[Any]:
    """Curves of both runs at the states where they differ most, as Bokeh's figures."""
    from bokeh.plotting import figure

    from freelearn.data.beds import bed_of
    from freelearn.queries.curves.shown_states import state_title

    rows, drawn = found.rows, []
    bed = bed_of(rows)
    state = ["sample", *(q.column for q in bed.state if q.column in rows)]
    for quantity in bed.measured:
        pair = [f"{quantity.predicted}_a", f"{quantity.predicted}_b"]
        if quantity.column not in rows or not set(pair) <= set(rows):
            continue
        apart = (rows[pair[0]] - rows[pair[1]]).abs().groupby([rows[name] for name in state]).max()
        for place in apart.nlargest(MOST_STATES // len(bed.measured)).index:
            there = rows[(rows[state] == list(place)).all(axis=1)].sort_values("pressure_kpa")
            title = state_title(there)
            chart = figure(width=420, height=300, title=title, x_axis_label="pressure P [kPa]",
                           y_axis_label=quantity.label, toolbar_location=None)  # fmt: skip
            chart.scatter(there["pressure_kpa"], there[quantity.column], color="#444444", size=5, legend_label="read")
            for name, letter, dash, color in zip(pair, "AB", ("solid", "dashed"), ("#0072B2", "#D55E00"), strict=True):
                chart.line(there["pressure_kpa"], there[name], line_dash=dash, color=color, line_width=2,
                           legend_label=letter)  # fmt: skip
            drawn.append(chart)
    return drawn
