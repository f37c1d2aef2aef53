"""What start and the page ask: all that a file leaves open and nothing else, each answer a line of the recipe."""

import io
import re
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from nightly import chosen
from scipy.io import savemat
from test_messy import REFUSED, RIGHT, write

from freelearn.api.tasks.intake_task import taken_in
from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.column_questions import said
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.draft_questions import questions
from freelearn.data.intake.guesses.guess import guess, guess_table
from freelearn.data.intake.guesses.guessed import NO, YES
from freelearn.data.intake.guesses.joined import Guessed, guess_and_table, guess_file
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.guesses.typed_answers import Question, answer
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.recipes.recipe_file import recipe_of

USUAL = {
    "design.gamma_deg": "25", "braid": "y", "design.length_mm": "150", "design.inner_radius_mm": "d 10",
    "design.outer_radius_mm": "+1", "held.twist_deg": "0", "same_sizes": "y",
    "sign": "n", "zero": "n", "slack": "n", "levels": "n", "rest": "no",
}  # fmt: skip
UNITS = {"length": "mm", "angle": "deg", "pressure": "kPa", "force": "N", "moment": "N·m", "time": "s"}
PLACES = [(x, p) for x in (0, -5, -10) for p in (0, 50, 100)]


def interview(found, answers, joined=None, raw=None):
    """All answers: those given by the keys of questions or their beginnings, else what is proposed; the questions; and
    the recipe."""
    made, asked, first = {}, [], found
    for _ in range(60):
        now = guess_table(raw, said(first, made)) if raw is not None and said(first, made) else found
        question = next((q for q in questions(now, joined, made) if q.key not in made), None)
        if question is None:
            return made, asked, draft(now, (), joined, made)
        typed = answers.get(question.key, answers.get(question.key.split(".")[0], ""))
        asked.append(question.key)
        made[question.key] = answer(question, typed, made)
    raise AssertionError(asked)


def table_of(content, name, answers=()):
    content = content if isinstance(content, bytes) else content.encode()
    raw = raw_table(content, name)
    _, asked, text = interview(guess_table(raw), USUAL | dict(answers), raw=raw)
    assert "TODO" not in text
    return convert(recipe_of(text, "recipe"), {name: content}).table, asked


def text(rows, header="dl [mm],P [kPa],F [N]"):
    return "\n".join([header, *(",".join(map(str, row)) for row in rows), ""])


@pytest.mark.parametrize("name", chosen(list(RIGHT), 30))
def test_of_a_file_that_says_its_units_only_the_actuator_is_asked_for(name, tmp_path):
    found, joined, raw = guess_and_table(write(tmp_path / name, RIGHT[name]()))
    _, asked, recipe = interview(found, USUAL, joined, raw)
    assert set(asked) <= {
        "bed", "clock", "design.gamma_deg", "braid", "design.length_mm", "design.inner_radius_mm",
        "design.outer_radius_mm", "held.twist_deg", "sample", "run",
        *(f"{what}.{c.name}" for what in ("sign", "zero", "sums") for c in found.columns),
    }  # fmt: skip
    assert "TODO" not in recipe
    recipe_of(recipe, name)
    # And a page can keep the guess.
    again = Guessed.from_plain(Guessed(found, joined).plain())
    assert repr(again) == repr(Guessed(found, joined))


def test_what_the_file_says_of_the_actuator_is_proposed():
    rows = text([(x, p, -p) for x, p in PLACES])
    content = f"# Länge unbelastet: 152 mm\n# ID = 0.5 in\n# Wandstärke [mm]: 1.5\n# Faserwinkel [°] = 23,5\n{rows}"
    table, asked = table_of(content, "rig.csv", dict.fromkeys([k for k in USUAL if k.startswith("design")], ""))
    assert table.loc[0, ["length_mm", "inner_radius_mm", "outer_radius_mm"]].tolist() == [152, 6.35, 7.85]
    # A comma in a file with decimal points is no number.
    assert "design.gamma_deg" in asked
    assert guess(content.encode(), "rig.csv").about[0].words == "rig.csv, line 1: Länge unbelastet 152 mm"


def test_lists_above_the_header_are_no_rows():
    content = "Länge;150;mm\nInnen;10;mm\nVersuch 12\nWeg [mm];Druck [bar];Kraft [N]\n0;0,5;1\n-1;2,5;3\n"
    found = guess(content.encode(), "liste.csv")
    assert (found.rows, [c.name for c in found.columns]) == (2, ["Weg [mm]", "Druck [bar]", "Kraft [N]"])
    assert [told.name for told in found.about] == ["length_mm"]


def book(fill):
    made = openpyxl.Workbook()
    fill(made)
    out = io.BytesIO()
    made.save(out)
    return out.getvalue()


def festo(made):
    """As a laboratory hands it on: a title sheet, groups over the headings, a mean below, rows sorted by pressure."""
    cover, sheet = made.active, made.create_sheet("Messwerte")
    cover.title = "Deckblatt"
    for row in (["Prüfling", "DMSP-20"], ["Länge unbelastet [mm]", 300], ["Innendurchmesser [mm]", 20]):
        cover.append(row)
    cover.append(["Wandstärke [mm]", 1.5])
    for row in (["Statische Kennlinien"], [], ["Geometrie", None, "Messgrößen"]):
        sheet.append(row)
    sheet.append(["Länge [mm]", "Verkürzung [%]", "Überdruck [bar]", "Zugkraft [N]"])
    for area in ("A1:D1", "A3:B3", "C3:D3"):
        sheet.merge_cells(area)
    for p in (0.5, 1, 2, 3):
        for length in (300, 280, 260):
            sheet.append([length, (300 - length) / 3, p, max(0, 200 * p - 10 * (300 - length))])
    sheet.append([None, None, "Mittelwert", 123])


def test_a_workbook_with_a_title_sheet_groups_and_a_mean(tmp_path):
    path = tmp_path / "Muskel.xlsx"
    path.write_bytes(book(festo))
    found, joined, raw = guess_and_table(path)
    answers = {"design.gamma_deg": "27", "braid": "ja", "held.twist_deg": "0", "sign": "j", "slack": "y", "rest": "2"}
    made, asked, recipe = interview(found, answers, joined, raw)
    assert made["design.outer_radius_mm"] == 11.5
    table = convert(recipe_of(recipe, "r"), {path.name: path.read_bytes()}).table
    assert len(table) == 12
    assert table["elongation_mm"].tolist() == [-40] * 4 + [-20] * 4 + [0] * 4
    assert table["step"].tolist() == [0, 1, 2, 3] * 3
    assert table["force_n"].max() == 0
    assert table["slack"].tolist() == (table["force_n"] == 0).astype(int).tolist()
    assert {"sums.Überdruck [bar]", "order", "slack"} <= set(asked)


def test_sheets_that_hold_no_readings_do_not_take_the_place_of_one_that_cannot_be_read(tmp_path):
    def fill(made):
        made.active.append(["Name", "Wert"])
        made.active.append(["Raum", 12])
        sheet = made.create_sheet("Messung")
        for row in (["dl [mm]", "P [kPa]", "F [N]"], [0, 0, 0], [0, 50, 3], [1, 50, 3]):
            sheet.append(row)
        sheet.merge_cells("B3:C3")

    path = tmp_path / "a.xlsx"
    path.write_bytes(book(fill))
    with pytest.raises(UserError, match="'Messung': cells B3:C3 are merged"):
        guess_file(path)


def test_a_value_over_several_rows_is_that_of_each(tmp_path):
    def fill(made):
        made.active.append(["dl [mm]", "P [kPa]", "F [N]"])
        for x, p in PLACES:
            made.active.append([x if p == 0 else None, p, -p])
        made.active.merge_cells("A2:A4")

    table, asked = table_of(book(fill), "a.xlsx", {"gaps": "2"})
    assert table["elongation_mm"].tolist() == [x for x, _ in PLACES]
    # Cells that are blank below it are asked about.
    assert "gaps.dl [mm]" in asked


def matlab(**variables):
    out = io.BytesIO()
    savemat(out, variables)
    return out.getvalue()


def test_matrices_and_single_numbers_of_a_matlab_file():
    s, p = (np.array(values, dtype=float) for values in zip(*PLACES, strict=True))
    loads = np.column_stack([3 - p / 10, p / 1000])
    content = matlab(s_mm=s, w_deg=0 * s, P=np.column_stack([p, p[::-1]]), FT=loads, fs=100.0, L0_mm=95.0, note="a")
    columns = {"what.FT 1": "force", "what.FT 2": "moment", "parallel": "1", "member.1": "40", "member.2": "-40"}
    units = {"unit.P 1": "kPa", "unit.P 2": "", "unit.FT 1": "N", "unit.FT 2": "N·m"}
    table, _ = table_of(content, "run.mat", {**columns, **units, "design.length_mm": "", "braid": "n"})
    assert table[["pressure_1_kpa", "pressure_2_kpa"]].to_numpy().tolist() == np.column_stack([p, p[::-1]]).tolist()
    assert table["moment_nmm"].tolist() == pytest.approx(p.tolist())
    assert guess(content, "run.mat").about[0].value == 95
    only = {**columns, **units, "parallel": "3", "unit.P 2": "kPa", "design.length_mm": "95"}
    table, _ = table_of(content, "run.mat", only)
    assert table["pressure_kpa"].tolist() == p[::-1].tolist()


def test_vectors_of_a_matlab_file_say_what_each_actuator_is():
    s, p = (np.array(values, dtype=float) for values in zip(*PLACES, strict=True))
    design = {"Gamma": [40.0, -40.0], "L_cm": [9.0, 9.5], "Ri": [5.0, 5.0], "Ro": [6.0, 6.5], "k": [1.0, 2.0]}
    content = matlab(s_mm=s, w_deg=0 * s, P_kPa=np.column_stack([p, p[::-1]]), F_N=3 - p / 10, M_Nm=p / 1000, **design)
    found = guess(content, "run.mat")
    assert any("Gamma, L_cm, Ri, Ro will be proposed" in note for note in found.notes)
    assert any("passed over: k" in note for note in found.notes)
    # Enter takes what the file says of each, whose unit it says or not.
    taken = {"parallel": "1", "braid": "n"}
    asked = {q.key: q for q in questions(found, None, taken)}
    assert asked["member.2"].proposed == -40
    assert "Gamma(2) is -40, which unit is not said: deg?" in asked["member.2"].told
    assert asked["same_sizes"].proposed == "no"
    assert asked["design.length_mm.2"].proposed == 95
    assert "not said" not in asked["design.length_mm.2"].told
    recipe = recipe_of(draft(found, (), None, {key: one.proposed for key, one in asked.items() if one.proposed}), "a")
    assert [dict(member.constants) for member in recipe.members] == [
        {"gamma_deg": 40, "length_mm": 90, "inner_radius_mm": 5, "outer_radius_mm": 6},
        {"gamma_deg": -40, "length_mm": 95, "inner_radius_mm": 5, "outer_radius_mm": 6.5},
    ]
    # A draft without answers takes no number whose unit is not said.
    text = draft(found)
    assert "length_mm: 90" in text
    assert re.search(r"gamma_deg: +# TODO.*Gamma\(1\) is 40", text)
    # A wall is added to each one's own radius; the sizes may be the same after all.
    outer = asked["design.outer_radius_mm.2"]
    assert answer(outer, "+2", {"design.inner_radius_mm.1": 9.0, "design.inner_radius_mm.2": 5.0}) == 7
    same = [q.key for q in questions(found, None, {**taken, "same_sizes": "yes"})]
    assert "design.length_mm" in same
    assert "design.length_mm.2" not in same


@pytest.mark.parametrize("name", ["swiss thousands.csv", "german thousands.csv", "narrow spaces.csv"])
def test_a_column_of_numbers_with_marks_between_their_digits_is_what_its_heading_says(name):
    table, asked = table_of(REFUSED[name][0](), name, {"read": "1", "unit.P_Pa": "Pa"})
    assert "read" in asked
    assert table["pressure_kpa"].tolist() == [0, 50, 100, 150] * 3
    assert table["force_n"].min() == -36


def test_what_was_held_at_zero_may_be_answered_by_yes():
    found = guess(b"dl_mm,P_kPa,F_N\n" + b"0,0,0\n0,5,5\n0,9,9\n1,0,0\n1,5,5\n", "a.csv")
    held = next(q for q in questions(found, None, {}) if q.key == "held.twist_deg")
    assert answer(held, "ja", {}) == 0
    assert answer(held, "12", {}) == 12


@pytest.mark.parametrize(
    ("cell", "reply", "force"),
    [("kaputt", "1", None), ("kaputt", "2", np.nan), ('"1,234.5"', "1", 1234.5), ("OL", "2", np.nan)],
)
def test_cells_that_are_no_numbers_are_asked_about(cell, reply, force):
    rows = [(x, p, cell if (x, p) == (-5, 50) else -p) for x, p in PLACES]
    table, asked = table_of(text(rows), "a.csv", {"words": reply, "read": reply})
    assert {"words.F [N]", "read"} & set(asked)
    there = table[(table["elongation_mm"] == -5) & (table["pressure_kpa"] == 50)]["force_n"].tolist()
    assert there == ([] if force is None else pytest.approx([force], nan_ok=True))


def test_a_mark_before_three_digits_is_asked_about():
    rows = [(x, f"{p / 1000:.3f}" if p >= 1000 else p, -p) for x in (0, -5) for p in (0, 850, 1050, 1200)]
    for reply, most in (("1", 1200), ("2", 850)):
        table, asked = table_of(text(rows), "a.csv", {"read": reply})
        assert "read" in asked
        assert table["pressure_kpa"].max() == most
    # Readings with three decimals throughout are none of those.
    rows = [(x, f"{p:.3f}", f"{-p:.3f}") for x, p in PLACES]
    assert "read" not in table_of(text(rows), "a.csv")[1]


def test_readings_that_scatter_about_levels_are_of_one_place():
    jitter = np.random.default_rng(0).normal(0, 0.02, 24)
    rows = [(f"{x + e:.4f}", p, 3 - p) for (x, p), e in zip([*PLACES, *PLACES[:6]], jitter, strict=False)]
    table, asked = table_of(text(rows), "a.csv", {"levels": "y"})
    assert "levels.dl [mm]" in asked
    assert table["elongation_mm"].nunique() == 3
    exact = text([(x, p, 3 - p) for x, p in PLACES])
    assert "levels.dl [mm]" not in table_of(exact, "a.csv")[1]


def test_what_a_sensor_reads_at_rest_and_an_absolute_pressure_are_asked_about():
    rows = [(x, 101.3 + p, 9 - p) for x, p in PLACES]
    table, asked = table_of(text(rows), "a.csv", {"zero": "y", "absolute": "y"})
    assert {"zero.F [N]", "absolute"} <= set(asked)
    assert table["pressure_kpa"].tolist() == pytest.approx([p - 0.025 for _, p in PLACES])
    assert table["force_n"].tolist() == [-p for _, p in PLACES]
    asked = table_of(text([(x, p, 0.5 - p) for x, p in PLACES]), "a.csv")[1]
    assert not {"zero.F [N]", "absolute"} & set(asked)


def test_what_a_gauge_reads_at_rest_is_asked_and_taken_off():
    """A gauge that reads 0.73 bar when the muscle is vented, as the Festo muscles' does; once it had not settled."""
    bars = [0.731, 2.0, 4.0, 2.1, 0.729]
    rows = [(x, p, -p) for x in (0, -5, -10) for p in bars]
    rows[0] = (0, 0.56, -0.731)
    header = "dl [mm],P [bar],F [N]"
    table, asked = table_of(text(rows, header), "a.csv", {"rest": "2", "zero": "n"})
    assert "rest.P [bar]" in asked
    assert table["pressure_kpa"].tolist()[1:5] == pytest.approx([127.1, 327.1, 137.1, 0])
    lowest, _ = table_of(text(rows, header), "a.csv", {"rest": "1"})
    assert lowest["pressure_kpa"].min() == pytest.approx(0, abs=1e-12)
    same, _ = table_of(text(rows, header), "a.csv", {"rest": "3"})
    assert same["pressure_kpa"].min() == pytest.approx(56)
    # Near zero nothing is asked, nor where the same levels were set everywhere.
    for pressures in ([0.05, 2.0, 4.0], [0.35, 0.65, 0.85, 1.1, 1.35, 1.8, 2.5]):
        rows = [(x, p, -p) for x in (0, -5, -10) for p in pressures]
        assert "rest.P [bar]" not in table_of(text(rows, header), "a.csv")[1]


@pytest.mark.parametrize(
    ("low", "answers"),
    [
        (101.3, {"absolute": "n"}),
        (96.0, {"absolute": "n"}),
        (60.0, {"rest": "less: the tube was under pressure all the time"}),
    ],
)
def test_what_was_said_of_a_gauge_no_warning_doubts_again(low, answers, tmp_path):
    content = text([(x, low + p + x / 50, -p) for x, p in PLACES])
    raw = raw_table(content.encode(), "a.csv")
    _, asked, recipe = interview(guess_table(raw), USUAL | answers, raw=raw)
    assert any(key.split(".")[0] in answers for key in asked)
    path, written = tmp_path / "a.csv", tmp_path / "recipe.yaml"
    path.write_text(content)
    written.write_text(recipe)
    made = taken_in(path, written, tmp_path / "table.csv")
    assert made.intake.table["pressure_kpa"].tolist() == pytest.approx([low + p + x / 50 for x, p in PLACES])
    assert not [warning for warning in made.intake.warnings if "pressure" in warning]
    # Where nobody was asked it is said.
    written.write_text(recipe.replace(", minus: 0", ""))
    again = taken_in(path, written, tmp_path / "table.csv").intake.warnings
    assert [warning for warning in again if warning.startswith("pressure_kpa")]


@pytest.mark.parametrize(("name", "value", "length"), [("L", 0.15, "m?"), ("L", 150.0, "mm?"), ("L0", 0.182, "m?")])
def test_a_length_among_the_numbers_of_a_matlab_file_is_proposed(name, value, length, tmp_path):
    pressure = np.array([p for _, p in PLACES], dtype=float)
    arrays = {name: value, "P_kPa": pressure, "F_N": -pressure, "dl_mm": [float(x) for x, _ in PLACES]}
    found = guess_file(write(tmp_path / "a.mat", matlab(**arrays)))[0]
    told = found.told("length_mm")
    assert told is not None
    assert (told.value, told.words.split(": ")[-1]) == (pytest.approx(value * (1000 if length == "m?" else 1)), length)
    assert not told.unit_said
    assert not any("passed over" in note for note in found.notes)


LEVELS = (0, 0.5, 1.1, 0.02)


@pytest.mark.parametrize(
    ("header", "row", "key", "column"),
    [
        ("dl [mm],Druck Soll [bar],Druck Ist [bar],F [N]", lambda x, p: (x, p, p + 0.03, -p), "Druck Soll [bar]", 1),
        ("dl [mm],P [bar],Kraft 1 [N],Kraft 2 [N]", lambda x, p: (x, p, -p, -p - 0.03), "Kraft 1 [N]", 2),
        ("dl [mm],dl [mm],P [bar],F [N]", lambda x, p: (x, x + 0.03, p, -p), "dl [mm]", 0),
    ],
)
def test_which_of_two_columns_is_meant_is_asked(header, row, key, column):
    content = text([row(x, p) for x in (0, -5, -10) for p in LEVELS], header)
    names = {0: "elongation_mm", 1: "pressure_kpa", 2: "force_n"}
    first, asked = table_of(content, "a.csv", {"which": "1"})
    other, _ = table_of(content, "a.csv", {"which": "2"})
    assert f"which.{key}" in asked
    step = {0: 0.03, 1: 3.0, 2: -0.03}[column]
    np.testing.assert_allclose(other[names[column]] - first[names[column]], step, atol=1e-9)
    # A draft waits for somebody to say it.
    found = guess(content.encode(), "a.csv")
    assert re.search(r"from: , .*# TODO: from '.*' or '.*'", draft(found, (), None, {}))
    # The same readings twice are no choice, nor in another unit.
    for second, factor in (("F 2 [N]", 1), ("F 2 [lbf]", 0.224809)):
        rows = [(x, p, -p, round(-p * factor, 4)) for x in (0, -5, -10) for p in LEVELS]
        asked = table_of(text(rows, f"dl [mm],P [bar],F 1 [N],{second}"), "a.csv")[1]
        assert not [k for k in asked if k.startswith("which")]


def test_lengths_and_angles_that_no_heading_explains_are_asked_about():
    rows = [(x, x + 0.03, p, -p) for x in (0, -5, -10) for p in LEVELS]
    header = "Weg Soll [mm],Weg Ist [mm],P [bar],F [N]"
    answers = {"what.Weg Soll [mm]": "not used", "what.Weg Ist [mm]": "elongation"}
    table, asked = table_of(text(rows, header), "a.csv", answers)
    assert asked[:2] == ["what.Weg Soll [mm]", "what.Weg Ist [mm]"]
    assert table["elongation_mm"].tolist()[0] == 0.03


@pytest.mark.parametrize("unit", [" [kPa]", " (kPa)", "_kPa"])
def test_the_gauges_of_several_actuators_have_each_their_own_rest(unit):
    rows = [(x, 60 + p, 5 + p / 2, -p) for x in (0, -5, -10) for p in (0, 100, 200, 1)]
    table, asked = table_of(
        text(rows, f"dl [mm],P1{unit},P2{unit},F [N]"), "a.csv", {"rest": "1", "parallel": "1", "member": "25"}
    )
    assert [key for key in asked if key.startswith("rest")] == [f"rest.P1{unit}"]
    assert table["pressure_1_kpa"].max() == pytest.approx(200)
    assert table["pressure_2_kpa"].max() == pytest.approx(105)


def test_a_log_is_averaged_where_it_stood_still():
    rows, time = [], 0.0
    for x in (0, -5):
        for p in (0, 50, 100):
            for _ in range(60):
                rows.append((round(time, 2), x, p, -p))
                time += 0.1
    table, asked = table_of(text(rows, "t [s],dl [mm],P [kPa],F [N]"), "log.csv")
    assert "plateaus" in asked
    assert table[["elongation_mm", "pressure_kpa"]].to_numpy().tolist() == [
        [x, p] for x in (0, -5) for p in (0, 50, 100)
    ]


def test_six_muscles_are_asked_for_one_by_one():
    rows = [(name, x, p, -p) for name in ("rot", "blau") for x, p in PLACES]
    lengths = {"design.length_mm.1": "150", "design.length_mm.2": "16 cm"}
    table, asked = table_of(text(rows, "Muskel,dl [mm],P [kPa],F [N]"), "a.csv", {**lengths, "alike": "y"})
    assert table.groupby("sample")["length_mm"].first().tolist() == [150, 160]
    angles = {f"design.{n}.{i}": v for n, v in (("gamma_deg", "20"), ("inner_radius_mm", "5")) for i in (1, 2)}
    angles |= {"design.outer_radius_mm.1": "6", "design.outer_radius_mm.2": "7"}
    rows = text(rows, "Reihe,dl [mm],P [kPa],F [N]")
    table, asked = table_of(rows, "a.csv", {**lengths, **angles, "sample": "2", "alike": "n"})
    assert table.groupby("sample")["outer_radius_mm"].first().tolist() == [6, 7]
    assert "braid" not in asked


NUMBER = Question("design.inner_radius_mm", "?", "number", "inner_radius_mm")


@pytest.mark.parametrize(
    ("typed", "value"),
    [("5", 5), ("5,5", 5.5), ("0.25 in", 6.35), ("d 10", 5), ("Ø 1 cm", 5), ("d=10", 5), ("−1", None), ("", None)],
)
def test_numbers_as_people_type_them(typed, value):
    if value is None:
        with pytest.raises(UserError):
            answer(NUMBER, typed, {})
    else:
        assert answer(NUMBER, typed, {}) == pytest.approx(value)


def test_an_outer_radius_may_be_said_by_the_wall():
    outer = Question("design.outer_radius_mm", "?", "number", "outer_radius_mm")
    assert answer(outer, "+1.5 mm", {"design.inner_radius_mm": 10.0}) == 11.5
    with pytest.raises(UserError, match="inner radius is not known"):
        answer(outer, "+1", {})


def test_only_what_is_asked_is_an_answer():
    yes = Question("braid", "?", "choice", options=((YES, "yes"), (NO, "no")))
    assert [answer(yes, typed, {}) for typed in ("y", "Ja", "N", "non")] == [YES, YES, NO, NO]
    for typed in ("", "1", "perhaps"):
        with pytest.raises(UserError):
            answer(yes, typed, {})


def test_a_drafts_open_decisions_stand_in_it_as_remarks():
    rows = text([(x, p, max(0, p - 60)) for x, p in PLACES])
    drafted = draft(guess(rows.encode(), "a.csv"))
    assert "# To be decided: In 6 rows the force is exactly 0." in drafted
    assert "slack:" not in drafted


def test_recipes_of_any_file_of_the_collection_can_be_answered(shared_data: Path):
    for path in sorted(shared_data.glob("*/*.csv")):
        if path.parent.name in ("rubber", "elastomers", "nist_strd"):
            continue
        found, joined, raw = guess_and_table(path)
        answers = {
            "what": "not used",
            "unit": "mm",
            "gaps": "1",
            "words": "1",
            "sample": "1",
            "parallel": "1",
            "which": "1",
        }
        numbers = dict.fromkeys(("design", "held", "member"), "5")
        units = {f"unit.{c.name}": UNITS.get(MEANINGS[c.quantity].kind, "") for c in found.columns if c.chosen}
        drafted = interview(found, USUAL | numbers | answers | units | {"alike": "y", "absolute": "n"}, joined, raw)[2]
        assert "TODO" not in drafted, path
