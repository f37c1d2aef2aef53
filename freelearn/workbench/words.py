"""Text on the page. Whatever came from a file is escaped here: nothing of it is ever read as HTML."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import panel as pn
from markupsafe import escape

if TYPE_CHECKING:
    from freelearn.results.tables import DisplayTable

STYLE = """
:host { font-size: 14px; color: #1a1a1a; }
p { margin: 2px 0; line-height: 1.35; overflow-wrap: anywhere; }
h1 { font-size: 18px; margin: 0; } h2 { font-size: 15px; margin: 6px 0 2px; }
h3 { font-size: 14px; margin: 4px 0 0; }
.good { color: #00557f; font-weight: 600; } .bad { color: #8a1f00; white-space: pre-wrap; } .quiet { color: #555; }
.source {
  display: inline-block; padding: 0 6px; border: 1.5px solid #8a4b00; border-radius: 4px;
  color: #8a4b00; background: #fff4e0; font-weight: 600;
}
.verdict { color: #00557f; font-weight: 600; font-size: 16px; }
table { border-collapse: collapse; font-size: 13px; margin: 4px 0; }
th, td { padding: 2px 10px 2px 0; text-align: right; white-space: nowrap; }
th { font-weight: 600; border-bottom: 1px solid #999; }
th.left, td.left { text-align: left; white-space: normal; overflow-wrap: anywhere; min-width: 5.5em; }
pre { background: #f4f4f4; padding: 6px; white-space: pre-wrap; margin: 2px 0; overflow-wrap: anywhere; }
"""

# A label that only a reader of the page's text needs: what stands above says it to the eye.
HIDDEN_LABEL = "label { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }"


def heading(text: str, level: int = 2) -> pn.pane.HTML:
    """A heading of plain text."""
    return pn.pane.HTML(f"<h{level}>{escape(text)}</h{level}>", stylesheets=[STYLE], margin=(4, 8, 0, 8))


def words() -> pn.pane.HTML:
    """An empty place for `say`."""
    return pn.pane.HTML("", stylesheets=[STYLE], margin=(2, 8), sizing_mode="stretch_width")


def table(place: pn.pane.HTML, shown: DisplayTable | None) -> None:
    """Puts a table in the place with what stands below it, or nothing."""
    text = ""
    if shown is not None:
        sides = [' class="left"' if column.words else "" for column in shown.columns]
        head = "".join(f"<th{s}>{escape(c.heading)}</th>" for s, c in zip(sides, shown.columns, strict=True))
        rows = ["".join(f"<td{s}>{escape(c)}</td>" for s, c in zip(sides, row, strict=True)) for row in shown.rows]
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        text = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        text += f'<p class="quiet">{escape(shown.caption)}</p>' if shown.caption else ""
    if place.object != text:
        place.object = text


def say(place: pn.pane.HTML, lines: Sequence[str], kind: str = "", code: bool = False) -> None:
    """Puts lines of plain text in the place. kind: good, bad, quiet, verdict or source."""
    tag = "pre" if code else "p"
    text = "".join(f'<{tag} class="{escape(kind)}">{escape(line)}</{tag}>' for line in lines)
    if place.object != text:
        place.object = text
