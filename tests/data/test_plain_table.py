"""Large tables are read piece by piece: to the last bit what the careful reader reads, and refused in its words."""

import hashlib
import tempfile
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nightly import EVERY, chosen

from freelearn.api.settings.settings import CsvData
from freelearn.api.tasks import loaded_table
from freelearn.common.errors import UserError
from freelearn.common.files import add_to_digest
from freelearn.common.progress import watched
from freelearn.data.beds import BEDS, KINEMATIC
from freelearn.data.columns import Columns
from freelearn.data.table import plain_table
from freelearn.data.table.faults import PLAIN
from freelearn.data.table.measurement_table import TableFile, read_table
from freelearn.data.table.plain_table import read_plain

HEADER = [
    *("sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "step"),
    *("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm", "buckled"),
]
COLUMNS = Columns()


def good(rows: int = 40, **more: object) -> pd.DataFrame:
    """A table without a fault."""
    number = np.arange(rows)
    table = pd.DataFrame({
        "sample": 3 + number // (rows // 2), "gamma_deg": 36.0, "length_mm": 98.42, "inner_radius_mm": 4.77,
        "outer_radius_mm": 6.36, "step": number % 4, "elongation_mm": (number // 4) * 0.37 - 1, "twist_deg": 12.5,
        "pressure_kpa": number % 4 * 20.123, "force_n": 0.1 + number / 7, "moment_nmm": 3 - number / 3, "buckled": 0,
    })  # fmt: skip
    return table.assign(**more)


def large(piece: int = 700):
    """Every file counts as large, and is read in small pieces."""
    return patch.multiple(plain_table, LARGE=1, PIECE=piece)


def told(path: Path, bed: str = "kinematic") -> TableFile | str:
    try:
        return read_table(path, BEDS[bed])
    except UserError as mistake:
        return str(mistake)


def assert_same(path: Path, bed: str = "kinematic", piece: int = 700) -> None:
    """Both readers read the same, or say the same."""
    carefully = told(path, bed)
    with large(piece):
        quickly = told(path, bed)
    if isinstance(carefully, str) or isinstance(quickly, str):
        assert quickly == carefully
        return
    pd.testing.assert_frame_equal(quickly.table, carefully.table, check_exact=True)
    for name in carefully.table.select_dtypes("float"):
        bits = (read.table[name].to_numpy().view(np.int64) for read in (quickly, carefully))
        np.testing.assert_array_equal(*bits)
    np.testing.assert_array_equal(quickly.lines, carefully.lines)
    assert quickly.warnings == carefully.warnings


ODD_CELLS = [
    *("", " ", "0", "-0", "1", "-1", "2", "30.0", " 1", "1 ", "1.", ".5", "+5", "1e1", "1E+1", "1e", "e1", "."),
    *("1e160", "1e-300", "5e-324", "1e400", "-1e400", "nan", "NaN", "inf", "Infinity", "1_0", "1,5", "0x1", "１", "−1"),
    *("=1+1", "#N/A", '"', '""', '"1"', "'", "\x1a", "\0", "\t", "\u00a0", "\ufeff", "\x85", "\u2028", "é", "\r", "\n"),
    *("9" * 25, "0." + "1" * 40, "1e0000000001", "1.5e+", "1--2", "-", "+-1", "True", "NULL", "N/A", "1d3", "1e5e"),
]  # fmt: skip
ODD_LINES = ["", ",", "," * 11, "3", ",".join(["1"] * 13), " ", "\ufeff", "sep=,", ",".join(HEADER)]
ODD_NAMES = ["", "note", "sample", " force_n ", '"x"']
edit = st.one_of(
    st.tuples(st.just("cell"), st.integers(0, 40), st.integers(0, 12), st.sampled_from(ODD_CELLS)),
    st.tuples(st.just("line"), st.integers(0, 41), st.just(0), st.sampled_from(ODD_LINES)),
    st.tuples(st.just("twice"), st.integers(0, 40), st.integers(0, 40), st.just("")),
    st.tuples(st.just("column"), st.integers(0, 12), st.just(0), st.sampled_from(ODD_NAMES)),
)  # fmt: skip


@settings(
    max_examples=1000 if EVERY else 20, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
@given(
    st.lists(edit, max_size=3),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from(["", "\ufeff", "\ufeff\ufeff", "sep=,\n", "\n"]),
    st.booleans(),
    st.sampled_from([90, 700, 10**6]),
    st.booleans(),
)
def test_whatever_a_file_holds_both_readers_say_the_same(edits, ending, mark, ended, piece, noted):
    notes = {"note": [f"state {n // 4}" for n in range(40)]} if noted else {}
    lines = [line.split(",") for line in good(**notes).to_csv(index=False).splitlines()]
    for kind, first, second, value in edits:
        row = lines[min(first, len(lines) - 1)]
        if kind == "cell":
            row[min(second, len(row) - 1)] = value
        elif kind == "line":
            lines.insert(first, [value])
        elif kind == "twice":
            lines.insert(second, row)
        else:
            lines[0][min(first, len(lines[0]) - 1)] = value
    text = mark + ending.join(",".join(line) for line in lines) + (ending if ended else "")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        path.write_bytes(text.encode())
        assert_same(path, piece=piece)


PLACES = [(odd, name) for odd in ODD_CELLS for name in ("sample", "force_n", "twist_deg", "buckled", "left_out")]


@pytest.mark.parametrize(("odd", "column"), chosen(PLACES, 30))
def test_a_single_odd_cell_is_said_or_read_alike(tmp_path, odd, column):
    table = good(left_out=0).astype(str)
    table.loc[17, column] = odd
    # Joined by hand: a writer would put quotes about what is odd.
    rows = [",".join(table.columns), *(",".join(row) for row in table.to_numpy())]
    (tmp_path / "table.csv").write_bytes("\n".join(rows).encode())
    assert_same(tmp_path / "table.csv")


@pytest.mark.parametrize("content", [b"\xff", b"\xe9", b"\xc3\xa9"], ids=["no UTF-8", "latin 1", "UTF-8"])
def test_text_that_is_no_utf_8_is_said(tmp_path, content):
    text = good(note="x").to_csv(index=False).encode().replace(b",x\n", b"," + content + b"\n", 3)
    (tmp_path / "table.csv").write_bytes(text)
    assert_same(tmp_path / "table.csv")


@settings(max_examples=1000 if EVERY else 60, deadline=None, derandomize=True)
@given(
    st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=30),
    st.sampled_from(["%r", "%.17g", "%.6g", "%.30f", "%.3e", "%+.20E"]),
)
def test_numbers_are_those_of_float_to_the_last_bit(values, written):
    cells = [written % value for value in values]
    assert all(PLAIN.fullmatch(cell) for cell in cells)
    table = good(40).loc[[0] * len(cells)].astype(str).assign(force_n=cells)
    with tempfile.TemporaryDirectory() as folder, large():
        table.to_csv(Path(folder) / "table.csv", index=False)
        read = read_plain(Path(folder) / "table.csv", COLUMNS.known, COLUMNS.required)
    assert read is not None
    np.testing.assert_array_equal(
        read.numbers["force_n"].view(np.int64), np.array([float(cell) for cell in cells]).view(np.int64)
    )


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_a_plain_file_is_not_left_to_the_careful_reader(tmp_path, ending):
    """Blank readings, marks, columns of text, one mark of byte order: all of it is plain."""
    table = good(400, note=[f"run {n % 7} é" for n in range(400)], left_out=np.arange(400) % 5 == 0, slack="")
    table = table.astype({"left_out": int})
    table.loc[::3, "moment_nmm"] = np.nan
    path = tmp_path / "table.csv"
    path.write_bytes(b"\xef\xbb\xbf" + table.to_csv(index=False, lineterminator=ending).encode())
    heard = []
    with large(), watched(lambda *how_far: heard.append(how_far)):
        assert len(read_plain(path, COLUMNS.known, COLUMNS.required)) == 400
    assert heard[-1] == ("reading", path.stat().st_size, path.stat().st_size)
    assert [done for _, done, _ in heard] == sorted(done for _, done, _ in heard)
    assert_same(path)
    with large(), patch("freelearn.data.table.measurement_table.read_records", side_effect=AssertionError):
        read = read_table(path)
    assert read.table["slack"].tolist() == [0] * 400
    # A text that stands in many rows is kept once; pyarrow, where it is installed, keeps no objects at all.
    notes = read.table["note"]
    assert getattr(notes.dtype, "storage", "") == "pyarrow" or len({id(cell) for cell in notes.to_numpy(object)}) <= 7


def test_a_small_file_is_read_carefully(tmp_path):
    good().to_csv(tmp_path / "table.csv", index=False)
    assert read_plain(tmp_path / "table.csv", COLUMNS.known, COLUMNS.required) is None


@pytest.mark.parametrize("cell", ["dead_load", "kinematic", " kinematic"])
@pytest.mark.parametrize("bed", ["kinematic", "isometric"])
def test_a_table_that_tells_its_bed_is_read_as_of_no_other(tmp_path, bed, cell):
    good(bed=cell).to_csv(tmp_path / "table.csv", index=False)
    assert_same(tmp_path / "table.csv", bed)


@settings(max_examples=20 if EVERY else 8, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.integers(0, 5), st.sampled_from([0.0, -0.0, 0.5, np.nan])), min_size=4, max_size=30))
def test_rows_that_repeat_are_found_as_by_comparing_all_of_them(pairs):
    state, force = (np.array(column, dtype=np.float64) for column in zip(*pairs, strict=True))
    table = good(2 * len(pairs)).iloc[: len(pairs)].assign(sample=3, step=0, elongation_mm=state, pressure_kpa=0.0)
    table = table.assign(force_n=force, moment_nmm=1.0).reset_index(drop=True)
    keys = table[["sample", *COLUMNS.state, *COLUMNS.measured]]
    expected = keys.duplicated() & keys.notna().all(axis=1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        table.to_csv(path, index=False)
        said = told(path)
        assert_same(path)
    assert (str(said).count("duplicate of line") > 0) == bool(expected.any())
    assert KINEMATIC.state == COLUMNS.bed.state


def test_a_digest_in_pieces_is_that_of_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr("freelearn.common.files.CHUNK", 7)
    (tmp_path / "file").write_bytes(bytes(range(100)))
    digest = hashlib.sha256()
    add_to_digest(digest, tmp_path / "file")
    assert digest.hexdigest() == hashlib.sha256(bytes(range(100))).hexdigest()
    monkeypatch.setenv("FREELEARN_LARGEST_FILE_GB", "0.00000005")
    with pytest.raises(UserError, match="larger than is read"):
        add_to_digest(hashlib.sha256(), tmp_path / "file")


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    good().to_csv(path, index=False)
    settings = CsvData(name="csv", path=path, accuracy=None)

    def late(*asked: object) -> TableFile:
        read = read_table(path)
        good(60).to_csv(path, index=False)
        return read

    monkeypatch.setattr(loaded_table, "_read", late)
    with pytest.raises(UserError, match="changed while it was read"):
        loaded_table.load_table(settings)
