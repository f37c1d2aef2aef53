"""One table, written as laboratories write it, is read as one table."""

import io

import numpy as np
import pytest
from nightly import EVERY
from raw_files import HEADER, RECIPE, ROWS, raw_text, taken
from scipy.io import savemat

from freelearn.common.errors import UserError
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.recipes.recipe import Reading

VALUES = np.array(ROWS)
LINES = raw_text().splitlines()


def workbook(above=(), sheets=("log",)) -> bytes:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title in sheets:
        sheet = book.create_sheet(title)
        for row in above:
            sheet.append(row)
        sheet.append(HEADER.split(","))
        for values in ROWS:
            sheet.append(list(values))
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


def matlab(**variables) -> bytes:
    content = io.BytesIO()
    savemat(content, variables)
    return content.getvalue()


NAMED = dict(zip(HEADER.split(","), VALUES.T, strict=True))
UNITS = "s,mm,deg,kPa,N,N·mm"
FORMS = {
    "commas": raw_text(),
    "semicolons": raw_text(separator=";"),
    "semicolons and decimal commas": raw_text(separator=";", decimal=","),
    "tabs": raw_text(separator="\t"),
    "tabs and decimal commas": raw_text(separator="\t", decimal=","),
    "spaces": raw_text(separator="  "),
    "bars": raw_text(separator="|"),
    "commas with spaces": raw_text(separator=", "),
    "quoted decimal commas": "\n".join(
        [HEADER, *(",".join('"' + str(v).replace(".", ",") + '"' for v in row) for row in ROWS)]
    ),
    "sep= of Excel": "sep=;\n" + raw_text(separator=";"),
    "UTF-8 with a mark": raw_text().encode("utf-8-sig"),
    "UTF-16": raw_text().encode("utf-16"),
    "UTF-16 without a mark": raw_text().encode("utf-16-le"),
    "Latin-1": ("Prüfstand Gerät 3\n\n" + raw_text()).encode("latin-1"),
    "Windows": ("Prüfstand – “3”\n\n" + raw_text()).encode("cp1252"),
    "Windows line ends": raw_text().replace("\n", "\r\n"),
    "old Mac line ends": raw_text().replace("\n", "\r"),
    "no end of the last line": raw_text().rstrip("\n"),
    "titles above": "Bed 3, operator A\nDate: 2021-04-01\n\n" + raw_text(),
    "comments": "# made by logger 2\n% units: SI\n" + raw_text() + "# end\n",
    "header in a comment": "# logger 2\n# " + raw_text(),
    "a row of units": "\n".join([HEADER, UNITS, *LINES[1:]]),
    "a row of units in brackets": "\n".join([HEADER, "[s],[mm],[deg],[kPa],[N],[Nmm]", *LINES[1:]]),
    "blank lines": "\n\n".join(LINES) + "\n\n\n",
    "repeated headers": "\n".join([*LINES[:4], LINES[0], *LINES[4:7], LINES[0], *LINES[7:]]),
    "repeated header and units": "\n".join([HEADER, UNITS, *LINES[1:4], HEADER, UNITS, *LINES[4:]]),
    "remarks between rows": "\n".join([*LINES[:4], "second test,,,,,", *LINES[4:]]),
    "a column of commas at the end": "\n".join(line + "," for line in LINES),
    "Fortran exponents": raw_text().replace("31.2", "0.312D+02"),
    "a true minus": raw_text().replace(",-", ",\u2212"),
    "other spaces in the header": raw_text(HEADER.replace("P_kPa", " P_kPa ")),
}


def same(raw) -> None:
    for name, values in NAMED.items():
        np.testing.assert_allclose(raw.numbers(name), values)


@pytest.mark.parametrize("form", FORMS)
def test_text(form):
    content = FORMS[form]
    same(raw_table(content if isinstance(content, bytes) else content.encode(), "raw.csv"))


def test_lines_are_those_of_the_file():
    raw = raw_table(("title\n\n" + raw_text()).encode(), "raw.csv")
    assert raw.lines == list(range(4, 13))
    assert "passed over: 1" in raw.notes[0]


def test_units_of_a_row_of_units():
    raw = raw_table(FORMS["a row of units in brackets"].encode(), "raw.csv")
    assert raw.units["P_kPa"] == "[kPa]"


def test_workbooks():
    same(raw_table(workbook(), "raw.xlsx"))
    same(raw_table(workbook(above=[["Bed 3"], []]), "raw.xlsx"))
    same(raw_table(workbook(sheets=("a", "b")), "raw.xlsx", Reading(sheet="b")))
    with pytest.raises(UserError, match="no filled sheet 'c'"):
        raw_table(workbook(sheets=("a", "b")), "raw.xlsx", Reading(sheet="c"))


def test_matlab_files():
    same(raw_table(matlab(**NAMED, fs=100.0, note="text"), "raw.mat"))
    same(raw_table(matlab(log=NAMED), "raw.mat"))
    same(raw_table(matlab(log=VALUES), "raw.mat", Reading(names=tuple(NAMED))))
    same(raw_table(matlab(log=VALUES, other=np.arange(3)), "raw.mat", Reading(variables=("log",), names=tuple(NAMED))))


def test_columns_of_one_name_stay_apart():
    raw = raw_table(b"F,F,F\n1,2,1\n3,4,3\n", "raw.csv")
    assert raw.numbers("F").tolist() == [1, 3]
    assert raw.numbers("F [2]").tolist() == [2, 4]


def test_a_file_without_a_header_gets_names():
    body = "\n".join(LINES[1:])
    raw = raw_table(body.encode(), "raw.csv")
    assert list(raw.columns)[:2] == ["column 1", "column 2"]
    assert "no header" in " ".join(raw.notes)
    same(raw_table(body.encode(), "raw.csv", Reading(names=tuple(NAMED))))


def test_two_rows_of_headings():
    grouped = "time,place,place,gauge,loads,loads\n" + raw_text()
    raw = raw_table(grouped.encode(), "raw.csv")
    same(raw)
    assert any("before the header (line 2) were passed over: 1" in note for note in raw.notes)


def test_a_last_line_that_is_cut_off_is_left_out():
    raw = raw_table(raw_text().encode()[:-15], "raw.csv")
    assert len(raw) == len(ROWS) - 1
    assert "cut off" in " ".join(raw.notes)


def test_rows_that_end_early_are_filled_with_blanks(tmp_path):
    text = raw_text().replace(",-2.25,-8.15", ",-2.25")
    table, warnings = taken(tmp_path, text)
    assert np.isnan(table["moment_nmm"][1])
    assert any("1 row ends early" in warning and "line 3" in warning for warning in warnings)


@pytest.mark.parametrize("word", ["", "--", "NaN", "#DIV/0!", "n/a", "#N/A"])
def test_words_for_nothing_are_blanks_and_counted(word, tmp_path):
    table, warnings = taken(tmp_path, raw_text().replace(",-2.25,", f",{word},"))
    assert np.isnan(table["force_n"][1])
    assert table["force_n"].notna().sum() == len(ROWS) - 1
    assert any(f"1 cell holds {word!r}" in warning for warning in warnings) == bool(word)


def test_thousands_are_read_when_the_recipe_says_so(tmp_path):
    text = raw_text().replace("-18.05", '"-1,018.05"')
    table, _ = taken(tmp_path, text, RECIPE + "read: {thousands: ','}\n")
    assert table["moment_nmm"][5] == -1018.05


def test_a_long_log_is_read_quickly():
    count = 200_000 if EVERY else 40_000
    rows = "\n".join(f"{i / 100},{i % 7},{i % 5},{i % 3}.5,{i % 11},{i % 13}" for i in range(count))
    raw = raw_table(f"{HEADER}\n{rows}\n".encode(), "raw.csv")
    assert raw.numbers("F_N").sum() == sum(i % 11 for i in range(count))
