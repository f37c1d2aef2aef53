"""Units that look wrong are said first, without a browser."""

import beds
import pandas as pd
import pytest

from freelearn.workbench.panels.data_step import Given
from freelearn.workbench.panels.mapping import Mapping
from freelearn.workbench.panels.steps import Steps
from freelearn.workbench.state.session import Sessions

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


@pytest.mark.slow
def test_units_that_look_wrong_are_said_first_and_the_fit_waits_for_an_answer(sessions, finish):
    session = sessions.get("")[1]
    table = beds.TABLES["inflation"]({})
    text = table.assign(pressure_kpa=1000 * table["pressure_kpa"]).to_csv(index=False).encode()
    session.choose(data="csv")
    session.choose(bed="inflation")
    session.upload("mine.csv", text)
    finish(session)
    assert [True for warning in session.doubted if "pascals" in warning]
    page = Steps(session)
    page.refresh()
    assert page.fit.disabled
    assert page.find.disabled
    assert "pascals" in page.given.doubts.units.object
    assert "waits" in page.effects.object
    session.start("train")
    session.start("discover")
    assert not session.busy
    page.given.doubts.right.view.value = [page.given.doubts.right.text]
    page.refresh()
    assert not page.fit.disabled
    # Said for this file: remembered, and asked anew of another.
    restarted = Sessions(sessions.folder).get(session.folder.name)[1]
    assert restarted.ready
    session.upload("other.csv", text.replace(b"\n", b"\n", 1) + b"\n")
    finish(session)
    assert not session.ready
    session.upload("again.csv", text)
    finish(session)
    assert session.ready
    page.refresh()
    assert page.given.doubts.right.ticked
    page.given.doubts.right.view.value = []
    assert not session.ready


@pytest.mark.slow
@pytest.mark.nightly
def test_units_are_put_right_on_the_page_and_nothing_else_is_lost(sessions, finish):
    session = sessions.get("")[1]
    right = beds.TABLES["isometric"]({}).assign(left_out=0)
    right.loc[3, "buckled"] = right.loc[5, "left_out"] = 1
    wrong = right.assign(pressure_kpa=1000 * right["pressure_kpa"])
    session.choose(data="csv")
    session.choose(bed="isometric")
    session.upload("mine.csv", wrong.to_csv(index=False).encode())
    finish(session)
    left, page = Given(session, 260), Mapping(session)
    left.refresh()
    assert left.doubts.map.visible
    left.doubts.map.clicks += 1
    page.refresh()
    assert page.view.visible
    assert "no measurement table" not in page.about.object
    next(row for row in page.rows if row.guess.name == "pressure_kpa").unit.value = "Pa"
    page.make.clicks += 1
    finish(session)
    assert (session.problem, session.unit_warnings, session.ready) == ("", [], True)
    table = pd.read_csv(session.question.path)
    assert set(table) == set(right)
    for name in right:
        assert table[name].to_numpy() == pytest.approx(right[name].to_numpy()), name


@pytest.mark.slow
def test_a_missing_reading_is_no_reason_to_wait(sessions, finish):
    session = sessions.get("")[1]
    session.choose(data="csv")
    session.choose(bed="inflation")
    session.upload("mine.csv", beds.TABLES["inflation"]({}).drop(columns="force_n").to_csv(index=False).encode())
    finish(session)
    assert session.table["warnings"] == ["The table has no force_n: only the other readings are fitted and scored."]
    assert session.ready
