"""A page of its own: sections of text, tables and pictures, and where its result comes from."""

from __future__ import annotations

import base64
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment
from markupsafe import Markup

from freelearn.common.display import DisplayTable
from freelearn.common.files import write_text
from freelearn.common.formats import true_minus
from freelearn.common.package import VERSION, code_version
from freelearn.records.provenance import Provenance

# A self-contained page: text, tables and charts in one HTML file that opens without a network.

# Everything from data, settings and names passes through autoescape; only Bokeh's own output is marked safe.
ENVIRONMENT = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
ENVIRONMENT.filters["minus"] = true_minus
PAGE = ENVIRONMENT.from_string(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; margin: 1.2rem clamp(1rem, 3vw, 3rem); }
h1 { font-size: 1.5rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .4rem; }
p { max-width: 100ch; overflow-wrap: anywhere; }
.source { display: inline-block; padding: .1rem .6rem; border: 1.5px solid; border-radius: 4px; font-weight: 600; }
.simulated { color: #8a4b00; background: #fff4e0; } .measured { color: #00557f; background: #e6f4fb; }
table { border-collapse: collapse; margin: .4rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .15rem .7rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap; }
th { border-bottom: 2px solid #888; } .words { text-align: left; } th, td.words { white-space: normal; }
td.words:first-child { min-width: 11rem; } td.long { min-width: 12rem; }
th button { all: inherit; padding: 0; border: 0; cursor: pointer; }
th button::after { content: " \\2195"; color: #767676; } th[aria-sort=ascending] button::after { content: " \\2191"; }
th[aria-sort=descending] button::after { content: " \\2193"; }
@media screen and (min-width: 1600px) {
main { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); column-gap: 3rem; align-items: start; }
main > h1, main > p, section.broad { grid-column: 1 / -1; }
table { font-size: .95em; } th, td { padding-inline: .45rem; }
}
.charts { display: flex; flex-wrap: wrap; gap: .6rem; } .wide, .charts { overflow-x: auto; }
pre { background: #f4f4f4; padding: .6rem .8rem; overflow-x: auto; white-space: pre-wrap; }
.verdict { font-size: 1.1rem; font-weight: 600; } .hint { color: #555; }
.note { border-left: 3px solid #888; padding-left: .8rem; }
a:focus, summary:focus, button:focus-visible { outline: 2px solid #0072B2; }
@page { size: A4; margin: 14mm; }
@media print {
body { font-size: 10pt; margin: 0; } .charts { display: block; } .chart { display: inline-block; }
h2, section.charted > p { break-after: avoid; } h2 { margin-top: 1.2rem; }
h2, .charts.few { break-inside: avoid; }
thead { display: table-header-group; } details, .wide, pre { break-before: avoid; }
th, td { padding: .1rem .35rem; } tr, p, .chart { break-inside: avoid; } .wide, .charts { overflow: visible; }
th button::after { content: ""; } table { font-size: 8.5pt; } .download { display: none; } pre { font-size: 8pt; }
.source { print-color-adjust: exact; } .chart { zoom: .78; } .chart.broad { zoom: .54; }
}
</style>
{% if script %}
<script>{{ library }}</script>
{% endif %}
</head>
<body>
<main>
<h1>{{ title }}</h1>
<p><span class="source {{ 'simulated' if simulated else 'measured' }}">
{{ 'SIMULATED DATA: nothing here was measured' if simulated else 'measured data' }}</span></p>
{% for section in sections %}
<section class="{{ 'broad' if section.broad }}{{ ' charted' if section.marks }}">
<h2>{{ section.heading | minus }}</h2>
{% for line in section.lines %}
<p{% if section.kind %} class="{{ section.kind }}"{% endif %}>{{ line | minus }}</p>
{% endfor %}
{% if section.code %}
<pre>{{ section.code }}</pre>
{% endif %}
{% if section.folded %}
<details><summary>{{ section.folded }}</summary>
{% endif %}
{% for table in section.tables %}
<div class="wide"><table><thead><tr>
{% for column in table.columns %}
<th{% if column.words %} class="words"{% endif %} scope="col">
{%- if table.rows | length > 2 %}<button type="button">{{ column.heading }}</button>
{%- else %}{{ column.heading }}{% endif %}</th>
{%- endfor %}

</tr></thead><tbody>
{% for row in table.rows %}
<tr>
{% for cell in row %}
<td{% if table.columns[loop.index0].words %} class="words{{ ' long' if cell | length > 30 }}"{% endif %}>
{{- cell | minus }}</td>
{%- endfor %}

</tr>
{% endfor %}
</tbody></table></div>
{% if table.caption %}
<p class="hint">{{ table.caption | minus }}</p>
{% endif %}
{% endfor %}
{% if section.folded %}
</details>
{% endif %}
{% if section.marks %}
<div class="charts{{ ' few' if section.marks | length <= 3 }}">
{% for mark in section.marks %}
<div class="chart{{ ' broad' if mark.broad }}">{{ mark.place }}</div>
{% endfor %}
</div>
{% endif %}
{% for file in section.files %}
<p class="download"><a download="{{ file.name }}" href="{{ file.link }}">{{ file.name }}</a>: the numbers shown here</p>
{% endfor %}
</section>
{% endfor %}
</main>
{{ script }}
{% if sortable %}
<script>{{ sorting }}</script>
{% endif %}
</body>
</html>
"""
)


# A click on a heading sorts by its column, a second one the other way round; what is not known stays last. A page that
# is printed shows what is folded away.
SORTING = """
const size = text => parseFloat(text.replace(/\u2212/g, "-").replace(/^[^\\d.-]+/, ""));
for (const button of document.querySelectorAll("th button")) button.addEventListener("click", () => {
  const head = button.parentElement, body = head.closest("table").tBodies[0], place = head.cellIndex;
  const down = head.getAttribute("aria-sort") === "ascending";
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  const text = row => row.cells[place].textContent.trim(), words = head.classList.contains("words");
  const order = (a, b) => words ? text(a).localeCompare(text(b), "en", {numeric: true}) : size(text(a)) - size(text(b));
  const known = row => words || !isNaN(size(text(row))), rows = [...body.rows];
  const sorted = rows.filter(known).sort((a, b) => down ? order(b, a) : order(a, b));
  body.append(...sorted, ...rows.filter(row => !known(row)));
});
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => part.open = true));
"""
FOR_THE_LAB_BOOK = "In one paragraph, for the lab book"
# Pixels of a chart from which it is made smaller in print, to fit the paper.
BROAD = 700
# Pixels of a chart, and columns of a table, that have room in half of a wide page; pixels of charts set two by two.
HALF, MOST_COLUMNS, NARROW = 760, 8, 430


@dataclass(frozen=True)
class Section:
    """One part of a page. tables: under their captions; their titles are left out. charts: Bokeh figures; numbers: what
    they show, by file name, to download. kind: "verdict", "note" or "hint" where the lines stand out. folded: what
    stands for the tables until they are unfolded, "" to show them at once."""

    heading: str
    lines: Sequence[str] = ()
    tables: Sequence[DisplayTable] = ()
    charts: Sequence[Any] = ()
    numbers: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    code: str = ""
    kind: str = ""
    folded: str = ""

    @classmethod
    def of_table(cls, table: DisplayTable, lines: Sequence[str] = ()) -> Section:
        """A table under its own title."""
        return cls(table.title, lines, [table])


def write_page(path: Path, title: str, simulated: bool, sections: Sequence[Section]) -> None:
    """Writes the page, whole or not at all."""
    charts = [chart for section in sections for chart in section.charts]
    script, marks = _embedded(charts) if charts else ("", ())
    places = iter(marks)
    shown = [
        vars(section)
        | {
            "broad": _broad(section),
            "marks": [{"place": Markup(next(places)), "broad": chart.width > BROAD} for chart in section.charts],
            "files": [{"name": name, "link": _link(table)} for name, table in section.numbers.items()],
        }
        for section in sections
    ]
    # Without charts the page needs no library, and a sweep's many small reports stay small.
    text = PAGE.render(
        title=title,
        simulated=simulated,
        sections=shown,
        script=Markup(script),
        library=Markup(_library() if charts else ""),
        sortable=any(section.tables for section in sections),
        sorting=Markup(SORTING),
    )
    write_text(path, text)


def _broad(section: Section) -> bool:
    """Whether it needs the page's width, where that has room for two sections beside each other."""
    widths = [chart.width for chart in section.charts]
    if widths and (max(widths) > HALF or (sum(widths) > 3 * HALF / 2 and len(widths) > 2 and widths[0] > NARROW)):
        return True
    return bool(section.code) or any(len(table.columns) > MOST_COLUMNS for table in section.tables)


def _library() -> str:
    # A second to import, and a report without charts does without.
    from bokeh.resources import Resources

    return "\n".join(Resources(mode="inline", components=["bokeh"]).js_raw)


def _embedded(charts: Sequence[Any]) -> tuple[str, tuple[str, ...]]:
    """The script that draws the charts, and a mark for the place of each."""
    # A second to import, and a report without charts does without.
    from bokeh.document import Document
    from bokeh.embed import components

    # Bokeh's own temporary document looks through all charts again for each one: seconds with forty of them.
    document = Document()
    with document.models.freeze():
        for chart in charts:
            document.add_root(chart)
    script, marks = components(charts)
    return str(script), tuple(marks)


def _link(table: pd.DataFrame) -> str:
    content = table.to_csv(index=False, float_format="%.8g").encode()
    return "data:text/csv;base64," + base64.b64encode(content).decode()


LIBRARIES = ("torch", "lightning", "hydra-core", "numpy", "pandas", "scipy")


def provenance_section(provenance: Provenance, command: str, facts: Mapping[str, object]) -> Section:
    """facts: what else belongs here, such as the seed. command: the shell command that repeats it."""
    lines = [provenance.sentence(), *(f"{name}: {value}" for name, value in facts.items())]
    lines.append(_versions())
    return Section("Where this comes from, and how to repeat it", lines, code=command)


@lru_cache
def _versions() -> str:
    """Of this package, Python and what the numbers hang on. A sweep's jobs ask for them again and again."""
    versions = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    code = f"freelearn {VERSION} (code {code_version()[:12]})"
    return f"{code}, Python {platform.python_version()}, {versions}"
