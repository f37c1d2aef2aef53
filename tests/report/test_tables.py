"""One table, shown alike as text, in the terminal and on a page."""

import io
import re

import pandas as pd
import pytest
from rich.console import Console

from freelearn.common.display import DisplayTable
from freelearn.common.formats import ascii_minus, fixed, number, percent, signed
from freelearn.report.html.html_page import Section, write_page
from freelearn.report.terminal.printed_tables import rich_table

TABLE = DisplayTable.from_rows(
    ["parameter"],
    ["value"],
    [["twist_offset[3]", "−1.25", "rad"], ["C1", "–", "Pa"]],
    title="[bold]title",
    caption="below",
    last=["unit"],
)


def terminal(table: DisplayTable, width: int = 80) -> str:
    text = io.StringIO()
    Console(file=text, width=width).print(rich_table(table))
    return text.getvalue()


def test_every_cell_is_shown_everywhere(tmp_path):
    write_page(tmp_path / "r.html", "page", False, [Section.of_table(TABLE)])
    page = (tmp_path / "r.html").read_text()
    assert re.findall(r"<td[^>]*>([^<]*)</td>", page) == [cell for row in TABLE.rows for cell in row]
    assert re.findall(r"<th[^>]*>([^<]*)</th>", page) == [column.heading for column in TABLE.columns]
    # Square brackets are no markup.
    for text in (terminal(TABLE), TABLE.text() + TABLE.title + TABLE.caption):
        for cell in ("twist_offset[3]", "−1.25", "–", "rad", "[bold]title", "below"):
            assert cell in text


def test_numbers_are_never_cut_and_words_give_way():
    wide = DisplayTable.from_rows(["name"], ["value"], [["a very long name of an effect " * 3, "123456.789"]])
    shown = terminal(wide, 40)
    assert "123456.789" in shown
    assert "…" not in shown
    assert shown.count("very") == 3


def test_columns_without_room_stand_below_and_none_is_cut():
    numbers = ["elongation mm", "twist °", "pressure 1 kPa", "pressure 2 kPa", "force N", "moment N·mm"]
    row = ["3", "−0.9271 ± 8", "−4.653 ± 87", "40.23 ± 1.5", "50.11 ± 1.5", "−22.49 ± 14", "−127.9 ± 1.6e+02", "ok"]
    wide = DisplayTable.from_rows(
        ["sample"], numbers, [row], title="answers", caption="half of the band", last=["status"]
    )
    for width in (40, 60, 80, 200):
        shown = terminal(wide, width)
        assert all(cell in shown for cell in row)
        for word in ("moment", "status", "answers", "half of the band"):
            assert shown.count(word) == 1
        assert max(map(len, shown.splitlines())) <= width
    assert terminal(wide, 200).count("sample") == 1
    # Each part says whose numbers they are.
    assert terminal(wide, 80).count("sample") == 2


def test_a_row_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="2 columns, but a row of 1"):
        DisplayTable.from_rows(["name"], ["value"], [["alone"]])


def test_a_frame_keeps_words_left_and_numbers_right():
    table = DisplayTable.from_frame(pd.DataFrame({"max_value": [-0.5, float("nan")], "model": ["a", "b"]}))
    assert [(c.heading, c.words) for c in table.columns] == [("max value", False), ("model", True)]
    assert table.rows == (("−0.5", "a"), ("–", "b"))


def test_numbers_have_true_minus_signs_and_dashes_where_nothing_is_known():
    assert number(-1.5e-7, 3) == "−1.5e−07"
    assert (fixed(-1.25, 1), signed(-3.0), signed(2.0), percent(-0.015, 1)) == ("−1.2", "−3", "+2", "−1.5")
    for value in (None, float("nan"), float("inf")):
        assert {number(value), fixed(value, 1), signed(value), percent(value)} == {"–"}
    assert float(ascii_minus(number(-0.125))) == -0.125


def test_many_columns_fold_their_headings_and_not_their_numbers():
    headings = ["outer radius of the tube", "rows", "number of rows without buckling", "stderr", "value"]
    table = DisplayTable.from_rows(["sample"], headings, [["3", "6.74", "2860", "1377", "8.1e+04", "6.2734e+05"]])
    shown = terminal(table, 60)
    for cell in table.rows[0]:
        assert cell in shown
    assert max(map(len, shown.splitlines())) <= 60
