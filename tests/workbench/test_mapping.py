"""Laboratories' own files on the page: what their columns are, and the table made of them, without a browser."""

import json
import shlex
from io import BytesIO
from pathlib import Path

import beds
import pandas as pd
import pytest

from freelearn.errors import UserError
from freelearn.measurements.intake.recipe_file import recipe_of
from freelearn.workbench.given import Given
from freelearn.workbench.made import Made
from freelearn.workbench.mapped import MappedColumn, recipe_of_choices
from freelearn.workbench.mapping import Mapping
from freelearn.workbench.sessions import Sessions

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
    session.upload("mine.yaml", b"bed: kinematic\n")
    assert "drop that file first" in session.problem
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


def test_steps_and_marks_of_a_table_are_kept():
    columns = [MappedColumn("n: o", "step"), MappedColumn("bent", "buckled"), MappedColumn("away", "left out")]
    columns.append(MappedColumn("F", "force", "N"))
    constants = DESIGN | {"elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": 10.0}
    recipe = recipe_of(recipe_of_choices("isometric", columns, constants), "recipe")
    assert recipe.steps.source == "n: o"
    assert set(recipe.marks) == {"buckled", "left_out"}
    with pytest.raises(UserError, match="'bent' and 'F' are both the buckled"):
        recipe_of_choices("isometric", [*columns[:3], MappedColumn("F", "buckled")], constants)


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
