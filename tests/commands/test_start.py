"""`start` asks what a file does not say, in words that its answers put right, and goes on to the table."""

from io import StringIO

import pandas as pd
import pytest
from rich.console import Console

from freelearn.commands.start import start
from freelearn.errors import UserError

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
    words = start(raw, tmp_path / "run", Console(file=told, width=120), ask)
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
    again = start(raw, tmp_path / "again", Console(file=told), none, recipe=tmp_path / "run" / "Muskel 3_recipe.yaml")
    assert not nothing
    assert [w for w in again if "path" not in w] == [w for w in words if "path" not in w]
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "again" / "Muskel 3_table.csv"), table)


def test_nobody_answers(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text(RAW)
    with pytest.raises(UserError, match=r"nobody answers.*intake"):
        start(raw, tmp_path / "run", Console(file=StringIO()), typed()[0])
    assert not (tmp_path / "run").exists()
