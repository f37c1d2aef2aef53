"""Cells that are no numbers: each is told what it probably is, and that a cure which is named works."""

import pytest

from freelearn.data.table.faults import PLAIN, not_a_number

SAID = {
    "": "is blank: write a number, or delete the line",
    " \t": "is blank: write a number, or delete the line",
    "NaN": "is not a finite number: write one, or delete the line",
    "-Infinity": "is not a finite number: write one, or delete the line",
    "n/a": "is not a finite number: write one, or delete the line",
    "1e999": "is not a number: it is larger than a computer holds, so correct it",
    "3,5": "has a decimal comma: write 3.5",
    "0,125": "has a decimal comma: write 0.125",
    "1,250": "has a decimal comma or parts its thousands: write 1.250 or 1250",
    "=A2*3": "is not a number: it is a formula, and none is calculated: save the value",
    "@SUM(A2)": "is not a number: it is a formula, and none is calculated: save the value",
    "1_0": "is not a number: write its digits without _",
    "12 500": "is not a number: write it without what parts its thousands",
    "12\u202f500": "is not a number: write it without what parts its thousands",
    "1'250'000": "is not a number: write it without what parts its thousands",
    "\u22123.5": "is not a number: it has a dash for a minus sign: write -",
    "3\u200b5": "is not a number: it holds spaces or marks that are not seen: type it anew",
    "３５": "is not a number: write its digits as 0 … 9",
    "#REF!": "is not a number: it is what a spreadsheet shows instead of one: blank the cell, or delete the line",
    "12 %": "is not a number: it has a percent sign: write the quantity in the column's unit",
    "12 kPa": "is not a number: write digits with a decimal point, without a unit",
}


@pytest.mark.parametrize(("cell", "said"), SAID.items())
def test_a_cell_is_told_what_it_probably_is(cell, said):
    assert not_a_number(cell) == said


@pytest.mark.parametrize("cell", ["3,5", "0,125", "1,250"])
def test_what_is_to_be_written_instead_is_a_number(cell):
    for instead in not_a_number(cell).partition(" write ")[2].split(" or "):
        assert PLAIN.fullmatch(instead)
