"""Drawings made once, and before the slider comes to them."""

import pytest
from bokeh.document import Document
from panel.io.state import set_curdoc

from freelearn.workbench.panels.comparison import AHEAD, KEPT, Ahead


@pytest.fixture
def made():
    """The curves that were drawn, in order."""
    return []


@pytest.fixture
def ahead(made):
    def make(curve):
        made.append(curve)
        return f"drawing of {curve}"

    return Ahead(make)


def run_all(document):
    """Has every callback that waits be called, and those that they ask for; how many there were."""
    count = 0
    while waiting := document.session_callbacks:
        (callback,) = waiting
        document.remove_timeout_callback(callback)
        callback.callback()
        count += 1
    return count


def test_a_drawing_is_made_once_until_it_would_show_something_else(ahead, made):
    assert [ahead.drawing(curve) for curve in (3, 4, 3)] == ["drawing of 3", "drawing of 4", "drawing of 3"]
    assert made == [3, 4]
    ahead.clear()
    ahead.drawing(3)
    assert made == [3, 4, 3]


def test_the_next_ones_are_made_one_by_one_while_nobody_waits(ahead, made):
    document = Document()
    with set_curdoc(document):
        ahead.prefetch([7, 8, 9, 10, 11])
        assert made == []
        # Asked for again before the time has come: still one callback.
        ahead.prefetch([8, 9, 10, 11])
        assert len(document.session_callbacks) == 1
        assert run_all(document) == AHEAD
        assert made == [8, 9]
        ahead.prefetch([8, 9])
        assert not document.session_callbacks
        # What was to be drawn is no more.
        ahead.prefetch([10])
        ahead.clear()
        run_all(document)
    assert made == [8, 9]


def test_without_a_page_nothing_is_made_ahead(ahead, made):
    ahead.prefetch([1, 2])
    assert made == []


def test_no_more_are_kept_than_there_is_room_for(ahead, made):
    for curve in range(KEPT + 5):
        ahead.drawing(curve)
    assert len(ahead.kept) == KEPT
    ahead.drawing(KEPT + 4)
    assert len(made) == KEPT + 5
    ahead.drawing(0)
    assert made[-1] == 0
