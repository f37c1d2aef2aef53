"""Places to drop a file, and buttons that give one."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import panel as pn

from freelearn.workbench.session import LARGEST_CSV, MEGABYTE

log = logging.getLogger(__name__)

# As high as a button beside it, and words that fit a narrow place.
SAME_HEIGHT = ".bk-btn { height: 31px; line-height: 18px; }"
SMALLER = ".filepond--drop-label.filepond--drop-label label { font-size: 13px; }"
# A file that was taken, in colors that can be read.
READABLE = """
.filepond--item-panel.filepond--item-panel { background-color: #1e5c34; }
.filepond--file-info *, .filepond--file-status * { opacity: 1 !important; color: #fff; }
"""


class Dropper(pn.widgets.FileDropper):
    """A place to drop a file of any type: browsers know none of MATLAB's, and what cannot be read is refused in words.
    Of Panel's it keeps no file once that has been handed on, and never more than one, up to the largest size."""

    def __init__(self, width: int, taken: Callable[[str, bytes], None]) -> None:
        """taken: called with the name and the content of a file; content longer than the largest is not all of it."""
        super().__init__(  # type: ignore[no-untyped-call]
            max_file_size=f"{LARGEST_CSV // MEGABYTE}MB", multiple=False, height=90, width=width, visible=False,
            layout="compact", stylesheets=[SMALLER, READABLE],
        )  # fmt: skip
        self._taken = taken
        self._begin("")

    def _begin(self, name: str) -> None:
        self._name, self._pieces, self._size = name, list[bytes](), 0

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
            self._begin(name)
        if name != self._name or number != len(self._pieces) + 1:
            # A piece of a file of which there is no beginning, or that is refused already.
            return
        self._pieces.append(piece)
        self._size += len(piece)
        if number == last or self._size > LARGEST_CSV:
            content = b"".join(self._pieces)
            self._begin("")
            self._taken(name, content)


def download(
    label: str, width: int, name: str = "file", content: Callable[[], Any] | None = None
) -> pn.widgets.FileDownload:
    """Hidden until there is a file, whose path is set, or what `content` makes."""
    return pn.widgets.FileDownload(
        file=None, callback=content, filename=name, label=label, auto=True, embed=False, visible=False, width=width,
        stylesheets=[SAME_HEIGHT],
    )  # fmt: skip
