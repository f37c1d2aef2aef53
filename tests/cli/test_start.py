"""`start` asks what a file does not say, in words that its answers put right, and goes on to the table."""

import shlex
from io import StringIO

import openpyxl
import pandas as pd
import pytest
from rich.console import Console

from freelearn.cli.start_command import Next, start
from freelearn.common.errors import UserError

ROWS = "".join(f"{x};{p};{0.5 * 100 * p + 2 * x}\n" for x in (0, -5, -10) for p in (0, 1, 2))
RAW = f"Weg [mm];Druck;Kraft [N]\n{ROWS}"


def typed(*answers):
    """Gives one answer to each question, and remembers the questions."""
    left, asked = list(answers), []

    def ask(question: str) -> str:
        asked.append(question)
        if not left:
            raise EOFError
        return left.pop(0)

    return ask, asked


def test_answers_make_the_recipe_and_the_table(tmp_path):
    raw = tmp_path / "Muskel 3.csv"
    raw.write_text(RAW)
    ask, asked = typed("", "", "25°", "y", "-6", "6 in", "d 10", "+0.1 cm", "", "0", "mm", "bar", "y")
    told = StringIO()
    words = start([raw], tmp_path / "run", Console(file=told, width=120), ask).words
    assert len(asked) == 13
    # Neither a blank nor a unit of another kind is taken for an answer.
    assert "'-6' is no size" in told.getvalue()
    assert "'' is no number" in told.getvalue()
    assert "is a length, not a pressure" in told.getvalue()
    table = pd.read_csv(tmp_path / "run" / "Muskel 3_table.csv")
    assert table.loc[0, ["gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]].tolist() == [
        25, -25, 152.4, 5, 6,
    ]  # fmt: skip
    assert table["pressure_kpa"].tolist() == [0, 100, 200] * 3
    assert table["force_n"].tolist()[:3] == [0, -50, -100]
    assert words[-1] == "data.accuracy=estimate"
    assert "data.bed=isometric" in words
    # Again by the recipe that was kept: nothing is asked.
    none, nothing = typed()
    recipe = tmp_path / "run" / "Muskel 3_recipe.yaml"
    again = start([raw], tmp_path / "again", Console(file=told), none, recipe=recipe).words
    assert not nothing
    assert [w for w in again if "path" not in w] == [w for w in words if "path" not in w]
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "again" / "Muskel 3_table.csv"), table)


def test_nobody_answers(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text("lambda,P_MPa\n1,0\n1.1,0.1\n1.2,0.2\n")
    # What kind of file it is stays open: intake takes it for an actuator's.
    with pytest.raises(UserError, match=r"nobody answers.*intake"):
        start([raw], tmp_path / "run", Console(file=StringIO()), typed()[0])
    assert not (tmp_path / "run").exists()


def test_nobody_answers_and_a_recipe_for_every_file_is_there(tmp_path):
    for name in ("UT", "ET"):
        rows = "\n".join(f"{1 + i / 10},{i / 10}" for i in range(8))
        (tmp_path / f"{name}.csv").write_text(f"lambda,P_MPa\n{rows}\n")
    raws, told = [tmp_path / "UT.csv", tmp_path / "ET.csv"], StringIO()
    with pytest.raises(UserError, match="nobody answers") as broken:
        start(raws, tmp_path / "my run", Console(file=told), typed()[0])
    assert told.getvalue().endswith("\n")
    words = shlex.split(str(broken.value).split(", then: ")[1])
    recipe = tmp_path / "my run" / "UT_recipe.yaml"
    assert words[words.index("start") :] == ["start", *map(str, raws), "--recipe", str(recipe)]
    going = start(raws, tmp_path / "again", Console(file=told), typed()[0], recipe=recipe)
    assert set(pd.read_csv(going.words[0])["mode"]) == {"uniaxial", "equibiaxial"}


def test_answers_are_kept_where_it_is_broken_off(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text(RAW)
    with pytest.raises(UserError, match=r"broken off\. The answers are kept in .*raw_recipe\.yaml"):
        start([raw], tmp_path / "run", Console(file=StringIO()), typed("", "", "25", "y")[0])
    kept = (tmp_path / "run" / "raw_recipe.yaml").read_text()
    assert "gamma2_deg: -25" in kept
    assert "length_mm:   # TODO" in kept
    # Between the two questions about the fibers.
    with pytest.raises(UserError, match="broken off"):
        start([raw], tmp_path / "other", Console(file=StringIO()), typed("", "", "25")[0])
    assert "gamma_deg: 25   # a braid" in (tmp_path / "other" / "raw_recipe.yaml").read_text()


def test_nobody_answers_what_is_to_be_changed(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text("dl_mm,P_kPa,F_N\n" + "".join(f"{x},{p},{p}\n" for x in (0, -5) for p in (0, 50, 100)))
    # A pull that rises is said, and whether anything is to be changed asked.
    ask, asked = typed("", "", "25", "y", "90", "5", "6", "0", "n")
    with pytest.raises(UserError, match=r"broken off\. The answers are kept in .*raw_recipe\.yaml"):
        start([raw], tmp_path / "run", Console(file=StringIO()), ask)
    assert "to change" in asked[-1]


def test_a_line_of_the_guess_and_an_answer_are_put_right(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text("dl_mm,P_kPa,Kanal 3\n" + "".join(f"{x},{p},{-p}\n" for x in (0, -5) for p in (0, 50, 100)))
    # A pull that rises is said, and the answer about it changed.
    answers = ("9", "3", "force", "", "", "25", "y", "90", "5", "6", "0", "N", "y", "10", "n", "")
    ask = typed(*answers)[0]
    told = StringIO()
    start([raw], tmp_path / "run", Console(file=told, width=120), ask)
    assert "'9' is none of them" in told.getvalue()
    assert pd.read_csv(tmp_path / "run" / "raw_table.csv")["force_n"].tolist() == [0, -50, -100] * 2


def test_a_file_may_ask_a_run(tmp_path):
    run, raw = tmp_path / "run", tmp_path / "Bahn.csv"
    run.mkdir()
    raw.write_text("Weg [mm];Kraft [N]\n0;0\n-5;100\n")
    with pytest.raises(UserError, match=r"holds no predictions\.csv"):
        start([raw], tmp_path / "out", Console(file=StringIO()), typed()[0], run=run)
    rows = pd.DataFrame({"sample": [1, 1], "length_mm": 90.0, "elongation_mm": [0, 1], "twist_deg": 0.0})
    rows.to_csv(run / "predictions.csv", index=False)
    following = start([raw], tmp_path / "out", Console(file=StringIO()), typed("", "", "", "", "y")[0], run=run)
    table = tmp_path / "out" / "Bahn_table.csv"
    assert following == Next("predict", [f"run={run}", f"data.path={table}"])
    assert pd.read_csv(table)["force_n"].tolist() == [0, -100]


@pytest.mark.parametrize("name", ["UT.csv", "mine.csv"])
def test_tests_of_rubber_go_to_their_own_fit(tmp_path, name):
    raw = tmp_path / name
    raw.write_text("lambda,P_MPa\n1,0\n1.5,0.3\n2,0.6\n")
    mode = [] if name == "UT.csv" else ["2"]
    ask, _ = typed("y", "", *mode, "1")
    following = start([raw], tmp_path / "run", Console(file=StringIO()), ask)
    table = tmp_path / "run" / f"{raw.stem}_table.csv"
    assert following == Next("specimens", [str(table), "--best"])
    assert pd.read_csv(table)["stress_mpa"].tolist() == [0, 0.3, 0.6]
    recipe = tmp_path / "run" / f"{raw.stem}_recipe.yaml"
    again = start([raw], tmp_path / "again", Console(file=StringIO()), typed()[0], recipe=recipe)
    assert again.command == "specimens"


def test_which_of_several_sheets_is_asked(tmp_path):
    raw = tmp_path / "muscles.xlsx"
    book = openpyxl.Workbook()
    book.active.title, second = "rot", book.create_sheet("blau")
    for sheet, factor in ((book.active, 1), (second, 2)):
        for row in [("dl_mm", "P_kPa", "F_N"), *((x, p, factor * (p - x)) for x in (0, 5) for p in (0, 50, 100))]:
            sheet.append(row)
    book.save(raw)
    ask, asked = typed("4", "blau", "", "1", "25", "n", "150", "5", "6", "0", "n", "n", "n", "")
    start([raw], tmp_path / "run", Console(file=StringIO(), width=120), ask)
    assert asked[0].startswith("Several sheets hold readings")
    assert pd.read_csv(tmp_path / "run" / "muscles_table.csv")["force_n"].max() == 200
    assert "sheet: blau" in (tmp_path / "run" / "muscles_recipe.yaml").read_text()
