"""report.html of a discovery."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.inference.thresholds import ALPHA
from freelearn.render.html.charts.ranking import ranking_chart, ranking_numbers
from freelearn.render.html.charts.staircase import StaircaseChart
from freelearn.render.html.page import Section, number, percent, sentence, write_page
from freelearn.render.html.provenance import provenance_section
from freelearn.render.html.run import curve_section, parameter_table, residual_sections
from freelearn.results.discovery import Discovery, stderr, trail_numbers


def report_discovery(discovery: Discovery, folder: Path, command: str, figures: bool) -> None:
    """Writes report.html. figures: charts as well."""
    content = discovery.content
    sections = [
        _verdict(discovery),
        _staircase(discovery, figures),
        *_failures(discovery),
        *_ranking(discovery, figures),
    ]
    sections += [*_classes(discovery), *_parameters(discovery)]
    if figures:
        for measured, curves in discovery.curves:
            sections.append(curve_section(measured, curves, "Loads before and after"))
        for when, table in discovery.predictions.items():
            sections += residual_sections(table, when)
    accuracy = ", ".join(f"{name} {value:.3g}" for name, value in content["accuracy"].items())
    facts = {"seed": content["seed"], "rows": content["rows"], "accuracy, one standard deviation, SI": accuracy}
    sections.append(provenance_section(content["data"], command, facts))
    title = f"What {content['model']} misses on {content['train']}"
    write_page(folder / "report.html", title, bool(content["data"]["simulated"]), sections)


def _verdict(discovery: Discovery) -> Section:
    return Section("Verdict", [discovery.content["says"]], kind="verdict")


def _staircase(discovery: Discovery, figures: bool) -> Section:
    table = trail_numbers(discovery.content)
    shown = pd.DataFrame(
        {
            "step": table["step"],
            "E held-out %": [percent(e, 3) for e in table["E_heldout"]],
            "E fitted %": [percent(e, 3) for e in table["E_train"]],
        }
    )
    error = discovery.content["error"]
    line = (
        f"Held-out error from {percent(error['before'], 3)} % to {percent(error['after'], 3)} %; measuring alone "
        f"leaves {percent(error['noise_floor'], 3)} %."
    )
    charts = []
    lines = [line, f"{discovery.content['heldout_is']}."]
    if figures:
        chart = StaircaseChart()
        chart.show(table)
        charts = [chart.panel]
    return Section("The error, step by step", lines, shown, charts, {"staircase.csv": table} if figures else {})


def _failures(discovery: Discovery) -> list[Section]:
    lines = [sentence(failure.sentence()) for failure in discovery.failed]
    screens = [sentence(f"{screen.name}: {screen.says}") for screen in discovery.screens]
    found = [Section("Where the model failed at first", lines or ["No region stands out."])]
    found.append(Section("What that already rules out", screens))
    if discovery.notes:
        found.append(Section("To know", [f"{note}." for note in discovery.notes]))
    if left := discovery.left:
        text = (
            f"What is left is {100 * left.share:.0f} % systematic. Hint, not a finding: {left.hint} explains "
            f"{100 * left.hint_share:.0f} % of it."
        )
        found.append(Section("What remains", [text], kind="hint"))
    return found


def _ranking(discovery: Discovery, figures: bool) -> list[Section]:
    candidates: list[dict[str, Any]] = discovery.content["candidates"]
    table = ranking_numbers(candidates)
    if not len(table):
        return []
    shown = pd.DataFrame(
        {
            "effect": table["effect"],
            "size σ": [f"{s:.1f}" for s in table["size"]],
            "p by chance": [number(p, 3) for p in table["p_value"]],
            "E held-out %": [percent(e, 3) for e in table["E_heldout"]],
        }
    )
    untried = [
        f"{c['effect']}: {c['reason']}" for c in candidates if c["status"] != "tested" and c.get("step") in (0, None)
    ]
    charts = [ranking_chart(table, ALPHA)] if figures else []
    numbers = {"ranking.csv": table} if figures else {}
    parts = [Section("Which effects would explain it, before any was added", [], shown, charts, numbers)]
    if untried:
        parts.append(Section("Not tested", untried))
    return parts


def _classes(discovery: Discovery) -> list[Section]:
    several = [c for c in discovery.content["classes"] if len(c) > 1]
    if not several:
        return []
    lines = [f"The data cannot tell these apart: {', '.join(c)}." for c in several]
    rows = [
        [p.sample, f"{p.elongation_mm:+.3g}", f"{p.twist_deg:+.4g}", f"{p.pressure_kpa:.3g}", *p.separates,
         f"{p.expected_z:.1f}"]
        for p in discovery.proposed
    ]  # fmt: skip
    columns = ["sample", "elongation mm", "twist deg", "pressure kPa", "this", "from that", "expected σ"]
    table = pd.DataFrame(rows, columns=columns) if rows else None
    return [Section("What to measure next", lines, table)]


def _parameters(discovery: Discovery) -> list[Section]:
    step = discovery.findings.final
    table = parameter_table(step.fit.model, step.fit.values(), stderr(step))
    return [Section("Parameters of the last model", [], table)]
