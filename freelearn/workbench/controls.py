"""Places to drop a file, and buttons that give one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn

from freelearn.workbench.session import LARGEST_CSV, MEGABYTE

# As high as a button beside it, and words that fit a narrow place.
SAME_HEIGHT = ".bk-btn { height: 31px; line-height: 18px; }"
SMALLER = ".filepond--drop-label.filepond--drop-label label { font-size: 13px; }"


def dropper(width: int, taken: Callable[[str, bytes], None]) -> pn.widgets.FileDropper:
    """Of any type: browsers know none of MATLAB's, and what cannot be read is refused in words. taken: called with the
    name and the content of the file dropped last."""
    widget = pn.widgets.FileDropper(
        max_file_size=f"{LARGEST_CSV // MEGABYTE}MB", multiple=False, height=90, width=width, visible=False,
        layout="compact", stylesheets=[SMALLER],
    )  # fmt: skip

    def dropped(event: Any) -> None:
        # Of the files dropped so far the latest.
        for name, content in list((event.new or {}).items())[-1:]:
            taken(str(name), content.encode() if isinstance(content, str) else content)

    widget.param.watch(dropped, "value")
    return widget


def download(
    label: str, width: int, name: str = "file", content: Callable[[], Any] | None = None
) -> pn.widgets.FileDownload:
    """Hidden until there is a file, whose path is set, or what `content` makes."""
    return pn.widgets.FileDownload(
        file=None, callback=content, filename=name, label=label, auto=True, embed=False, visible=False, width=width,
        stylesheets=[SAME_HEIGHT],
    )  # fmt: skip
