"""Tables of every bed, laboratories' own files, and units that look wrong, without a browser."""

import json
import shlex
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import beds
import pandas as pd
import pytest

from freelearn.commands.configuration import settings
from freelearn.commands.settings import DiscoverSettings, TrainSettings
from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.recipe_file import recipe_of
from freelearn.measurements.members_table import read_members
from freelearn.measurements.table import read_table
from freelearn.workbench.asked import discover_settings, train_settings
from freelearn.workbench.comparison import Comparison
from freelearn.workbench.given import Given
from freelearn.workbench.made import Made
from freelearn.workbench.mapped import MappedColumn, recipe_of_choices
from freelearn.workbench.mapping import Mapping
from freelearn.workbench.question import Question
from freelearn.workbench.sessions import Sessions
from freelearn.workbench.steps import Steps

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")

HEADER = "t_s,dl_mm,phi_deg,P,Force (lbf),M_Nmm,<b>note</b>"
ROWS = [
    (n, dl, phi, p, -0.5 - 0.03 * p - 0.4 * dl - 0.002 * phi, -0.1 * p - 0.9 * phi, "<img>")
    for n, (dl, phi, p) in enumerate(
        (dl, phi, p) for dl in (0, 2.5, 5) for phi in (-20, 0, 20) for p in (0, 31.2, 62.5)
    )
]
DESIGN = {"gamma_deg": 40.0, "length_mm": 90.0, "inner_radius_mm": 4.77, "outer_radius_mm": 6.35}


def raw(separator=";", decimal=","):
    lines = [separator.join(str(value).replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([HEADER.replace(",", separator), *lines, ""]).encode()


def table_text(name, **changes):
    return beds.TABLES[name]({}).assign(**changes).to_csv(index=False).encode()


def row_of(page, name):
    return next(row for row in page.rows if row.guess["name"] == name)


def given(page):
    for name, value in DESIGN.items():
        page.design.numbers[name].value = value


@pytest.fixture
def mapping(sessions, finish):
    """A session and the page's table of the columns of a laboratory's file."""
    session = sessions.get("")[1]
    session.upload("my rig.csv", raw())
    finish(session)
    page = Mapping(session)
    page.refresh()
    return session, page


# --- every bed ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", list(beds.TABLES))
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
    assert len(page.maps_view.objects) == len(measured)
    for sample in page.sample.options:
        page.sample.value = sample
        assert page.curves.panels[0].title.text.startswith(f"{page.curves.shown[0].title}: sample {sample}")
    page.sample.value = 1
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
    assert "elongation_mm" in session.problem
    assert not session.ready
    session.choose(bed="dead_load")
    finish(session)
    assert (session.problem, session.ready) == ("", True)


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
    assert Question.from_json(json.loads(json.dumps(question.to_json()))) == question


def test_a_question_of_former_times_is_still_read():
    old = {"data": "csv", "seed": 1, "path": "/a.csv", "name": "a", "model": "linear", "train": "all", "effects": ["x"]}
    assert Question.from_json(old) == Question("csv", 1, "/a.csv", "a", "linear", "all", ("x",))


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


# --- a laboratory's own file ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_guess_is_shown_and_the_table_that_is_made_of_it_is_fitted(mapping, finish, sessions):
    session, page = mapping
    assert session.problem == ""
    assert not session.ready
    assert page.view.visible
    said = {row.guess["name"]: (row.quantity.value, row.unit.value) for row in page.rows}
    assert said == {
        "t_s": ("time", "s"),
        "dl_mm": ("elongation", "mm"),
        "phi_deg": ("twist", "deg"),
        "P": ("pressure", "kPa"),
        "Force (lbf)": ("force", "lbf"),
        "M_Nmm": ("moment", "N·mm"),
        "<b>note</b>": ("not used", None),
    }
    # Everything has a name that a reader of the page's text hears.
    assert row_of(page, "P").unit.name == "unit of P"
    assert "the heading says no unit" in row_of(page, "P").about.object
    assert "&lt;b&gt;note" in row_of(page, "<b>note</b>").about.object
    assert "first 0" in row_of(page, "t_s").about.object

    # Not before the design is known.
    page.use.clicks += 1
    assert not session.busy
    assert "unloaded length [mm], the inner radius" in page.problem.object
    given(page)
    # What the recipe's own reader has to say stands there too.
    row_of(page, "Force (lbf)").quantity.value = row_of(page, "M_Nmm").quantity.value = "not used"
    page.use.clicks += 1
    finish(session)
    page.refresh()
    assert "nothing measured is given" in page.problem.object
    left = Given(session, 260)
    left.refresh()
    assert not left.doubts.faults_view.visible
    row_of(page, "Force (lbf)").quantity.value, row_of(page, "M_Nmm").quantity.value = "force", "moment"
    page.use.clicks += 1
    finish(session)
    assert session.problem == ""
    assert session.ready
    assert session.question.name == "my rig_table.csv"
    table = pd.read_csv(session.question.path)
    assert table["force_n"].iloc[0] == pytest.approx(ROWS[0][4] * 4.4482216)
    assert list(table["step"][:4]) == [0, 1, 2, 0]

    made = Made(session)
    made.refresh()
    page.refresh()
    assert (made.view.visible, page.view.visible) == (True, False)
    assert Path(made.table.file).read_text() == Path(session.question.path).read_text()
    assert made.table.filename == "my rig_table.csv"
    provenance = json.loads(Path(made.provenance.file).read_text())
    assert provenance["uploaded_as"] == "my rig.csv"
    recipe = Path(made.recipe.file).read_text()
    assert provenance["recipe"]["content"] == recipe
    assert recipe_of(recipe, "recipe").bed == "kinematic"
    assert shlex.split(session.made["command"])[:2] == ["python", "intake.py"]

    # A restart finds it again; the columns can be changed.
    again = Sessions(sessions.folder).get(session.folder.name)[1]
    assert (again.made, again.raw) == (session.made, session.raw)
    made.again.clicks += 1
    page.refresh()
    assert page.view.visible
    row_of(page, "Force (lbf)").turned.value = True
    row_of(page, "Force (lbf)").offset.value = 1.0
    page.use.clicks += 1
    finish(session)
    table = pd.read_csv(session.question.path)
    assert table["force_n"].iloc[0] == pytest.approx((1 - ROWS[0][4]) * 4.4482216)


@pytest.mark.slow
def test_excel_and_a_recipe_are_taken(sessions, finish):
    session = sessions.get("")[1]
    book = BytesIO()
    pd.DataFrame([row[:6] for row in ROWS], columns=HEADER.split(",")[:6]).to_excel(book, index=False)
    session.upload("run 7.xlsx", book.getvalue())
    finish(session)
    assert [column["quantity"] for column in session.raw["guess"]["columns"]][1] == "elongation_mm"
    columns = [MappedColumn("dl_mm", "elongation", "mm"), MappedColumn("P", "pressure", "kPa")]
    columns += [MappedColumn("Force (lbf)", "force", "lbf"), MappedColumn("phi_deg", "twist", "deg")]
    recipe = recipe_of_choices("isometric", columns, DESIGN)
    session.upload("mine.yaml", recipe.encode())
    finish(session)
    assert (session.problem, session.ready) == ("", True)
    assert (session.question.bed, session.question.name) == ("isometric", "run 7_table.csv")
    assert Path(session.made["recipe"]).read_text() == recipe
    session.upload("mine.yaml", b"bed: kinematic\ncolumns: {force_n: {from: Nonsense, unit: N}}\n")
    finish(session)
    assert "the recipe has" in session.problem


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.pkl", b"\x80\x04cos\nsystem\n", "a.pkl is a pickle"),
        ("a.xlsx", b"PK\x03\x04 no book", "a.xlsx"),
        ("a.csv", b"", "a.csv is empty"),
        ("a.mat", b"MATLAB 7.3 MAT-file", "a.mat"),
    ],
)
def test_what_cannot_be_read_is_told_by_its_name(sessions, finish, name, content, says):
    session = sessions.get("")[1]
    session.upload(name, content)
    finish(session)
    assert says in session.problem
    assert not session.raw
    assert str(session.folder) not in session.problem


@pytest.mark.slow
def test_a_table_with_faults_tells_them_and_may_be_mapped_all_the_same(sessions, finish):
    session = sessions.get("")[1]
    table = beds.TABLES["inflation"]({}).rename(columns={"outer_radius_mm": "Ro (in)"})
    session.choose(data="csv")
    session.choose(bed="inflation")
    session.upload("mine.csv", table.to_csv(index=False).encode())
    finish(session)
    assert "outer_radius_mm" in session.problem
    page, left = Mapping(session), Given(session, 260)
    page.refresh()
    left.refresh()
    assert (page.view.visible, left.doubts.map.visible) == (False, True)
    left.doubts.map.clicks += 1
    page.refresh()
    assert page.view.visible
    assert page.bed.value == "inflation"
    assert row_of(page, "outer_diameter_mm").quantity.value == "outer diameter"


def test_several_pressures_are_several_actuators():
    columns = [MappedColumn("dl", "elongation", "mm"), MappedColumn("phi", "twist", "rad")]
    columns += [MappedColumn("P1", "pressure", "bar"), MappedColumn("P2", "pressure", "psi")]
    columns += [MappedColumn("F", "force", "N", turned=True), MappedColumn("M", "moment", "N·m", offset=0.5)]
    design = {name: value for name, value in DESIGN.items() if name != "gamma_deg"}
    text = recipe_of_choices("kinematic", columns, design, [40.0, -40.0], "two: of them")
    recipe = recipe_of(text, "recipe")
    assert [member.constants["gamma_deg"] for member in recipe.members] == [40, -40]
    assert [member.pressure.unit for member in recipe.members] == ["bar", "psi"]
    assert (recipe.columns["force_n"].sign, recipe.columns["moment_nmm"].offset) == (-1, 0.5)
    assert recipe.about == "two: of them"
    with pytest.raises(UserError, match="give 2 fiber angles, not 1"):
        recipe_of_choices("kinematic", columns, design, [40.0])


@pytest.mark.parametrize(
    ("quantity", "unit", "made"),
    [("held length", "in", 0.0), ("stretch", "1", 0.0), ("strain", "%", None), ("contraction", "%", None)],
)
def test_lengths_and_ratios_become_elongations(quantity, unit, made):
    columns = [MappedColumn("x: y", quantity, unit), MappedColumn("F", "force", "N")]
    constants = DESIGN | {"twist_deg": 0.0, "pressure_kpa": 10.0}
    column = recipe_of(recipe_of_choices("isometric", columns, constants), "recipe").columns["elongation_mm"]
    assert column.source == "x: y"
    assert bool(column.minus) == (made is not None)
    assert column.times == (None if quantity == "held length" else "length_mm")
    assert column.sign == (-1 if quantity == "contraction" else 1)


def test_two_columns_cannot_be_one_thing():
    columns = [MappedColumn("a", "elongation", "mm"), MappedColumn("b", "stretch", "1")]
    with pytest.raises(UserError, match="'a' and 'b' are both"):
        recipe_of_choices("kinematic", columns, {})


@pytest.mark.parametrize("name", ["yes", "1e5", "12:30", "P {1}", "tab\tle", "#", "a: b", '"', "\\", "ü", "~"])
def test_any_name_of_a_column_is_a_text_of_the_recipe(name):
    columns = [MappedColumn(name, "force", "N"), MappedColumn("s", "sample", words=(name, "on", "2"))]
    constants = DESIGN | {"twist_deg": 0.0, "pressure_kpa": 10.0, "elongation_mm": 0.0}
    recipe = recipe_of(recipe_of_choices("isometric", columns, constants), "recipe")
    assert recipe.columns["force_n"].source == name
    assert recipe.sample.numbers == {name: 1, "on": 2, "2": 3}


# --- units that look wrong ------------------------------------------------------------------------------------------


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
def test_a_missing_reading_is_no_reason_to_wait(sessions, finish):
    session = sessions.get("")[1]
    session.choose(data="csv")
    session.choose(bed="inflation")
    session.upload("mine.csv", beds.TABLES["inflation"]({}).drop(columns="force_n").to_csv(index=False).encode())
    finish(session)
    assert session.table["warnings"] == ["The table has no force_n: only the other readings are fitted and scored."]
    assert session.ready
