"""A bar in the terminal for what takes long, and nothing where nobody looks on."""

import io

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from freelearn.common.progress import tell, watched
from freelearn.report.tables.residual_tables import MOST_FIELDS, drawn
from freelearn.report.terminal import long_work
from freelearn.report.terminal.long_work import LongWork


def said(monkeypatch, terminal: bool, soon: float) -> str:
    monkeypatch.setattr(long_work, "SOON", soon)
    console = Console(file=io.StringIO(), force_terminal=terminal, width=80)
    with LongWork(console, "reading the table…") as shown, watched(shown):
        tell("reading", 1, 4)
        shown.bar.refresh()
        tell("writing", 2, 4)
        shown.bar.refresh()
    tell("afterwards", 1, 1)
    return console.file.getvalue()


def test_in_a_terminal_long_work_has_a_bar(monkeypatch):
    text = said(monkeypatch, terminal=True, soon=0.0)
    assert text.index("reading") < text.index("writing")
    assert "━" in text
    assert "afterwards" not in text


@pytest.mark.parametrize(("terminal", "soon"), [(True, 60.0), (False, 0.0)], ids=["short work", "no terminal"])
def test_elsewhere_there_is_no_bar(monkeypatch, terminal, soon):
    text = said(monkeypatch, terminal, soon)
    assert "━" not in text
    assert "writing" not in text
    assert terminal or not text


def test_without_a_console_nothing_is_shown():
    with LongWork(None, "reading the table…") as shown, watched(shown):
        tell("reading", 1, 2)
    assert not shown.bar.live.is_started


def test_of_very_many_places_some_are_drawn_and_it_is_said():
    table = pd.DataFrame({"sample": 3, "force_n": np.arange(MOST_FIELDS + 5.0)})
    few, words = drawn(table)
    assert words == f"{MOST_FIELDS} of {MOST_FIELDS + 5} places shown"
    assert len(few) == few["force_n"].nunique() == MOST_FIELDS
    assert few["force_n"].is_monotonic_increasing
    same, nothing = drawn(table[:MOST_FIELDS])
    assert len(same) == MOST_FIELDS
    assert not nothing
