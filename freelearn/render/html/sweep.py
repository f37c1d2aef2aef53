"""report.html of a sweep."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from freelearn.render.html.charts.heatmap import heatmap_chart
from freelearn.render.html.page import Section, number, percent, write_page
from freelearn.render.html.provenance import provenance_section

# Maps beyond these are in heatmap.csv and in the PNG files.
MOST_MAPS = 12


def report_sweep(
    table: pd.DataFrame, cells: pd.DataFrame, summary: pd.DataFrame, data: dict, folder: Path, command: str
) -> None:
    """Writes report.html. table: of sweep.collect; cells and summary: of sweep.summary; data: provenance of a job's."""
    failed = table[table["error"] != ""]
    shown = pd.DataFrame({"": summary["label"]})
    names = {"mean": "mean E %", "range": "range %", "diagonal": "own set %", "unseen": "unseen samples %"}
    for column, heading in names.items():
        shown[heading] = [percent(value, 1) for value in summary[column]]
    shown["best in % of cells"] = [percent(value, 0) for value in summary["best_share"]]
    shown["parameters"] = [number(value, 3) for value in summary["parameters"]]
    explained = (
        "Own set: tested on the training set's own test rows. Unseen: on samples that were never trained on. "
        "Best: no other model is better in that cell."
    )
    labels = list(summary["label"])
    maps = [heatmap_chart(cells, label, cells) for label in labels[:MOST_MAPS]]
    lines = ["Small errors are bright. One colour scale for all maps."]
    if len(labels) > MOST_MAPS:
        lines.append(f"First {MOST_MAPS} of {len(labels)} maps.")
    sections = [
        Section("How good the models are", [explained], shown, numbers={"summary.csv": summary}),
        Section("Each training set on each test set", lines, charts=maps, numbers={"cells.csv": cells}),
    ]
    if len(failed):
        jobs = failed.drop_duplicates("run")[["run", "label", "error"]]
        sections.append(Section("Jobs that failed", [f"{len(jobs)} of {table['run'].nunique()}."], jobs))
    facts = {"jobs": table["run"].nunique(), "seeds": ", ".join(map(str, sorted(table["seed"].dropna().unique())))}
    sections.append(provenance_section(data, command, facts))
    write_page(folder / "report.html", "Sweep: " + ", ".join(labels[:MOST_MAPS]), bool(data["simulated"]), sections)
