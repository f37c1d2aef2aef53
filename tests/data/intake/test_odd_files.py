"""More of what laboratories hand in: kinds that are refused with one clear answer, and odd ones that are read."""

import datetime
import io
import zipfile

import numpy as np
import pandas as pd
import pytest
import test_broken_files
from raw_files import HEADER, RECIPE, raw_text, taken, with_cell
from scipy import sparse
from scipy.io import savemat
from test_broken_files import columns, matlab, refused, workbook

LINES = raw_text().splitlines()
CELLS = [line.split(",") for line in LINES]
TEXT = raw_text()


def archive(*names: str) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        for name in names:
            file.writestr(name, "<x/>")
    return content.getvalue()


def with_password() -> bytes:
    """The head of an OLE file and the name of the stream that an encrypted workbook has in it."""
    return b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600 + "EncryptedPackage".encode("utf-16-le") + b"\0" * 600


def date_for_a_number(book, sheet):
    sheet["E3"] = datetime.datetime(2026, 2, 25)


def true_for_a_number(book, sheet):
    sheet["E3"] = True


def sums_below(book, sheet):
    sheet.append([None, None, None, 281.1, -37.9, -105.9])


def table_below(book, sheet):
    for row in ([], ["t_s", "note"], [1, "a second table"]):
        sheet.append(row)


def structures() -> np.ndarray:
    return np.array([(1.0, 2.0), (3.0, 4.0)], dtype=[("F_N", float), ("P_kPa", float)])


def cells() -> np.ndarray:
    return np.array([np.arange(3.0), np.arange(4.0)], dtype=object)


# name of the file, content, what the answer says besides the name.
REFUSED = {
    "OpenDocument": ("raw.ods", archive("mimetype", "content.xml"), "OpenDocument"),
    "Word": ("raw.docx", archive("word/document.xml"), "Word document"),
    "PowerPoint": ("raw.pptx", archive("ppt/presentation.xml"), "PowerPoint"),
    "binary workbook": ("raw.xlsb", archive("xl/workbook.bin"), "save it as .xlsx"),
    "Apple Numbers": ("raw.numbers", archive("Index/Document.iwa"), "Apple Numbers"),
    "workbook with a password": ("raw.xlsx", with_password(), "with a password"),
    "JSON": ("raw.json", '{"t_s": [0, 1], "F_N": [1, 2]}', "JSON"),
    "JSON as .csv": ("raw.csv", '[{"t_s": 1, "F_N": 2}, {"t_s": 2, "F_N": 3}]', "JSON"),
    "Python lists": ("raw.txt", "[[1, 2, 3], [4, 5, 6]]", "JSON"),
    "LaTeX": ("raw.tex", TEXT.replace(",", " & ").replace("\n", "\\\\\n"), "no rows of numbers"),
    "colors of a terminal": ("raw.csv", TEXT.replace("F_N", "\x1b[31mF_N\x1b[0m"), "control character 0x1B on line 1"),
    "control character": ("raw.csv", TEXT.replace("31.2", "31.2\x07"), "control character 0x07 on line 3"),
    "quantities in rows": ("raw.csv", "\n".join(map(",".join, zip(*CELLS, strict=True))), "transpose it"),
    "a date of 25.2": ("raw.csv", with_cell(1, "F_N", "25.02.2026"), "line 3 '25.02.2026' is a date"),
    "a date of 2.5": ("raw.csv", with_cell(1, "F_N", "02. Mai"), "line 3 '02. Mai' is a date"),
    "a date in a workbook": ("raw.xlsx", workbook(date_for_a_number), "is a date"),
    "TRUE in a workbook": ("raw.xlsx", workbook(true_for_a_number), "line 3 'TRUE' is not a number"),
    "sums below a workbook's table": ("raw.xlsx", workbook(sums_below), "elongation_mm is blank in raw.xlsx line 11"),
    "a second table below": ("raw.xlsx", workbook(table_below), "line 12 'note' is not a number"),
    "column too narrow": ("raw.csv", with_cell(1, "F_N", "#####"), "too narrow"),
    "percent": ("raw.csv", with_cell(1, "F_N", "5%"), "line 3 '5%' is not a number"),
    "negative in brackets": ("raw.csv", with_cell(1, "F_N", "(2.25)"), "line 3 '(2.25)' is not a number"),
    "two points": ("raw.csv", with_cell(1, "F_N", "-2.2.5"), "line 3 '-2.2.5' is not a number"),
    "below the least": ("raw.csv", with_cell(1, "F_N", "<0.1"), "line 3 '<0.1' is not a number"),
    "a power written out": ("raw.csv", with_cell(1, "F_N", "1.5×10³"), "is not a number"),
    "a spreadsheet's formula": ("raw.csv", with_cell(1, "F_N", "=1+1"), "line 3 '=1+1' is not a number"),
    "another header between": ("raw.csv", TEXT.replace("\n4.0", f"\n{HEADER[::-1]}\n4.0"), "line 6"),
    "mixed decimal marks": (
        "raw.csv",
        raw_text(separator=";", decimal=",").replace("-4,75", "-4.75"),
        "line 4 '-4.75' has a decimal point, unlike the rest",
    ),
    "heading with more words": ("raw.csv", TEXT.replace("F_N", '"F_N\n(cell 2)"'), "did you mean 'F_N (cell 2)'"),
    "sums below": ("raw.csv", TEXT + "Total,,,281.1,-37.9,-105.9\n", "drop: {dl_mm: blank}"),
    "nothing measured": (
        "raw.csv",
        "\n".join([LINES[0], *(",".join([*row[:4], "", ""]) for row in CELLS[1:])]),
        "The table that this recipe makes has no reading",
    ),
    "nested structures": ("raw.mat", matlab(data={"run": columns()}), "'data' is a structure of run"),
    "array of structures": ("raw.mat", matlab(data=structures()), "has no column 'M_Nmm'"),
    "cell array": ("raw.mat", matlab(c=cells()), "'c' is a cell array"),
    "sparse matrix": ("raw.mat", matlab(a=sparse.eye(5).tocsc()), "save full"),
    "empty array": ("raw.mat", matlab(a=np.zeros((0, 0))), "save the columns as vectors"),
    "infinity in .mat": ("raw.mat", matlab(**columns() | {"F_N": np.r_[np.inf, np.zeros(8)]}), "line 1 'inf'"),
    "NaN imposed in .mat": ("raw.mat", matlab(**columns() | {"P_kPa": np.r_[np.nan, np.zeros(8)]}), "raw.mat line 1"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case, tmp_path):
    name, content, says = REFUSED[case]
    content = content if isinstance(content, bytes) else content.encode()
    # Of the table that is made of it, the raw file's name is not the matter.
    named = None if says.startswith("The table") else name
    answer = refused(tmp_path, lambda: taken(tmp_path, content, name=name), named)
    assert says in answer
    assert ".part" not in answer
    assert (tmp_path / name).read_bytes() == content


def test_more_than_sixty_kinds_are_refused_clearly():
    assert len({*test_broken_files.FILES, *REFUSED}) >= 90


# --- odd, and read --------------------------------------------------------------------------------------------


def title_above(book, sheet):
    sheet.insert_rows(1)
    sheet["B1"], sheet["E1"] = "State", "Loads"
    sheet.merge_cells("B1:D1")
    sheet.merge_cells("E1:F1")


def units_below(book, sheet):
    sheet.insert_rows(2)
    for place, unit in enumerate(("s", "mm", "°", "kPa", "N", "N·mm"), start=1):
        sheet.cell(2, place).value = unit


def times_of_day(book, sheet):
    for row in range(2, 11):
        sheet.cell(row, 1).value = datetime.datetime(2026, 2, 25, 10, 0, row)


def beside_another(book, sheet):
    for row, name in enumerate(("x", 1, 2, 3), start=1):
        sheet.cell(row, 9).value = name


def somewhere_else(book, sheet):
    sheet.insert_cols(1, 3)
    sheet.insert_rows(1, 4)
    sheet["A1"] = "Protocol 3, bed B"


def matlab_4() -> bytes:
    content = io.BytesIO()
    savemat(content, columns(), format="4")
    return content.getvalue()


READ = {
    "titles merged above the header": ("raw.xlsx", workbook(title_above)),
    "units below the header": ("raw.xlsx", workbook(units_below)),
    "times of day": ("raw.xlsx", workbook(times_of_day)),
    "another table beside it": ("raw.xlsx", workbook(beside_another)),
    "not in the corner": ("raw.xlsx", workbook(somewhere_else)),
    "macros": ("raw.xlsm", workbook()),
    "MATLAB 4": ("raw.mat", matlab_4()),
    "row of units in UTF-16": ("raw.csv", TEXT.replace("\n", "\ns,mm,°,kPa,N,N·mm\n", 1).encode("utf-16")),
    "UTF-16 without its mark": ("raw.csv", TEXT.encode("utf-16-le")),
    "lines of an old Macintosh": ("raw.csv", TEXT.replace("\n", "\r")),
    "two kinds of line ends": ("raw.csv", TEXT.replace("\n", "\r\n", 4)),
    "DOS end of file": ("raw.csv", TEXT + "\x1a"),
    "form feeds": ("raw.csv", TEXT.replace("31.2", "31.2\x0c")),
    "separators of lines inside": ("raw.csv", TEXT.replace("31.2", "31.2\u2028")),
    "spaces without width": ("raw.csv", TEXT.replace("F_N", "F_N\u200b").replace("-2.25", "\ufeff-2.25\u200b")),
    "dashes for minus signs": ("raw.csv", TEXT.replace("-", "\u2013")),
    "true minus signs": ("raw.csv", TEXT.replace("-", "\u2212")),
    "exponents of Fortran": ("raw.csv", TEXT.replace("-2.25", "-2.25D0")),
    "separators at the end": ("raw.csv", "\n".join(line + ",,," for line in LINES)),
    "everything quoted": ("raw.csv", "\n".join(",".join(f'"{cell}"' for cell in row) for row in CELLS)),
    "Markdown": ("raw.md", "\n".join(f"| {' | '.join(row)} |" for row in CELLS)),
    "columns of fixed width": ("raw.txt", "\n".join("".join(f"{cell:>9}" for cell in row) for row in CELLS)),
    "a line of Excel's": ("raw.csv", "sep=;\n" + raw_text(separator=";", decimal=",")),
    "remarks at the end": ("raw.csv", TEXT + "\nMax: 62.6 kPa\nOperator: Ann\n"),
    "left from a merge": ("raw.csv", TEXT.replace("\n4.0", "\n<<<<<<< HEAD\n4.0")),
}


@pytest.mark.parametrize("case", READ)
def test_read(case, tmp_path):
    """Each reading arrives."""
    name, content = READ[case]
    table, _ = taken(tmp_path, content if isinstance(content, bytes) else content.encode(), name=name)
    made = columns()
    for column, source in (("pressure_kpa", "P_kPa"), ("force_n", "F_N"), ("moment_nmm", "M_Nmm")):
        np.testing.assert_allclose(table[column], made[source])


def hide(book, sheet):
    sheet.row_dimensions[4].hidden = True
    sheet.row_dimensions[5].hidden = True


def test_hidden_rows_are_read_and_said(tmp_path):
    table, warnings = taken(tmp_path, workbook(hide), name="raw.xlsx")
    assert len(table) == 9
    assert any("hides were read like the others: lines 4, 5" in warning for warning in warnings)


@pytest.mark.parametrize("word", ["Mean", "TOTAL:", "Summe"])
def test_a_row_of_means_is_said(word, tmp_path):
    """All of its numbers are numbers: only the word gives it away. The recipe that is proposed leaves it out."""
    text = TEXT + f"{word},2.5,6.7,31.2,-4.2,-11.9\n"
    table, warnings = taken(tmp_path, text)
    assert len(table) == 10
    (warning,) = [w for w in warnings if "sums and means" in w]
    assert "on line 11" in warning
    drop = warning[warning.index("drop:") :].rstrip(".")
    table, warnings = taken(tmp_path, text, RECIPE + drop.replace(word, f"'{word}'") + "\n")
    assert len(table) == 9
    assert not [w for w in warnings if "sums and means" in w]


def test_a_fault_of_the_table_is_told_by_the_lines_of_the_file(tmp_path):
    """Titles above the header part the two."""
    text = "Bed 3\nAnn\n" + TEXT + "9.0,0,0,31.2,-2.25,-8.15\n"
    answer = refused(tmp_path, lambda: taken(tmp_path, text, RECIPE + "step: each_row\n"), "raw.csv")
    assert "raw.csv line 13: duplicate of raw.csv line 5: delete one of the two" in answer


def test_three_thousand_channels_more(tmp_path):
    """The table is as it was."""
    more = pd.DataFrame(np.zeros((9, 3000)), columns=[f"c{i}" for i in range(3000)])
    rows = pd.DataFrame(CELLS[1:], columns=CELLS[0])
    table, _ = taken(tmp_path, pd.concat([rows, more], axis=1).to_csv(index=False))
    np.testing.assert_allclose(table["force_n"], columns()["F_N"])
