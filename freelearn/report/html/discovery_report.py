"""report.html of a discovery."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from freelearn.data.beds import bed_of
from freelearn.discovery.checks.table_check import FAIL
from freelearn.queries.curves.curve_rows import measured_quantities, plane
from freelearn.records.claims import checks_table, models_table, shares_table
from freelearn.records.discovery import Discovery, trail_numbers
from freelearn.records.provenance import Provenance
from freelearn.records.written_effects import file_of, proposal_source
from freelearn.report.html.html_page import FOR_THE_LAB_BOOK, Section, provenance_section, write_page
from freelearn.report.tables.discovery_tables import (
    check_table,
    class_lines,
    error_line,
    failure_lines,
    final_parameters,
    next_states,
    note_lines,
    places_table,
    remainder_lines,
    screen_lines,
    suspect_lines,
    suspect_table,
    written_lines,
)
from freelearn.report.tables.lab_notes import discovery_note
from freelearn.report.tables.ranking_tables import (
    COLLINEAR,
    cosine_table,
    ranking_numbers,
    ranking_table,
    staircase_table,
    untested_lines,
)
from freelearn.report.tables.residual_tables import scale_limits

# More suspected readings than these are folded away.
UNFOLDED = 12


def report_discovery(discovery: Discovery, folder: Path, command: str, figures: bool) -> None:
    """Writes report.html. figures: charts as well. command: the shell command that repeats the search."""
    content = discovery.content
    sections = [
        Section("Verdict", [content["says"]], kind="verdict"),
        *_checks(content),
        _staircase(discovery, figures),
        Section(FOR_THE_LAB_BOOK, [discovery_note(discovery)], kind="note"),
        *_claim(discovery),
        *_written(discovery, figures),
        *_suspects(discovery),
        *_failures(discovery),
        *_ranking(discovery, figures),
        *_classes(discovery),
        *(_likeness(discovery) if figures else []),
        Section.of_table(final_parameters(discovery)),
    ]
    if figures:
        # Bokeh takes a second to import: a report without charts does without.
        from freelearn.report.html.run_charts import curve_section, residual_section

        sections += [curve_section(*shown, "before and after") for shown in discovery.curves]
        # One scale: on scales of their own noise looks like what was there before.
        both = list(discovery.trusted.values())
        limits = scale_limits(both, plane(both[0]), measured_quantities(both[0]))
        sections += [residual_section(table, when, limits) for when, table in discovery.trusted.items()]
    facts = {"seed": content["seed"], "rows": content["rows"], "accuracy, one standard deviation": _accuracy(discovery)}
    provenance = Provenance.from_plain(content["data"])
    sections.append(provenance_section(provenance, command, facts))
    title = f"What {content['model']} misses on {content['train']}"
    write_page(folder / "report.html", title, provenance.simulated, sections)


def _checks(content: dict[str, Any]) -> list[Section]:
    """The look at the table before the search; folded away where nothing failed."""
    checks = content["checks"]
    if not checks:
        return []
    failed = any(check["status"] == FAIL for check in checks)
    table = check_table(checks)
    return [Section(table.title, [], [table], folded="" if failed else "nothing failed")]


def _accuracy(discovery: Discovery) -> str:
    """Of what the bed imposes and measures, in the table's units."""
    bed, known = bed_of(discovery.predictions["before"]), discovery.content["accuracy"]
    shown = [(q, known[q.error] / q.factor) for q in (*bed.imposed, *bed.measured)]
    return ", ".join(f"{q.name} {value:.3g}{q.suffix}" for q, value in shown)


def _staircase(discovery: Discovery, figures: bool) -> Section:
    trail = trail_numbers(discovery.content)
    table, lines = staircase_table(trail), [error_line(discovery)]
    if not figures:
        return Section.of_table(table, lines)
    from freelearn.report.html.ranking_charts import StaircaseChart

    chart = StaircaseChart()
    chart.show(trail)
    return Section(table.title, lines, [table], [chart.panel], {"staircase.csv": trail})


def _claim(discovery: Discovery) -> list[Section]:
    """Whether it stands, what else would fit as well, and how probable each effect is."""
    content = discovery.content
    checks = checks_table(content["referee"], asked=content["refereed"])
    tables = [checks, models_table(content["models"]), shares_table(content["shares"])]
    return [Section.of_table(table) for table in tables if table]


def _written(discovery: Discovery, figures: bool) -> list[Section]:
    """What the search wrote, and its file; a hint where something stays unexplained."""
    lines = written_lines(discovery)
    if not lines:
        return []
    findings = discovery.findings
    charts, numbers = [], {}
    if figures:
        from freelearn.report.html.parity_chart import proposal_chart

        charts = [proposal_chart(curve) for curve in discovery.unknowns.values()]
        numbers = {f"{name}.csv": curve.numbers for name, curve in discovery.unknowns.items()}
    places = places_table(discovery)
    entered = [Section.of_table(places)] if places else []
    if findings.verdict != "proposed":
        return [Section("A hint at what remains", lines, charts=charts, numbers=numbers, kind="hint"), *entered]
    model = discovery.content["model"]
    said = ["The file stands beside this report: name it in FREELEARN_EFFECTS to use the effect."]
    files = [
        Section(file_of(p), said, code=proposal_source(p, model, findings.noise_floor)) for p in findings.proposals
    ]
    return [Section("What the search wrote", lines, charts=charts, numbers=numbers), *entered, *files]


def _suspects(discovery: Discovery) -> list[Section]:
    if not discovery.suspects:
        return []
    table = suspect_table(discovery)
    folded = f"all {len(table.rows)} of them" if len(table.rows) > UNFOLDED else ""
    return [Section(table.title, suspect_lines(discovery), [table], folded=folded)]


def _failures(discovery: Discovery) -> list[Section]:
    sections = [
        Section("Where the model failed at first", failure_lines(discovery)),
        Section("What that already rules out", screen_lines(discovery)),
    ]
    if notes := note_lines(discovery):
        sections.append(Section("To know", notes))
    if left := remainder_lines(discovery):
        sections.append(Section("What remains", left, kind="hint"))
    return sections


def _ranking(discovery: Discovery, figures: bool) -> list[Section]:
    candidates = discovery.content["candidates"]
    numbers = ranking_numbers(candidates)
    if not len(numbers):
        return []
    table = ranking_table(numbers)
    if figures:
        from freelearn.report.html.ranking_charts import ranking_chart

        sections = [Section(table.title, [], [table], [ranking_chart(numbers)], {"ranking.csv": numbers})]
    else:
        sections = [Section.of_table(table)]
    untested = untested_lines(candidates)
    return [*sections, Section("Not tested", untested)] if untested else sections


def _likeness(discovery: Discovery) -> list[Section]:
    alike = cosine_table(*discovery.findings.cosines)
    if len(alike) < 2:
        return []
    from freelearn.report.html.ranking_charts import cosine_chart

    said = f"The cosine of what two effects change, after refitting; = where it is above {COLLINEAR:g}: these data "
    said += "hardly tell the two apart."
    chart = cosine_chart(alike)
    return [Section("Effects that look alike on these data", [said], charts=[chart], numbers={"likeness.csv": alike})]


def _classes(discovery: Discovery) -> list[Section]:
    lines = class_lines(discovery)
    if not lines:
        return []
    table = next_states(discovery.proposed)
    return [Section(table.title, lines, [table] if table.rows else [])]
