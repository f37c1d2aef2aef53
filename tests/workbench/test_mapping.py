"""Laboratories' own files on the page: what their columns are, and the table made of them, without a browser."""

import json
import shlex
from io import BytesIO
from pathlib import Path

import beds
import openpyxl
import pandas as pd
import pytest

from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess, with_meanings
from freelearn.data.intake.guesses.joined import Guessed
from freelearn.data.intake.guesses.meanings import NOT_USED
from freelearn.data.intake.recipes.recipe_file import recipe_of
from freelearn.workbench.panels.data_step import Given
from freelearn.workbench.panels.mapping import Made, Mapping
from freelearn.workbench.state.session import Sessions

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


def page_of(book, name, sessions, finish):
    """The mapping of a workbook that was dropped on the page."""
    content = BytesIO()
    book.save(content)
    session = sessions.get("")[1]
    session.upload(name, content.getvalue())
    finish(session)
    page = Mapping(session)
    page.refresh()
    return page


def row_of(page, name):
    return next(row for row in page.rows if row.guess.name == name)


def given(page):
    for name, value in DESIGN.items():
        page.questions.fields[f"design.{name}"].value = str(value)
    page.questions.fields["braid"].value = page.questions.fields["zero.Force (lbf)"].value = "no"
    row_of(page, "Force (lbf)").turned.value = row_of(page, "M_Nmm").turned.value = "no"


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
    said = {row.guess.name: (row.quantity.value, row.unit.value) for row in page.rows}
    assert said == {
        "t_s": ("time_s", "s"),
        "dl_mm": ("elongation_mm", "mm"),
        "phi_deg": ("twist_deg", "deg"),
        "P": ("pressure_kpa", "say which"),
        "Force (lbf)": ("force_n", "lbf"),
        "M_Nmm": ("moment_nmm", "N·mm"),
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
    for unsaid in ("unit of P: still", "sign of Force (lbf): say", "Unloaded length: still", "a braid, with"):
        assert unsaid in page.problem.object
    given(page)
    page.questions.fields["design.outer_radius_mm"].value = "-6"
    row_of(page, "P").unit.value = "kPa"
    page.use.clicks += 1
    assert "is no size of an actuator" in page.problem.object
    page.questions.fields["design.outer_radius_mm"].value = "+1.58"
    # What the recipe's own reader has to say stands there too.
    readings = {"Force (lbf)": "force_n", "M_Nmm": "moment_nmm", "dl_mm": "elongation_mm", "phi_deg": "twist_deg"}
    for name in readings:
        row_of(page, name).quantity.value = "not used"
    page.questions.fields["held.force_n"].value = page.questions.fields["held.moment_nmm"].value = "0"
    page.make.clicks += 1
    finish(session)
    page.refresh()
    assert "nothing measured is given" in page.problem.object
    left = Given(session, 260)
    left.refresh()
    assert not left.doubts.faults_view.visible
    for name, meaning in readings.items():
        row_of(page, name).quantity.value = meaning
    row_of(page, "Force (lbf)").turned.value = row_of(page, "M_Nmm").turned.value = "no"
    page.make.clicks += 1
    finish(session)
    assert session.problem == ""
    assert session.ready
    assert session.question.name == "my rig_table.csv"
    table = pd.read_csv(session.question.path)
    assert table["force_n"].iloc[0] == pytest.approx(ROWS[0][4] * 4.4482216)
    assert list(table["step"][:4]) == [0, 1, 2, 0]
    assert table["outer_radius_mm"].iloc[0] == 6.35

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
    row_of(page, "Force (lbf)").turned.value = "yes"
    row_of(page, "Force (lbf)").offset.value = 1.0
    page.make.clicks += 1
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
    assert Guessed.from_plain(session.raw["guess"]["guessed"]).found.columns[1].quantity == "elongation_mm"
    recipe = recipe_of_choices()
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
    assert row_of(page, "outer_diameter_mm").quantity.value == "outer_diameter_mm"


def recipe_of_choices():
    """The recipe of the isometric part of that file."""
    columns = {"dl_mm": "elongation_mm", "phi_deg": "twist_deg", "P": "pressure_kpa", "Force (lbf)": "force_n"}
    meanings = {f"what.{name}": meaning for name, meaning in columns.items()} | {"what.M_Nmm": NOT_USED}
    answers = {**meanings, "unit.P": "kPa", **{f"design.{name}": value for name, value in DESIGN.items()}}
    found = with_meanings(guess(raw(), "run 7.csv"), {k.removeprefix("what."): v for k, v in meanings.items()})
    return draft(found, answers={**answers, "bed": "isometric", "sign.Force (lbf)": "no", "braid": "no"})


@pytest.mark.slow
@pytest.mark.nightly
def test_the_page_goes_on_to_the_report(mapping, finish):
    session, page = mapping
    given(page)
    row_of(page, "P").unit.value = "kPa"
    page.use.clicks += 1
    kinds = [session.job.kind]
    while kinds[-1] != "train":
        session.poll()
        assert session.busy, session.problem
        kinds += [session.job.kind] if session.job.kind != kinds[-1] else []
    assert (kinds, session.then) == (["convert", "check", "train"], "discover")
    session.cancel()


@pytest.mark.slow
@pytest.mark.nightly
def test_several_pressures_are_several_actuators(sessions, finish):
    session = sessions.get("")[1]
    lines = [f"{dl},{phi},{p},{10 - p},{-p},{dl}" for dl in (0, 5) for phi in (0, 20) for p in (0, 4, 8)]
    session.upload("three.csv", "\n".join(["dl_mm,phi_rad,P1_bar,P2_psi,F_N,M_Nm", *lines, ""]).encode())
    finish(session)
    page = Mapping(session)
    page.refresh()
    # Two pressures of different units are no pair until somebody says so, and neither is taken by itself.
    assert "parallel" not in page.questions.fields
    assert not row_of(page, "P1_bar").quantity.value
    page.use.clicks += 1
    assert "what P1_bar is" in page.problem.object
    row_of(page, "P1_bar").quantity.value = row_of(page, "P2_psi").quantity.value = "pressure_kpa"
    page.questions.fields["parallel"].value = "all"
    for key, value in {
        "member.1": "40",
        "member.2": "-40",
        "braid": "no",
        "same_sizes": "yes",
        "slack": "no",
        "design.length_mm": "90",
    }.items():
        page.questions.fields[key].value = value
    page.questions.fields["design.inner_radius_mm"].value = "d 10"
    page.questions.fields["design.outer_radius_mm"].value = "+1"
    row_of(page, "F_N").turned.value, row_of(page, "M_Nm").turned.value = "yes", "no"
    page.make.clicks += 1
    finish(session)
    assert page.said == ""
    recipe = recipe_of(Path(session.made["recipe"]).read_text(), "recipe")
    assert [member.constants["gamma_deg"] for member in recipe.members] == [40, -40]
    assert [member.pressure.unit for member in recipe.members] == ["bar", "psi"]
    assert (recipe.columns["force_n"].sign, recipe.constants["outer_radius_mm"]) == (-1, 6)


def test_two_columns_cannot_be_one_thing(mapping):
    _, page = mapping
    row_of(page, "phi_deg").quantity.value = "stretch"
    given(page)
    row_of(page, "P").unit.value = "kPa"
    page.questions.fields["held.twist_deg"].value = "0"
    page.use.clicks += 1
    assert "'dl_mm' and 'phi_deg' are both the stretch" in page.problem.object.replace("&#39;", "'")


def test_of_sheets_that_look_alike_one_is_chosen(sessions, finish):
    book = openpyxl.Workbook()
    book.active.title, second = "rot", book.create_sheet("blau")
    for sheet, factor in ((book.active, 1), (second, 2)):
        for row in [("dl_mm", "P_kPa", "F_N"), *((x, p, factor * (p - x)) for x in (0, 5) for p in (0, 50, 100))]:
            sheet.append(row)
    page = page_of(book, "muscles.xlsx", sessions, finish)
    page.use.clicks += 1
    assert "Which sheet holds the readings: still to be said" in page.problem.object
    page.sheet.value = "blau"
    assert page.guessed.found.sheet == "blau"
    assert row_of(page, "F_N").guess.high == 200
    page.use.clicks += 1
    assert "Which sheet" not in page.problem.object


@pytest.mark.nightly
def test_sheets_of_several_clocks_are_joined_by_time(sessions, finish):
    book = openpyxl.Workbook()
    book.active.title, second = "Rig", book.create_sheet("Kraft")
    for row in [("t_s", "dl_mm", "P_kPa"), *((0.5 * i, i % 3, 5.0 * i) for i in range(20))]:
        book.active.append(row)
    for row in [("t", "F_N"), *((1000.0 + 200 * i, -2.0 * i) for i in range(35))]:
        second.append(row)
    page = page_of(book, "two.xlsx", sessions, finish)
    session = page.session
    assert "there are 2 clocks" in page.notes.object
    assert {row_of(page, name).quantity.value for name in ("t", "t_s")} == {"time_s"}
    row_of(page, "t").unit.value = "ms"
    row_of(page, "F_N").turned.value = "no"
    assert page.questions.fields["clock"].value == "t"
    # In another unit they would have no time in common, and the page asks for what lies between.
    row_of(page, "t").unit.value = "s"
    assert "plus.t_s" in page.questions.fields
    row_of(page, "t").unit.value = "ms"
    assert "plus.t_s" not in page.questions.fields
    for name, value in {**{f"design.{n}": v for n, v in DESIGN.items()}, "held.twist_deg": 0}.items():
        page.questions.fields[name].value = str(value)
    page.questions.fields["braid"].value = "no"
    page.make.clicks += 1
    finish(session)
    assert (page.said, session.problem) == ("", "")
    recipe = recipe_of(Path(session.made["recipe"]).read_text(), "recipe")
    (join,) = recipe.join
    assert (recipe.reading.sheet, join.reading.sheet, list(join.columns)) == (
        "Kraft", "Rig", ["elongation_mm", "pressure_kpa"],
    )  # fmt: skip
    table = pd.read_csv(session.folder / session.made["folder"] / "table.csv")
    # At 10 kPa a second, from the load cell's first second on.
    assert table["pressure_kpa"].tolist() == pytest.approx((10 * table["time_s"]).tolist())
    assert table["time_s"].iloc[0] == 1
