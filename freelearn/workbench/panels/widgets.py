"""What the page is made of: text, boxes to tick, places to drop a file, parts beside each other."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.models import CustomJSTickFormatter
from bokeh.plotting import figure
from markupsafe import Markup, escape

from freelearn.workbench.state.session import LARGEST_CSV, MEGABYTE, Session

if TYPE_CHECKING:
    from freelearn.common.display import DisplayTable


class Tick:
    """A box beside its words. changed: called with whether it is ticked."""

    def __init__(self, text: str, width: int, changed: Callable[[bool], None], ticked: bool = False) -> None:
        self.text = text
        self.view = pn.widgets.CheckBoxGroup(
            name=text, options=[text], value=[text] if ticked else [], inline=False, width=width
        )
        self.view.param.watch(lambda event: changed(bool(event.new)), "value")

    @property
    def ticked(self) -> bool:
        """Whether it is ticked."""
        return bool(self.view.value)

    def show(self, ticked: bool, visible: bool, disabled: bool) -> None:
        """Shows it so."""
        self.view.param.update(value=[self.text] if ticked else [], visible=visible, disabled=disabled)


# Text on the page. Whatever came from a file is escaped here: nothing of it is ever read as HTML.

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
th.left, td.left { text-align: left; min-width: 5.5em; }
td.left { white-space: normal; overflow-wrap: break-word; }
pre { background: #f4f4f4; padding: 6px; white-space: pre-wrap; margin: 2px 0; overflow-wrap: anywhere; }
"""

# A label that only a reader of the page's text needs: what stands above says it to the eye.
HIDDEN_LABEL = "label { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }"


def heading(text: str, level: int = 2) -> pn.pane.HTML:
    """A heading of plain text."""
    return pn.pane.HTML(f"<h{level}>{escape(text)}</h{level}>", stylesheets=[STYLE], margin=(4, 8, 0, 8))


def words(text: str = "") -> pn.pane.HTML:
    """A place for `say`. text: stands there quietly until something else is said."""
    place = pn.pane.HTML("", stylesheets=[STYLE], margin=(2, 8), sizing_mode="stretch_width")
    say(place, [text] if text else [], "quiet")
    return place


def table(place: pn.pane.HTML, shown: DisplayTable | None) -> None:
    """Puts a table in the place with what stands below it, or nothing."""
    text = ""
    if shown is not None:
        sides = [' class="left"' if column.words else "" for column in shown.columns]
        head = "".join(f"<th{s}>{escape(c.heading)}</th>" for s, c in zip(sides, shown.columns, strict=True))
        rows = ["".join(f"<td{s}>{_broken(c)}</td>" for s, c in zip(sides, row, strict=True)) for row in shown.rows]
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        text = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        text += f'<p class="quiet">{escape(shown.caption)}</p>' if shown.caption else ""
    if place.object != text:
        place.object = text


def _broken(cell: str) -> Markup:
    """A cell, whose long names may break between their parts."""
    return Markup(re.sub(r"(?<=\w)([_.])(?=[A-Za-z])", r"\1<wbr>", str(escape(cell))))


def say(place: pn.pane.HTML, lines: Sequence[str], kind: str = "", code: bool = False) -> None:
    """Puts lines of plain text in the place. kind: good, bad, quiet, verdict or source."""
    tag = "pre" if code else "p"
    text = "".join(f'<{tag} class="{escape(kind)}">{escape(line)}</{tag}>' for line in lines)
    if place.object != text:
        place.object = text


# Parts of the page beside each other, as many as its width has room for.

NARROWEST = 300  # px, of a chart
# Of a legend, px: a state with a suspected reading names one thing more.
TWO_ROWS = 54
# Of five signs in letters of one width, or more; a blank before each has them stand at one height.
_EQUALLY_WIDE = """
    const text = String(Number(tick.toPrecision(6))).replaceAll("-", "\u2212")
    return " " + text.padStart(5)
"""


def wide(drawn: figure) -> pn.pane.Bokeh:
    """The chart, as wide as its place."""
    drawn.sizing_mode = "stretch_width"
    return pn.pane.Bokeh(drawn, sizing_mode="stretch_width", height=drawn.height)


def steady(drawn: figure) -> None:
    """Has labels of the upright axis and the legend take the same room, whatever they say: else the browser lays out
    the whole page anew where a curve needs one digit more, which takes longer than to draw it."""
    drawn.yaxis.formatter = CustomJSTickFormatter(code=_EQUALLY_WIDE)
    drawn.yaxis.major_label_text_font = "monospace"
    drawn.yaxis.major_label_standoff = 2
    drawn.legend.styles = {"min-height": f"{TWO_ROWS}px"}


def beside(*parts: Any, columns: str = f"repeat(auto-fit, minmax({NARROWEST}px, 1fr))") -> pn.FlexBox:
    """Parts beside each other, in further rows what does not fit. columns: their widths, as CSS grids have them."""
    # Not Bokeh's own layouts: these give all charts in them the same margins, as wide as the widest needs them.
    grid = f"div[id^=flexbox] {{ display: grid !important; grid-template-columns: {columns}; align-items: start; }}"
    return pn.FlexBox(*parts, sizing_mode="stretch_width", stylesheets=[grid])


def together(*groups: pn.FlexBox) -> pn.FlexBox:
    """Groups of charts in one line where all of them have room, else in a line for each group: none has a chart that
    stands alone because another group's took its place."""
    wrapped = "div[id^=flexbox] { display: flex !important; flex-wrap: wrap; align-items: flex-start; }"
    return pn.FlexBox(*groups, sizing_mode="stretch_width", stylesheets=[wrapped])


def share(group: pn.FlexBox, charts: Sequence[Any]) -> None:
    """Puts charts into a group of `together`, with room for all of them in a line where the page has it."""
    group.styles = {"flex": f"{max(len(charts), 1)} 1 {NARROWEST * len(charts)}px", "min-width": "0"}
    group.objects = list(charts)


# Places to drop a file, and buttons that give one.

log = logging.getLogger(__name__)

# As high as a button beside it, and words that fit a narrow place.
SAME_HEIGHT = ".bk-btn { height: 31px; line-height: 18px; }"
SMALLER = ".filepond--drop-label.filepond--drop-label label { font-size: 13px; }"
# A file that was taken, in colors that can be read.
READABLE = """
.filepond--item-panel.filepond--item-panel { background-color: #1e5c34; }
.filepond--file-info *, .filepond--file-status * { opacity: 1 !important; color: #fff; }
"""


# White on Bokeh's own green is hard to read.
GOOD = ".bk-btn.bk-btn-success, .bk-btn.bk-btn-success:hover { background-color: #1b6e3c; border-color: #1b6e3c; }"


# A browser sends two files at a time, piece by piece. After a file that comes alone no other comes later, nor after
# several [ms]; and no more of one that has begun after so long [s].
ALONE, TOGETHER, GIVEN_UP = 1000, 3000, 10.0
# Of several that were dropped a list stands below the place to drop them, and needs so much more below it [px].
LISTED = (5, 10, 70, 10)


class Dropper(pn.widgets.FileDropper):
    """A place to drop a file of any type: browsers know none of MATLAB's, and what cannot be read is refused in words.
    Of Panel's it keeps no file once that has been handed on, and of those that are dropped together, whose pieces come
    in turn, never more than the largest size."""

    def __init__(
        self,
        width: int,
        taken: Callable[[str, bytes], None],
        several: Callable[[Mapping[str, bytes]], None] | None = None,
    ) -> None:
        """taken: called with the name and the content of a file; content longer than the largest is not all of it.
        several: with those of files that were dropped together, where they may be."""
        super().__init__(  # type: ignore[no-untyped-call]
            max_file_size=f"{LARGEST_CSV // MEGABYTE}MB", multiple=several is not None, height=90, width=width,
            visible=False, layout="compact", stylesheets=[SMALLER, READABLE],
        )  # fmt: skip
        self._taken, self._several = taken, several
        self._together: dict[str, bytes] = {}
        self._waiting: Any = None
        # Pieces of files that have not ended, and when the last one came.
        self._begun: dict[str, list[bytes]] = {}
        self._heard = 0.0

    def _process_event(self, event: Any) -> None:
        if event.event_name == "delete_event":
            return
        try:
            about = event.data
            name, piece, number, last = str(about["name"]), about["data"], about["chunk"], about["total_chunks"]
            piece = piece.encode() if isinstance(piece, str) else bytes(memoryview(piece))
        except (TypeError, KeyError, AttributeError, ValueError) as problem:
            log.warning("refused what came as a piece of a file: %s", problem)
            return
        if number == 1:
            self._begun[name] = []
        pieces = self._begun.get(name)
        if pieces is None or number != len(pieces) + 1:
            # A piece of a file of which there is no beginning, or that is refused already.
            return
        pieces.append(piece)
        self._heard = time.monotonic()
        if sum(map(_size, self._begun.values())) > LARGEST_CSV:
            self._begun = {name: pieces}
        if number == last or _size(pieces) > LARGEST_CSV:
            content = b"".join(self._begun.pop(name))
            if self._several is None or pn.state.curdoc is None:
                self._taken(name, content)
                return
            self.margin = LISTED
            size = _size(self._together.values()) + len(content)
            self._together = {**(self._together if size <= LARGEST_CSV else {}), name: content}
            self._wait()

    def _wait(self) -> None:
        """Whether another file comes is seen when none has come for a moment."""
        document = pn.state.curdoc
        assert document is not None
        if self._waiting is not None:
            document.remove_timeout_callback(self._waiting)
        self._waiting = document.add_timeout_callback(self._hand_on, TOGETHER if len(self._together) > 1 else ALONE)

    def _hand_on(self) -> None:
        if self._begun and time.monotonic() - self._heard < GIVEN_UP:
            self._wait()
            return
        self._begun = {}
        files, self._together, self._waiting = self._together, {}, None
        if len(files) == 1:
            self._taken(*next(iter(files.items())))
        elif files and self._several is not None:
            self._several(files)


def _size(pieces: Iterable[bytes]) -> int:
    return sum(map(len, pieces))


def download(
    label: str, width: int, name: str = "file", content: Callable[[], Any] | None = None
) -> pn.widgets.FileDownload:
    """Hidden until there is a file, whose path is set, or what `content` makes."""
    return pn.widgets.FileDownload(
        file=None, callback=content, filename=name, label=label, auto=True, embed=False, visible=False, width=width,
        stylesheets=[SAME_HEIGHT],
    )  # fmt: skip


def give(button: pn.widgets.FileDownload, path: Path, name: str, visible: bool) -> None:
    """Has a button give a file under a name of the user's own."""
    button.param.update(file=str(path), visible=visible)
    # With the file comes its name: the user's own goes after it.
    button.filename = name


class Part:
    """What the page itself sets is no choice of the user's."""

    def __init__(self, session: Session) -> None:
        self.session, self.refreshing = session, False

    @contextmanager
    def shown(self) -> Iterator[None]:
        """While the page sets its widgets."""
        self.refreshing = True
        try:
            yield
        finally:
            self.refreshing = False

    def chosen(self, name: str, value: Any) -> None:
        """Hands on what the user chose."""
        if not self.refreshing and value is not None:
            self.session.choose(**{name: value})
