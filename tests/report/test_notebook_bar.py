"""The bar that a notebook shows: after a while, with what is done, and gone at the end."""

import sys
from types import SimpleNamespace

from freelearn.common.progress import tell, watched
from freelearn.report.terminal import long_work


class Display:
    def __init__(self):
        self.shown = []

    def display(self, html, display_id):
        self.shown.append(html)
        return self

    def update(self, html):
        self.shown.append(html)


def test_long_work_has_a_bar_that_goes_away(monkeypatch):
    display = Display()
    shown = SimpleNamespace(display=display.display, HTML=lambda text: text)
    monkeypatch.setitem(sys.modules, "IPython.display", shown)
    monkeypatch.setattr(long_work, "BAR_SOON", 0.0)
    monkeypatch.setattr(long_work, "EVERY", 0.0)
    with long_work.NotebookBar("searching") as bar, watched(bar):
        tell("a < b", 1, 4)
        tell("then", 2, 4)
    first, second, last = display.shown
    assert 'value="1" max="4"' in first
    assert "searching: a &lt; b" in first
    assert "then" in second
    assert last == ""


def test_short_work_has_none(monkeypatch):
    display = Display()
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display.display, HTML=str))
    with long_work.NotebookBar("fitting") as bar, watched(bar):
        tell("all of it", 1, 1)
    assert not display.shown
    assert not long_work.in_notebook()
