"""One box to tick. Bokeh's own single one has no label that a reader of the page's text would hear."""

from __future__ import annotations

from collections.abc import Callable

import panel as pn


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
