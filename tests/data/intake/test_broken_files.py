"""Broken files and recipes of laboratories: one clear answer, nothing written, and the raw file untouched."""

import gzip
import io
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from nightly import chosen
from raw_files import HEADER, RECIPE, raw_text, taken, taken_path, with_cell
from scipy.io import savemat

from freelearn.common.errors import UserError
from freelearn.data.intake.readers import sheets
from freelearn.data.intake.recipes.recipe_file import recipe_of

LINES = raw_text().splitlines()


def workbook(change=None) -> bytes:
    """The file as a workbook, changed."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    for line in LINES:
        sheet.append([float(cell) if cell[-1].isdigit() else cell for cell in line.split(",")])
    if change:
        change(book, sheet)
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


def matlab(**variables) -> bytes:
    content = io.BytesIO()
    savemat(content, variables)
    return content.getvalue()


def patched(content: bytes, place: int) -> bytes:
    """The file with a tag of a type that there is not."""
    return content[:place] + b"i" + content[place + 1 :]


def columns() -> dict[str, np.ndarray]:
    cells = np.array([[float(cell) for cell in line.split(",")] for line in LINES[1:]])
    return dict(zip(HEADER.split(","), cells.T, strict=True))


def archive() -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        file.writestr("raw.csv", raw_text())
    return content.getvalue()


class Bomb:
    def __reduce__(self):
        return os.system, ("touch /tmp/freelearn_pickle_was_opened",)


def two_sheets(book, sheet):
    book.create_sheet("second").append([1, 2])


def empty_sheets(book, sheet):
    sheet.delete_rows(1, 100)


def merged_header(book, sheet):
    sheet.merge_cells("B1:C1")


def formula(book, sheet):
    sheet["E3"] = "=E4*2"


# name of the file, content, what the answer says besides the name.
FILES = {
    "empty": ("raw.csv", b"", "is empty"),
    "blank": ("raw.csv", b"\n  \n\n", "is empty"),
    "comments only": ("raw.csv", b"# a\n# b\n", "is empty"),
    "binary": ("raw.csv", bytes(range(256)) * 20, "binary"),
    "NUL bytes": ("raw.csv", raw_text().replace("31.2", "3\0.2").encode(), "binary"),
    "NUL block at the end": ("raw.csv", raw_text().encode() + b"\0" * 4096, "binary"),
    "header only": ("raw.csv", HEADER + "\n", "only a header"),
    "prose": ("raw.csv", "Dear colleague,\nthe data come tomorrow.\nYours\n", "no rows of numbers"),
    "gzip": ("raw.csv", gzip.compress(raw_text().encode()), "gzip"),
    "zip": ("raw.csv", archive(), "archive"),
    "bzip2": ("raw.csv", b"BZh91AY&SY" + b"x" * 40, "bzip2"),
    "7z": ("raw.dat", b"7z\xbc\xaf\x27\x1c" + b"x" * 40, "7z"),
    "old Excel": ("raw.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600, "save it as .xlsx"),
    "web page as .xls": ("raw.xls", "<html><table><tr><td>1</td></tr></table></html>", "web page"),
    "XML as .xls": ("raw.xls", '<?xml version="1.0"?><Workbook/>', "web page or XML"),
    "CSV as .xlsx": ("raw.xlsx", raw_text(), "no .xlsx"),
    "damaged workbook": ("raw.xlsx", workbook()[:300], "damaged"),
    "half a workbook": ("raw.xlsx", b"PK\x03\x04" + b"x" * 300, "damaged"),
    "several sheets": ("raw.xlsx", workbook(two_sheets), "choose one with read: {sheet"),
    "empty workbook": ("raw.xlsx", workbook(empty_sheets), "is empty"),
    "merged cells": ("raw.xlsx", workbook(merged_header), "merged: unmerge"),
    "formulas never calculated": ("raw.xlsx", workbook(formula), "formula without a value"),
    "MATLAB 7.3": ("raw.mat", b"MATLAB 7.3 MAT-file" + b"\0" * 600, "-v7"),
    "HDF5 as .mat": ("raw.mat", b"\x89HDF\r\n\x1a\n" + b"\0" * 600, "-v7"),
    "HDF5": ("raw.h5", b"\x89HDF\r\n\x1a\n" + b"\0" * 600, "HDF5"),
    "damaged .mat": ("raw.mat", matlab(**columns())[:200], "cannot be read as a MATLAB file"),
    "a .mat that ends SciPy's process": ("raw.mat", patched(matlab(**columns()), 145), "it is damaged"),
    "structures in .mat": (
        "raw.mat",
        matlab(s={"a": 1}, u={"b": 2}),
        "'s' is a structure of a, 'u' is a structure of b",
    ),
    "arrays of several lengths": ("raw.mat", matlab(a=np.arange(5.0), b=np.arange(6.0)), "differ in length"),
    "texts in .mat": ("raw.mat", matlab(a="text"), "no numeric arrays"),
    "complex .mat": ("raw.mat", matlab(a=np.arange(3) * 1j), "complex"),
    "cube in .mat": ("raw.mat", matlab(a=np.zeros((3, 2, 2))), "3 dimensions"),
    "pickle": ("raw.csv", pickle.dumps(Bomb()), "pickle"),
    "pickle by its name": ("raw.pkl", raw_text(), "pickle"),
    "NumPy array": ("raw.npy", b"\x93NUMPY\x01\x00v\x00{", "NumPy"),
    "Parquet": ("raw.parquet", b"PAR1" + b"x" * 40, "Parquet"),
    "PDF": ("raw.csv", b"%PDF-1.4\n" + b"x" * 40, "PDF"),
    "picture": ("raw.csv", b"\x89PNG\r\n\x1a\n" + b"x" * 40, "picture"),
    "LabVIEW": ("raw.tdms", b"TDSm" + b"\x0e\0" * 40, "TDMS"),
    "stray quote": ("raw.csv", raw_text().replace("31.2", '"31.2'), "stray quote"),
    "decimal commas between commas": ("raw.csv", raw_text(decimal=","), "decimal comma"),
    "too many cells": ("raw.csv", raw_text().replace("31.2,", "31.2,7,"), "line 3: 7 values for 6 columns"),
    "thousands": ("raw.csv", with_cell(1, "F_N", '"1,234.5"'), "thousands"),
    "underscore": (
        "raw.csv",
        with_cell(1, "F_N", "1_000"),
        "line 3 '1_000' is not a number: write its digits without _",
    ),
    "infinity": ("raw.csv", with_cell(1, "F_N", "inf"), "not a finite number"),
    "overload": ("raw.csv", with_cell(1, "M_Nmm", "OL"), "not a finite number"),
    "beyond floats": ("raw.csv", with_cell(1, "F_N", "1e999"), "too large"),
    "huge": ("raw.csv", with_cell(1, "F_N", "1e300"), "which nothing measures"),
    "words": ("raw.csv", with_cell(1, "F_N", "strong"), "line 3 'strong' is not a number"),
    "unit in the cell": ("raw.csv", with_cell(1, "F_N", "-2.25 N"), "is not a number"),
    "one decimal comma": ("raw.csv", with_cell(1, "F_N", '"-2,25"'), "decimal comma, unlike the rest"),
    "hexadecimal": ("raw.csv", with_cell(1, "F_N", "0x1f"), "is not a number"),
    "Arabic digits": ("raw.csv", with_cell(1, "F_N", "٣"), "is not a number"),
    "blank imposed cell": ("raw.csv", with_cell(1, "P_kPa", ""), "pressure_kpa is blank in raw.csv line 3"),
    "imposed #DIV/0!": ("raw.csv", with_cell(1, "dl_mm", "#DIV/0!"), "elongation_mm is blank in raw.csv line 3"),
    "missing column": ("raw.csv", raw_text(HEADER.replace("P_kPa", "P_kPaa")), "'P_kPa': did you mean 'P_kPaa'"),
    "vacuum beyond": ("raw.csv", with_cell(1, "P_kPa", "-400"), "line 3, pressure_kpa: '-400' is below a vacuum"),
}

# What takes its place in the recipe, with what, and the answer.
RECIPES = {
    "no bed": ("bed: kinematic", "", "says no bed"),
    "unknown bed": ("bed: kinematic", "bed: kinematik", "did you mean kinematic"),
    "unknown key": ("bed:", "columnz: 3\nbed:", "did you mean columns"),
    "unknown key inside": ("unit: kPa}", "unit: kPa, sing: -1}", "did you mean sign"),
    "unknown column of the table": ("force_n:", "force_N:", "did you mean force_n"),
    "unknown column of the file": ("from: F_N", "from: F_n", None),
    "absent column of the file": ("from: F_N", "from: Kraft", "raw.csv has no column 'Kraft'"),
    "unknown unit": ("unit: kPa", "unit: kPaa", "is no unit"),
    "ticks": ("unit: N}", "unit: ticks}", "is no unit"),
    "unit of another kind": ("unit: kPa", "unit: mm", "is a length, not a pressure"),
    "volts": ("unit: N}", "unit: V}", "scale"),
    "moment for a force": ("unit: N}", "unit: N·m}", "is a moment, not a force"),
    "no unit": (", unit: kPa", "", "has no unit"),
    "no source": ("from: P_kPa, ", "", "names no column of the file"),
    "sign of 2": ("unit: kPa}", "unit: kPa, sign: 2}", "write 1 or -1"),
    "scale of 0": ("unit: kPa}", "unit: kPa, scale: 0}", "is 0"),
    "not a number": ("gamma_deg: 40", "gamma_deg: forty", "'forty', not a number"),
    "infinite": ("gamma_deg: 40", "gamma_deg: .inf", "not a number"),
    "blank constant": ("gamma_deg: 40", "gamma_deg: ", "gamma_deg is blank: fill in a number"),
    "lacking constant": ("gamma_deg: 40, ", "", "gamma_deg is given nowhere"),
    "constant and column": ("gamma_deg: 40", "gamma_deg: 40, force_n: 0", "both a column and a constant"),
    "angle of 90": ("gamma_deg: 40", "gamma_deg: 90", "gamma_deg"),
    "swapped radii": ("inner_radius_mm: 4.77", "inner_radius_mm: 9", "is not above inner_radius_mm"),
    "python tag": ("bed: kinematic", "bed: !!python/object/apply:os.system [ls]", "no tags"),
    "key twice": ("bed: kinematic", "bed: kinematic\nbed: isometric", "stands twice"),
    "alias": ("bed: kinematic", "bed: &a kinematic\nabout: *a", "write it out"),
    "no YAML": ("bed: kinematic", "bed: [kinematic", "line"),
    "a list": (RECIPE, "- 1\n- 2\n", "is no recipe"),
    "a text": (RECIPE, "hello", "is no recipe"),
    "empty recipe": (RECIPE, "\n", "is empty"),
    "rest unsaid": ("unit: N}", "unit: N, offset: rest}", "nothing says which rows are at rest"),
    "rest unused": ("bed:", "rest: first\nbed:", "no column has offset: rest"),
    "rest nowhere": ("unit: N}", "unit: N, offset: rest}\nrest: {P_kPa: 99}", None),
    "condition on no column": ("bed:", "drop: {valve: open}\nbed:", "no column 'valve'"),
    "nothing left": ("bed:", "keep: {P_kPa: 999}\nbed:", "leave no row"),
    "plateaus of nothing": ("bed:", "plateaus: {least: 3}\nbed:", "says of no column"),
    "no plateaus": ("bed:", "plateaus: {of: {pressure_kpa: 0.1}, least: 5}\nbed:", "no plateau"),
    "tolerance below 0": ("bed:", "state_tolerance: {twist_deg: -1}\nbed:", "positive"),
    "circle": ("unit: N}", "unit: N, minus: [{pressure_on: {from: F_N, unit: mm}}], plus: force_n}", "force_n"),
    "thrust in a length": ("unit: mm}", "unit: mm, plus: {pressure_on: 3}}", "only a column in newtons"),
    "words for samples": ("bed:", "sample: {from: t_s, as: {a: 1}}\nbed:", "sample.as has no number"),
    "sample 0": ("bed:", "sample: 0\nbed:", "integer from 1 up"),
    "several files for one": ("bed:", "files: [{name: a.csv}, {name: b.csv}]\nbed:", "folder"),
    "file outside": ("bed:", "files: [{name: ../a.csv}]\nbed:", "name of a file in the folder"),
    "members and pressure": ("bed:", "members: [{pressure: {from: P_kPa, unit: kPa}, gamma_deg: 3}]\nbed:", "exclude"),
    "steps": ("bed:", "step: count\nbed:", "each_row"),
    "unknown encoding": ("bed:", "read: {encoding: utf-99}\nbed:", "is no encoding"),
    "wrong encoding": ("bed:", "read: {encoding: utf-32}\nbed:", "is not utf-32 text"),
    "header beyond": ("bed:", "read: {header: 99}\nbed:", "nothing on line 99"),
    "separator of two": ("bed:", "read: {separator: ';;'}\nbed:", "one character"),
    "carry what is there": ("bed:", "carry: [sample]\nbed:", "sample"),
}


def refused(folder: Path, call, name: str | None) -> str:
    """What the one clear answer is; nothing may be left behind."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(UserError) as answer:
        call()
    text = str(answer.value)
    assert name is None or name in text
    assert "Traceback" not in text
    assert len(text) < 2000
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.suffix != ".yaml"}
    new = {path for path in after if path not in before}
    assert {path.name for path in new} <= {name, "raw.csv"}
    assert not (folder / "out").exists() or not list((folder / "out").iterdir())
    return text


@pytest.mark.parametrize("case", chosen(list(FILES), 30))
def test_broken_files(case, tmp_path):
    name, content, says = FILES[case]
    content = content if isinstance(content, bytes) else content.encode()
    answer = refused(tmp_path, lambda: taken(tmp_path, content, name=name), name)
    assert says in answer
    assert (tmp_path / name).read_bytes() == content


@pytest.mark.parametrize("case", [case for case in RECIPES if RECIPES[case][2]])
def test_broken_recipes(case, tmp_path):
    old, new, says = RECIPES[case]
    assert old in RECIPE
    answer = refused(tmp_path, lambda: taken(tmp_path, raw_text(), RECIPE.replace(old, new, 1)), None)
    assert says in answer


def test_nothing_was_ever_unpickled():
    assert not Path("/tmp/freelearn_pickle_was_opened").exists()


def test_every_mistake_of_a_recipe_is_told_at_once():
    broken = RECIPE.replace("kinematic", "kinetic").replace("unit: kPa", "unit: kilo").replace("gamma_deg", "gama_deg")
    with pytest.raises(UserError) as answer:
        recipe_of(broken, "recipe.yaml")
    text = str(answer.value)
    assert text.startswith("recipe.yaml has 3 mistakes:")
    assert "did you mean kinematic?" in text
    assert "columns.pressure_kpa" in text
    assert "did you mean gamma_deg?" in text


def test_a_rest_that_no_row_meets(tmp_path):
    recipe = RECIPE.replace("unit: N}", "unit: N, offset: rest}") + "rest: {P_kPa: 99}\n"
    assert "correct rest" in refused(tmp_path, lambda: taken(tmp_path, raw_text(), recipe), "raw.csv")


def test_paths_that_are_no_files(tmp_path):
    assert "no file" in refused(tmp_path, lambda: taken_path(tmp_path, tmp_path / "absent.csv"), "absent.csv")
    assert "is a folder" in refused(tmp_path, lambda: taken_path(tmp_path, tmp_path), tmp_path.name)
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    assert "not a regular file" in refused(tmp_path, lambda: taken_path(tmp_path, pipe), "pipe.csv")
    assert "not a regular file" in refused(tmp_path, lambda: taken_path(tmp_path, Path("/dev/zero")), "/dev/zero")
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    refused(tmp_path, lambda: taken_path(tmp_path, loop), "loop.csv")
    long = tmp_path / ("x" * 300)
    refused(tmp_path, lambda: taken_path(tmp_path, long), "xxx")


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    raw = tmp_path / "raw.csv"
    raw.write_text(raw_text())

    def denied(path, *args, **options):
        if path == raw:
            raise PermissionError(13, "Permission denied")
        return open(path, *args, **options)

    monkeypatch.setattr("freelearn.common.files.open", denied, raising=False)
    with pytest.raises(UserError, match=r"raw\.csv may not be read by this user"):
        taken_path(tmp_path, raw)


def test_a_file_far_too_large(tmp_path):
    raw = tmp_path / "raw.csv"
    with raw.open("wb") as file:
        file.truncate(2_000_000_001)  # A hole: it takes no room on the disk.
    with pytest.raises(UserError, match=r"larger than is read \(2 GB of at most 2\).*FREELEARN_LARGEST_FILE_GB"):
        taken_path(tmp_path, raw)


def test_without_openpyxl_the_answer_names_the_extra(tmp_path, monkeypatch):
    content = workbook()
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    assert "freelearn[excel]" in refused(tmp_path, lambda: taken(tmp_path, content, name="raw.xlsx"), "raw.xlsx")


def test_a_workbook_that_would_unpack_to_too_much(tmp_path, monkeypatch):
    monkeypatch.setattr(sheets, "LARGEST", 1000)
    assert "unpacks to more" in refused(tmp_path, lambda: taken(tmp_path, workbook(), name="raw.xlsx"), "raw.xlsx")


def test_the_output_never_takes_the_place_of_something_else(tmp_path):
    taken(tmp_path, raw_text())
    taken(tmp_path, raw_text())  # Its own table may be made again.
    out = tmp_path / "out" / "table.csv"
    out.with_name("table_provenance.json").unlink()
    before = out.read_bytes()
    with pytest.raises(UserError, match="is no table of intake's"):
        taken(tmp_path, raw_text())
    assert out.read_bytes() == before


def test_a_recipe_that_is_absent_or_the_data(commands, tmp_path):
    (tmp_path / "mine.yaml").write_text(RECIPE)
    raw = tmp_path / "raw.csv"
    raw.write_text(raw_text())
    done = commands.run("intake", f"data.path={raw}", f"recipe={tmp_path / 'mine.yml'}")
    assert done.status == 1
    assert "mine.yml: " in done.err
    assert "holds mine.yaml." in done.err
    with pytest.raises(UserError, match="is no recipe"):
        recipe_of(raw_text(), "raw.csv")
