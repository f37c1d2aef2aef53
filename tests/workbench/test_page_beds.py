"""Tables of every bed on the page, without a browser."""

import json
from dataclasses import replace
from html import unescape
from pathlib import Path

import beds
import pytest
from nightly import usually
from pydantic import TypeAdapter

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members
from freelearn.workbench.panels.comparison import Comparison
from freelearn.workbench.panels.data_step import Given
from freelearn.workbench.panels.steps import Steps
from freelearn.workbench.state.question import Question
from freelearn.workbench.state.reading import discover_settings, train_settings

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


def table_text(name, **changes):
    return beds.TABLES[name]({}).assign(**changes).to_csv(index=False).encode()


def _filled(page):
    """Whether any band is drawn."""
    return any(len(source.data["across"]) for panel in page.curves.bands for source in panel.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", usually("isometric", nightly=[name for name in beds.TABLES if name != "isometric"]))
def test_a_table_of_each_bed_is_fitted_and_its_quantities_are_shown(sessions, finish, name):
    session = sessions.get("")[1]
    bed = "kinematic" if name == "block" else name
    session.choose(data="csv")
    session.choose(bed=bed)
    if name == "block":
        session.give_members(beds.MEMBERS.to_csv(index=False).encode())
    session.upload("mine.csv", table_text(name))
    finish(session)
    assert session.problem == ""
    assert (session.table["bed"], session.table["members"]) == (bed, 3 if name == "block" else 0)
    left = Given(session, 260)
    left.refresh()
    assert left.block.count == (3 if name == "block" else 1)
    session.choose(train="all")
    session.start("train")
    finish(session)
    assert session.job.status == "done", session.job.text
    page = Comparison(session)
    page.refresh()
    measured = BEDS[bed].measured
    assert [q.name for q in page.maps.quantities] == [q.name for q in measured]
    shown = {panel.y.name for panel in page.curves.shown}
    assert {q.name for q in measured} <= shown
    first = BEDS[bed].state[0]
    assert all(first.suffix in label for label in page.labels.values())
    assert len(page.map_panes) == len(measured)
    if name == "dead_load":
        # Nobody measured the second one's length: no empty map of it.
        page.sample.value = 2
        assert [q.name for q in page.maps.quantities] == ["twist"]
    for sample in page.sample.options:
        page.sample.value = sample
        assert page.curves.panels[0].title.text.startswith(f"{page.curves.shown[0].title}: sample {sample}")
    page.sample.value = 1
    # The bands go and come back without a fit.
    assert page.banded.ticked
    assert _filled(page)
    page.banded.view.value = []
    page.show_bands()
    assert not session.banded
    assert not _filled(page)
    session.show_bands(True)
    page.show_bands()
    assert page.banded.ticked
    assert _filled(page)
    # A click on the map moves to a state of that cell.
    page.maps.source.selected.indices = [len(page.shown) - 1]
    inside = (page.now.field == page.shown[-1]) & page.now.usable
    assert page._curve() in page.now.curve[inside]
    # The command that is shown does the same.
    asked = settings(TrainSettings, session.question.overrides("train"))
    assert asked.data == train_settings(session.question, Path("fits")).data


@pytest.mark.slow
def test_another_bed_reads_the_same_file_anew(sessions, finish):
    session = sessions.get("")[1]
    session.upload("mine.csv", table_text("dead_load"))
    finish(session)
    # Read as of a kinematic bed: what nobody measured is then an imposed quantity that is blank.
    assert session.problem.startswith("As a table of the bed dead_load it has no faults: choose that bed.\n")
    assert "elongation_mm: is blank" in session.problem
    assert not session.ready
    session.choose(bed="dead_load")
    finish(session)
    assert (session.problem, session.ready) == ("", True)


@pytest.mark.slow
def test_the_measured_muscle_is_there_with_what_is_known_of_it(sessions, finish):
    session = sessions.get("")[1]
    session.choose(data="dmsp20")
    finish(session)
    question = session.question
    assert (session.ready, session.table["rows"], question.bed) == (True, 126, "isometric")
    assert question.command("discover") == (
        "python discover.py model=continuum train=all data=dmsp20 'effects=[fiber_misalignment]' "
        "'ruled_out=[force_gain,pressure_gain]'"
    )
    page = Given(session, 260)
    page.refresh()
    assert "Martens & Boblan (2017), CC BY 4.0" in unescape(page.doubts.about.object)
    assert not page.file.visible
    # Nothing of it stays behind with other data.
    session.choose(data="virtual")
    assert session.question == Question()


@pytest.mark.slow
@pytest.mark.nightly
def test_a_set_of_too_few_states_is_tested_on_rows(sessions, finish):
    session = sessions.get("")[1]
    table = beds.TABLES["dead_load"]({})
    one = (table["sample"] == 1) | (table["moment_nmm"] == -30)
    session.choose(data="csv")
    session.choose(bed="dead_load")
    session.upload("mine.csv", table[one].to_csv(index=False).encode())
    finish(session)
    page = Steps(session)
    page.refresh()
    # All of them: the other sample has states enough.
    assert "tested on single rows" not in page.effects.object
    session.start("train")
    finish(session)
    assert session.job.status == "done", session.job.text
    assert set(session.read(session.runs[-1], "results.json")["tests"]) == {"sample1", "all"}
    session.choose(train="sample2")
    page.refresh()
    assert "tested on single rows" in page.effects.object
    assert "split=rows" in session.question.overrides("train")
    session.start("train")
    finish(session)
    assert session.job.status == "done", session.job.text
    errors = session.read(session.runs[-1], "results.json")["tests"]
    assert set(errors) == {"sample1", "sample2", "even", "all"}
    session.choose(train="all")
    assert session.question.split == "states"


def test_the_accuracy_of_own_files_is_estimated(sessions):
    session = sessions.get("")[1]
    page = Given(session, 260)
    for data, options in (("virtual", []), ("csv", ["data.accuracy=estimate"]), ("hidden", []), ("dmsp20", [])):
        session.choose(data=data)
        page.refresh()
        assert [word for word in session.question.overrides("train") if "accuracy" in word] == options
        session.cancel()
    session.choose(data="csv")
    page.refresh()
    assert page.accuracy.how.value == "estimate it from the data"
    # What the user chose instead stays with the next file.
    page.accuracy.how.value = "as the paper's bed"
    session.upload("mine.csv", table_text("isometric"))
    assert session.question.accuracy == ()
    session.cancel()


def test_a_file_dropped_on_simulated_data_has_its_accuracy_estimated(sessions):
    session = sessions.get("")[1]
    session.upload("mine.csv", table_text("isometric"))
    assert (session.question.data, session.question.accuracy) == ("csv", None)
    session.cancel()


def test_a_diameter_is_of_one_actuator(tmp_path):
    (tmp_path / "a.csv").write_text("")
    path = str(tmp_path / "a.csv")
    with pytest.raises(UserError, match="one actuator"):
        train_settings(Question("csv", path=path, bed="inflation", members=path), tmp_path)


@pytest.mark.parametrize(
    "changes",
    [
        {"accuracy": None},
        {"accuracy": (("outer_diameter_mm", 0.05), ("force_n", 0.1))},
        {"ruled_out": ("force_gain", "end_clamps"), "per_sample": False},
        {"data": "dmsp20", "path": "", "bed": "isometric", "split": "rows"},
        {"data": "virtual", "path": "", "bed": "kinematic", "ruled_out": ("relaxation",)},
        {"data": "hidden", "path": "", "bed": "kinematic", "seed": 4},
    ],
)
def test_settings_are_those_of_the_command(tmp_path, changes):
    (tmp_path / "it's mine.csv").write_text("")
    question = replace(Question("csv", path=str(tmp_path / "it's mine.csv"), bed="inflation", train="all"), **changes)
    search = settings(DiscoverSettings, question.overrides("discover"))
    assert search == replace(discover_settings(question))
    fit = settings(TrainSettings, question.overrides("train"))
    assert fit == replace(train_settings(question, fit.fits))
    assert TypeAdapter(Question).validate_python(json.loads(json.dumps(question.to_json()))) == question


def test_a_question_of_former_times_is_still_read():
    old = {"data": "csv", "seed": 1, "path": "/a.csv", "name": "a", "model": "linear", "train": "all", "effects": ["x"]}
    assert TypeAdapter(Question).validate_python(old) == Question("csv", 1, "/a.csv", "a", "linear", "all", ("x",))


def test_what_is_ruled_out_does_not_ask_for_another_fit(sessions):
    one = Question(effects=("end_clamps",))
    other = replace(one, ruled_out=("force_gain",))
    assert one.about("train") == other.about("train")
    assert one.about("discover") != other.about("discover")
    assert one.same_but_effects(other)


def test_accuracy_is_asked_in_the_quantities_of_the_bed(sessions):
    session = sessions.get("")[1]
    session.choose(data="csv")
    session.choose(bed="inflation")
    page = Given(session, 260)
    page.refresh()
    page.accuracy.how.value = "state it"
    page.refresh()
    shown = {name for name, widget in page.accuracy.numbers.items() if widget.visible}
    assert shown == {"elongation_mm", "twist_deg", "pressure_kpa", "force_n", "outer_diameter_mm"}
    assert page.accuracy.numbers["outer_diameter_mm"].name == "σ of outer diameter [mm]"
    page.accuracy.numbers["outer_diameter_mm"].value = 0.5
    assert dict(session.question.accuracy)["outer_diameter_mm"] == 0.5
    page.accuracy.how.value = "estimate it from the data"
    assert session.question.accuracy is None


@pytest.mark.parametrize("bed", list(BEDS))
@pytest.mark.parametrize("several", [1, 2])
def test_a_template_is_a_table_of_the_bed(sessions, tmp_path, bed, several):
    if bed == "inflation" and several > 1:
        pytest.skip("of one actuator")
    session = sessions.get("")[1]
    session.choose(data="csv")
    session.choose(bed=bed)
    page = Given(session, 260)
    page.refresh()
    page.block.actuators.value = several
    assert (page.template.visible, page.block.template.visible) == (True, several > 1)
    (tmp_path / "table.csv").write_text(page.template.callback().read())
    (tmp_path / "members.csv").write_text(page.block.template.callback().read())
    members = read_members(tmp_path / "members.csv") if several > 1 else None
    assert len(read_table(tmp_path / "table.csv", BEDS[bed], members).table) == 1
