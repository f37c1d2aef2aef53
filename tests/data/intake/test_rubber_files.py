"""Tests of rubber alone as laboratories have them: files, sheets, columns side by side, forces, true stresses."""

import io

import numpy as np
import openpyxl
import pytest

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.guess import guess
from freelearn.data.intake.guesses.typed_answers import answer
from freelearn.data.intake.recipes.recipe_file import content_of
from freelearn.data.intake.rubber.rubber_convert import convert_tests
from freelearn.data.intake.rubber.rubber_guess import guess_tests, looks_like_rubber
from freelearn.data.intake.rubber.rubber_questions import rubber_draft, rubber_questions
from freelearn.data.intake.rubber.rubber_recipe import parse_tests

STRETCH = np.array([1.0, 1.2, 1.5, 2.0, 2.5])
# Neo-Hookean with C1 = 0.4 MPa (W = C1/2 (I1 - 3)): nominal stress by mode.
STRESS = {mode: 0.4 * (STRETCH - STRETCH**power) for mode, power in {"UT": -2.0, "ET": -5.0, "PS": -3.0}.items()}
NAMES = {"UT": "uniaxial", "ET": "equibiaxial", "PS": "pure_shear"}


def interview(sources, answers=()):
    """The table, once the questions are answered by their keys, else as proposed; and what was asked."""
    tests = guess_tests(sources)
    made, asked, given = {}, [], dict(answers)
    while question := next((q for q in rubber_questions(tests, made) if q.key not in made), None):
        asked.append(question.key)
        made[question.key] = answer(question, given.get(question.key, ""), made)
    recipe = rubber_draft(tests, made, "files")
    assert "TODO" not in recipe
    return convert_tests(parse_tests(content_of(recipe, "recipe"), "recipe"), sources).table, asked


def check(table, modes=NAMES):
    for mode in modes:
        rows = table[table["mode"] == NAMES[mode]]
        np.testing.assert_allclose(rows["stretch"], STRETCH, rtol=1e-6)
        np.testing.assert_allclose(rows["stress_mpa"], STRESS[mode], rtol=1e-5, atol=1e-9)
    assert set(table["mode"]) == {NAMES[mode] for mode in modes}


def text(header, *columns, separator=","):
    rows = [separator.join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([separator.join(header), *rows, ""]).encode()


def test_three_files_whose_headings_say_all_ask_nothing():
    header = ("Strain [%]", "Eng. stress [kPa]")
    sources = {f"{mode}_3.csv": text(header, 100 * (STRETCH - 1), 1000 * STRESS[mode]) for mode in NAMES}
    table, asked = interview(sources)
    check(table)
    assert asked == []


def test_a_workbook_with_a_sheet_for_each():
    book = openpyxl.Workbook()
    book.active.append(["Charge 12"])
    for mode, title in {"UT": "Zugversuch", "ET": "äquibiaxial", "PS": "Planar"}.items():
        sheet = book.create_sheet(title)
        sheet.append(["Streckung", "Nennspannung [MPa]"])
        for row in zip(STRETCH.tolist(), STRESS[mode].tolist(), strict=True):
            sheet.append(row)
    out = io.BytesIO()
    book.save(out)
    table, asked = interview({"Gummi.xlsx": out.getvalue()})
    check(table)
    assert asked == []


def test_tests_side_by_side_in_one_sheet():
    header = [f"{mode} {what}" for mode in NAMES for what in ("stretch", "nominal stress [MPa]")]
    content = text(header, *(column for mode in NAMES for column in (STRETCH, STRESS[mode]))).decode()
    # The shorter ones end with blanks.
    table, asked = interview({"treloar.csv": (content + "3,1,,,,\n").encode()})
    check(table[table["stretch"] < 3])
    assert (table["stretch"] == 3).sum() == 1
    assert asked == []


def test_forces_and_elongations_need_the_specimen_and_find_it_above_the_table():
    head = "Specimen Width (mm);6\nSpecimen Thickness (mm);3\nGauge length [mm];33\n"
    content = head.encode() + text(("Weg [mm]", "Kraft [N]"), 33 * (STRETCH - 1), 18 * STRESS["UT"], separator=";")
    table, asked = interview({"Zug 1.csv": content})
    check(table, ["UT"])
    assert asked == ["1.length_mm", "1.width_mm", "1.thickness_mm"]
    without = content[len(head) :]
    table, _ = interview({"Zug 1.csv": without}, {"1.length_mm": "3.3 cm", "1.width_mm": "6", "1.thickness_mm": "3"})
    check(table, ["UT"])


def test_true_stresses_and_strains_become_nominal_ones():
    header = ("True Strain", "True Stress (MPa)")
    table, asked = interview({"tensile.csv": text(header, np.log(STRETCH), STRESS["UT"] * STRETCH)})
    check(table, ["UT"])
    assert asked == []
    # A heading that does not say which is asked about.
    sources = {"tensile.csv": text(("stretch", "Spannung [MPa]"), STRETCH, STRESS["UT"] * STRETCH)}
    table, asked = interview(sources, {"1.stress.kind": "2"})
    check(table, ["UT"])
    assert asked == ["1.stress.kind"]


def test_a_strain_that_may_be_percent_is_asked_about():
    sources = {"tensile.csv": text(("strain", "nominal stress"), 100 * (STRETCH - 1), 1000 * STRESS["UT"])}
    table, asked = interview(sources, {"1.along.unit": "%", "1.stress.unit": "kPa"})
    check(table, ["UT"])
    assert asked == ["1.along.unit", "1.stress.unit"]


def test_what_follows_a_tear_and_specimens_that_follow_each_other():
    torn = np.append(STRETCH, 2.6), np.append(STRESS["UT"], 0.01)
    two = text(("stretch", "nominal stress [MPa]"), *(np.concatenate([one, one]) for one in torn))
    table, asked = interview({"tensile.csv": two})
    assert asked == ["1.torn"]
    assert table["specimen"].tolist() == ["1"] * 5 + ["2"] * 5
    check(table[table["specimen"] == "2"], ["UT"])
    table, _ = interview({"tensile.csv": two}, {"1.torn": "n"})
    assert len(table) == 12


def test_a_test_that_is_none_is_left_out():
    header = ("stretch", "nominal stress [MPa]")
    sources = {f"{name}.csv": text(header, STRETCH, STRESS["UT"]) for name in ("ut", "other")}
    table, _ = interview(sources, {"2.mode": "not used"})
    check(table, ["UT"])


@pytest.mark.parametrize(
    ("header", "is_one"),
    [
        (("stretch", "nominal stress [MPa]"), True),
        (("lambda", "P_MPa"), None),
        (("Weg [mm]", "Kraft [N]"), None),
        (("dl [mm]", "P [kPa]", "F [N]"), False),
        (("dl [mm]", "phi [deg]", "F [N]"), False),
    ],
)
def test_which_files_are_of_rubber(header, is_one):
    found = guess(text(header, *([STRETCH] * len(header))), "a.csv")
    assert looks_like_rubber(found) is is_one


@pytest.mark.parametrize(
    ("recipe", "says"),
    [
        ("tests:", "lists no tests"),
        ("tests: [{mode: torn, columns: {stretch: {from: a}, stress_mpa: {from: b, unit: MPa}}}]", "is 'torn'"),
        ("tests: [{mode: UT, columns: {stretch: {from: a}}}]", "needs one of stress_mpa"),
        ("tests: [{mode: UT, columns: {stretch: {from: a}, force_n: {from: b, unit: N}}}]", "gives no width_mm"),
        ("tests: [{mode: UT, columns: {stretch: {from: a}, stress_mpa: {from: b, unit: mm}}}]", "is a length"),
        ("{tests: [], bed: kinematic}", "is no key"),
        ("tests: [{mode: UT, until: noon, columns: {stretch: {from: a}, stress_mpa: {from: b, unit: Pa}}}]", "'noon'"),
    ],
)
def test_mistakes_of_a_recipe_are_told(recipe, says):
    with pytest.raises(UserError, match=says):
        parse_tests(content_of(recipe, "recipe"), "recipe")


def test_the_elastomers_of_the_collection(shared_data):
    for path in sorted((shared_data / "elastomers").glob("*.csv"))[:5]:
        table, asked = interview({path.name: path.read_bytes()}, {"1.mode": "uniaxial tension", "1.along.unit": "1"})
        assert set(asked) <= {"1.mode", "1.along.unit", "1.torn"}
        assert table["stretch"].between(0.9, 20).all()
        assert 0.1 < table["stress_mpa"].max() < 30


TIME = np.concatenate([np.linspace(0, 2, 11), np.linspace(3, 60, 30)])
HELD = 1 + np.minimum(TIME, 2) / 4
LOGGED = 0.4 * (HELD - HELD**-2.0) * (1 + np.exp(-TIME / 20))


def test_a_hold_with_times_is_taken_as_a_recording():
    sources = {"hold_1.csv": text(("Zeit [min]", "Stretch", "Eng. stress [kPa]"), TIME / 60, HELD, 1000 * LOGGED)}
    table, asked = interview(sources, {"1.mode": "uniaxial"})
    # Nothing tore: what falls is the overstress.
    assert asked == ["1.mode", "1.timed"]
    np.testing.assert_allclose(table["time_s"], TIME, atol=1e-6)
    np.testing.assert_allclose(table["stress_mpa"], LOGGED, rtol=1e-6)
    assert table["specimen"].unique().tolist() == ["hold_1"]


def test_a_slow_pull_with_times_stays_at_rest_unless_one_says_so():
    header = ("time", "Stretch", "Eng. stress [MPa]")
    sources = {"pull.csv": text(header, 10 * np.arange(5), STRETCH, STRESS["UT"])}
    table, asked = interview(sources, {"1.mode": "uniaxial"})
    assert "time_s" not in table
    assert asked == ["1.mode"]
    tests = guess_tests(sources)
    everything = {q.key for q in rubber_questions(tests, {"1.timed": "yes"}, everything=True)}
    assert {"1.timed", "1.time.unit"} <= everything
    made = {"1.mode": "uniaxial", "1.timed": "yes", "1.time.unit": "ms"}
    recipe = content_of(rubber_draft(tests, made, "files"), "recipe")
    np.testing.assert_allclose(
        convert_tests(parse_tests(recipe, "recipe"), sources).table["time_s"], np.arange(5) / 100
    )


def test_recordings_one_after_the_other_are_told_apart_by_the_clock():
    # A cycle comes back without being another specimen.
    time = np.concatenate([np.arange(10.0), np.arange(10.0)])
    stretch = 1 + np.concatenate([np.arange(5), np.arange(5)[::-1]] * 2) / 4
    rows = text(("Time [s]", "Stretch", "Eng. stress [MPa]"), time, stretch, stretch - 1)
    table, _ = interview({"UT.csv": rows}, {"1.timed": "yes"})
    assert table["specimen"].tolist() == ["UT 1"] * 10 + ["UT 2"] * 10


def test_a_strain_in_simple_shear_is_the_amount_of_shear():
    recipe = """
    tests:
      - mode: simple_shear
        columns: {strain: {from: gamma, unit: "1"}, stress_mpa: {from: tau, unit: kPa}}
    """
    shear = np.array([0.0, 0.5, 1.5])
    sources = {"layer.csv": text(("gamma", "tau"), shear, 1000 * shear)}
    table = convert_tests(parse_tests(content_of(recipe, "recipe"), "recipe"), sources).table
    np.testing.assert_allclose(table["stretch"] - 1 / table["stretch"], shear, atol=1e-9)
    with pytest.raises(UserError, match="is of simple_shear, which takes strain, stress_mpa"):
        parse_tests(content_of(recipe.replace("strain:", "stretch:"), "recipe"), "recipe")
