"""report.html of a sweep."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.records.provenance import Provenance
from freelearn.report.html.heatmap_chart import heatmap_chart
from freelearn.report.html.html_page import FOR_THE_LAB_BOOK, Section, provenance_section, write_page
from freelearn.report.tables.error_map import WORST
from freelearn.report.tables.lab_notes import sweep_note
from freelearn.report.tables.sweep_tables import PUBLISHED, beside_the_paper, summary_table, where_they_differ

# Maps beyond these are in heatmap.csv and in the PNG files.
MOST_MAPS = 12


def report_sweep(
    table: pd.DataFrame, cells: pd.DataFrame, summary: pd.DataFrame, provenance: Provenance, folder: Path, command: str
) -> None:
    """Writes report.html. table: of collect.collect; cells and summary: of sweep_tables; provenance: of a job's
    data; command: the shell command that makes the sweep again."""
    failed = table[table["error"] != ""]
    labels = list(summary["label"])
    first = labels[:MOST_MAPS]
    reports = _reports(table, folder)
    # As in the paper: its three models beside each other, then what it lacks.
    first = sorted(first, key=lambda label: list(PUBLISHED).index(label) if label in PUBLISHED else len(PUBLISHED))
    maps = [heatmap_chart(cells, label, reports) for label in first]
    lines = [
        f"E in %, one color scale for all maps: small errors are bright, {WORST:g} % or more darkest; >1k: ran away."
    ]
    if reports:
        lines.append("A click on a cell opens the report of its run, with that run's curves where they were drawn.")
    if len(cells) < len(labels) * cells["train"].nunique() * cells["test"].nunique():
        lines.append("Blank: not evaluated.")
    if len(labels) > MOST_MAPS:
        lines.append(f"First {MOST_MAPS} of {len(labels)} maps.")
    sections = [
        Section("How good the models are", [], [summary_table(summary)], numbers={"summary.csv": summary}),
        Section(FOR_THE_LAB_BOOK, [sweep_note(summary, provenance)], kind="note"),
        Section("Each training set on each test set", lines, charts=maps, numbers={"cells.csv": cells}),
    ]
    if (paper := beside_the_paper(summary)) is not None:
        sections.append(Section.of_table(paper, where_they_differ(cells, summary, provenance.simulated)))
    if len(failed):
        jobs = failed.drop_duplicates("run")[["run", "label", "error"]]
        said = [f"{len(jobs)} of {table['run'].nunique()}."]
        sections.append(Section("Jobs that failed", said, [DisplayTable.from_frame(jobs.astype(str))]))
    facts = {"jobs": table["run"].nunique(), "seeds": ", ".join(map(str, sorted(table["seed"].dropna().unique())))}
    sections.append(provenance_section(provenance, command, facts))
    write_page(folder / "report.html", "Sweep: " + ", ".join(labels[:MOST_MAPS]), provenance.simulated, sections)


def _reports(table: pd.DataFrame, folder: Path) -> dict[tuple[str, str, str], str]:
    """Where each cell's run has its report, from the page on; of several seeds the first one's."""
    found: dict[tuple[str, str, str], str] = {}
    for row in table[table["error"] == ""].itertuples():
        if (folder / str(row.run) / "report.html").exists():
            found.setdefault((str(row.label), str(row.train), str(row.test)), f"{row.run}/report.html")
    return found
