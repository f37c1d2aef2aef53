"""A measurement table is read exactly, or refused with every fault at its line and column."""

import csv
import io
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nightly import EVERY

from freelearn.common.errors import UserError
from freelearn.data.columns import left_out_rows, usable_rows
from freelearn.data.table.faults import Fault, TableError
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.records import mark_left_out
from freelearn.physics.simulated_bed import protocol

HEADER = [
    *("sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "step"),
    *("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm", "buckled"),
]


def valid_table() -> pd.DataFrame:
    """Two actuators, three states, four pressures; every load different. Row i is on line i + 2 of its file."""
    rows: list[tuple[float, ...]] = []
    for sample, gamma, length in ((3, 36.0, 98.42), (4, 40.0, 90.48)):
        for elongation, twist in ((-5.0, -120.0), (0.0, 0.1), (2.5, 60.0)):
            for step, pressure in enumerate((0.0, 35.5, 72.5, 35.5)):
                n = len(rows)
                loads = (0.1 + 0.7 * n, 3.0 - 11.3 * n)
                state = (step, elongation, twist, pressure)
                rows.append((sample, gamma, length, 4.77, 6.74 - 0.1 * sample, *state, *loads, int(n == 5)))
    return pd.DataFrame(rows, columns=HEADER)


def cells_of(table: pd.DataFrame) -> list[list[str]]:
    return list(csv.reader(io.StringIO(table.to_csv(index=False))))


def text_of(cells: list[list[str]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(cells)
    return text.getvalue()


def with_cells(*changes: tuple[int, str, str]) -> str:
    """The valid table's text after changes (line, column, new text)."""
    cells = cells_of(valid_table())
    for line, column, value in changes:
        cells[line - 1][HEADER.index(column)] = value
    return text_of(cells)


def with_header(old: str, new: str) -> str:
    return valid_table().rename(columns={old: new}).to_csv(index=False)


def with_line(line: int, new: str) -> str:
    lines = valid_table().to_csv(index=False).splitlines()
    lines[line - 1] = new
    return "\n".join(lines)


def with_duplicate() -> str:
    lines = valid_table().to_csv(index=False).splitlines()
    return "\n".join([*lines, lines[6]])


def faults_of(folder: Path, text: str) -> tuple[list[Fault], str]:
    file = folder / "table.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(TableError) as caught:
        read_table(file)
    return caught.value.faults, str(caught.value)


BROKEN = {
    "missing, nearly there": (with_header("pressure_kpa", "presure_kpa"), 1, "pressure_kpa", "'presure_kpa'"),
    "missing, other capitals": (with_header("force_n", "Force_N"), 1, "force_n", "rename 'Force_N'"),
    "missing": (valid_table().drop(columns="buckled").to_csv(index=False), 1, "buckled", "missing: add it"),
    "twice": (
        valid_table().assign(x=1.0).rename(columns={"x": "step"}).to_csv(index=False),
        *(1, "step", "appears 2 times"),
    ),
    "no name": (valid_table().assign(x=1).rename(columns={"x": ""}).to_csv(index=False), 1, "", "column 13"),
    "decimal comma": (with_cells((7, "force_n", "1,5")), 7, "force_n", "decimal comma: write 1.5"),
    "unit in the cell": (with_cells((7, "force_n", "1.5 N")), 7, "force_n", "not a number"),
    "blank": (with_cells((2, "twist_deg", "")), 2, "twist_deg", "blank"),
    "NaN": (with_cells((2, "moment_nmm", "NaN")), 2, "moment_nmm", "finite"),
    "infinite": (with_cells((2, "moment_nmm", "-inf")), 2, "moment_nmm", "finite"),
    "overflow": (with_cells((2, "moment_nmm", "1e999")), 2, "moment_nmm", "not a number"),
    "no length": (with_cells((9, "length_mm", "0")), 9, "length_mm", "not positive"),
    "no length left": (with_cells((9, "elongation_mm", "-98.42")), 9, "elongation_mm", "no length"),
    "inner radius": (with_cells((9, "inner_radius_mm", "-4.77")), 9, "inner_radius_mm", "not positive"),
    "outer radius": (with_cells((9, "outer_radius_mm", "4.77")), 9, "outer_radius_mm", "above inner"),
    "gamma 0": (with_cells((25, "gamma_deg", "0")), 25, "gamma_deg", "outside"),
    "gamma 90": (with_cells((25, "gamma_deg", "-90")), 25, "gamma_deg", "outside"),
    "gamma turned": (with_cells((25, "gamma_deg", "-40")), 25, "gamma_deg", "differs from 40.0"),
    "step negative": (with_cells((4, "step", "-1")), 4, "step", "not an integer"),
    "step fraction": (with_cells((4, "step", "1.5")), 4, "step", "not an integer"),
    "sample 0": (with_cells((4, "sample", "0")), 4, "sample", "positive integer"),
    "sample name": (with_cells((4, "sample", "FREE3")), 4, "sample", "not a number"),
    "sample huge": (with_cells((4, "sample", "1e300")), 4, "sample", "positive integer"),
    "buckled 2": (with_cells((4, "buckled", "2")), 4, "buckled", "neither 0 nor 1"),
    "left out 2": (valid_table().assign(left_out=2).head(1).to_csv(index=False), 2, "left_out", "neither 0 nor 1"),
    "left out yes": (valid_table().assign(left_out="yes").head(1).to_csv(index=False), 2, "left_out", "not a number"),
    "vacuum": (with_cells((4, "pressure_kpa", "-101.5")), 4, "pressure_kpa", "below a vacuum"),
    "another design": (with_cells((2, "gamma_deg", "37")), 2, "gamma_deg", "differs from 36.0"),
    "duplicate": (with_duplicate(), 26, "", "duplicate of line 7"),
    "value too many": (with_line(5, "3,36,98,42,4.77,6.44,0,1,2,3,4,5,0"), 5, "", "13 values for 12"),
    "line cut off": (with_line(25, "4,40.0,90.4"), 25, "", "3 values for 12"),
    "blank but for commas": (with_line(25, "," * 11), 25, "", "delete the line"),
    "after a blank line": ("\n" + with_cells((2, "twist_deg", "x")), 3, "twist_deg", "not a number"),
    "optional column": (valid_table().assign(time_s="soon").head(1).to_csv(index=False), 2, "time_s", "not a"),
}


@pytest.mark.parametrize(("text", "line", "column", "phrase"), BROKEN.values(), ids=BROKEN)
def test_fault_is_reported_where_it_is(tmp_path: Path, text: str, line: int, column: str, phrase: str) -> None:
    faults, message = faults_of(tmp_path, text)
    assert [(f.line, f.column) for f in faults] == [(line, column)]
    assert phrase in faults[0].problem
    assert f"line {line}" in message
    assert phrase in message


def test_all_faults_of_a_file_come_in_one_report(tmp_path: Path) -> None:
    text = with_cells((12, "buckled", "yes"), (3, "pressure_kpa", "-300"), (3, "gamma_deg", "95"), (8, "step", ""))
    faults, message = faults_of(tmp_path, text.replace("moment_nmm", "momentnmm"))
    places = [(1, "moment_nmm"), (3, "gamma_deg"), (3, "pressure_kpa"), (8, "step"), (12, "buckled")]
    assert [(f.line, f.column) for f in faults] == places
    assert [f.value for f in faults] == ["", "95", "-300", "", "yes"]
    assert "has 5 faults" in message
    assert len(message.splitlines()) == 6


def test_long_report_is_cut_but_its_faults_are_all_there(tmp_path: Path) -> None:
    faults, message = faults_of(tmp_path, valid_table().assign(force_n="\x1b[31m" + "9" * 99).to_csv(index=False))
    assert len(faults) == 24
    assert message.endswith("… and 4 more")
    assert "\x1b" not in message
    assert max(map(len, message.splitlines()[1:])) < 160


def test_line_numbers_count_quoted_line_ends(tmp_path: Path) -> None:
    table = valid_table().assign(note="two\nlines")
    faults, _ = faults_of(tmp_path, table.astype({"step": str}).replace({"step": {"3": "x"}}).to_csv(index=False))
    assert [f.line for f in faults] == [2 + 2 * row for row in (3, 7, 11, 15, 19, 23)]


# No deadline: the first example also imports pandera.
@settings(deadline=None, max_examples=100 if EVERY else 30)
@given(
    row=st.integers(0, 23),
    column=st.sampled_from(HEADER),
    garbage=st.sampled_from(["", " ", "nan", "inf", "1,5", "x", "1.2.3", "−1", "#", "=1+1", "__import__('os')", '"'])
    | st.text(st.characters(codec="utf-8", categories=["L", "P", "S"]), min_size=3).filter(lambda t: not number(t)),
)
def test_corrupted_cell_is_found(row: int, column: str, garbage: str) -> None:
    # What is measured may be blank in a row; what is imposed may not.
    assume(garbage.strip() or column not in ("force_n", "moment_nmm"))
    with tempfile.TemporaryDirectory() as folder:
        faults, _ = faults_of(Path(folder), with_cells((row + 2, column, garbage)))
    assert [(f.line, f.column, f.value) for f in faults] == [(row + 2, column, garbage)]


def number(text: str) -> bool:
    try:
        return abs(float(text)) < float("inf")
    except ValueError:
        return False


def test_written_frame_is_read_back(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    table = valid_table().assign(time_s=lambda t: t.index / 3, temperature_c=21.5, note="a, b", code="007")
    table = table[["note", *HEADER[::-1], "code", "temperature_c", "time_s"]]
    table.to_csv(file, index=False)
    read = read_table(file)
    pd.testing.assert_frame_equal(read.table, table)
    assert read.warnings == []


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_byte_order_mark_spaces_and_line_ends_are_accepted(tmp_path: Path, line_end: str) -> None:
    file = tmp_path / "table.csv"
    text = valid_table().to_csv(index=False).replace(",", ", ").replace("\n", line_end)
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    pd.testing.assert_frame_equal(read_table(file).table, valid_table())


def test_repeat_of_a_state_is_no_duplicate(tmp_path: Path) -> None:
    table = valid_table()
    pd.concat([table, table.assign(force_n=table["force_n"] + 0.01)]).to_csv(tmp_path / "loads.csv", index=False)
    assert len(read_table(tmp_path / "loads.csv").table) == 48
    timed = pd.concat([table, table]).reset_index(drop=True).assign(time_s=lambda t: t.index)
    timed.to_csv(tmp_path / "times.csv", index=False)
    assert len(read_table(tmp_path / "times.csv").table) == 48


def test_rows_know_their_lines(tmp_path: Path) -> None:
    lines = valid_table().assign(note='two\nlines, "quoted"').to_csv(index=False).splitlines()
    # Each row takes two lines; a blank one goes before the header and another before the third row.
    text = "\n".join(["", *lines[:5], "", *lines[5:]])
    (tmp_path / "table.csv").write_text(text)
    read = read_table(tmp_path / "table.csv")
    assert read.lines.tolist() == [3, 5, *range(8, 8 + 2 * 22, 2)]
    pd.testing.assert_frame_equal(read.table[HEADER], valid_table())


def test_a_mark_may_be_blank_and_is_then_none(tmp_path: Path) -> None:
    marks = ["1", "", " ", "0", "1.0", *[""] * 19]
    valid_table().assign(left_out=marks).to_csv(tmp_path / "table.csv", index=False)
    read = read_table(tmp_path / "table.csv").table
    assert read["left_out"].tolist() == [1, 0, 0, 0, 1, *[0] * 19]
    assert read["left_out"].dtype == "int64"
    assert np.flatnonzero(~usable_rows(read)).tolist() == [0, 4, 5]
    assert np.flatnonzero(left_out_rows(read)).tolist() == [0, 4]
    # A row that is both is buckled.
    read.loc[5, "left_out"] = 1
    assert np.flatnonzero(left_out_rows(read)).tolist() == [0, 4]


def test_what_is_left_out_draws_no_suspicion(tmp_path: Path) -> None:
    table = valid_table().assign(left_out=0)
    table.loc[7, ["pressure_kpa", "left_out"]] = 72500.0, 1
    table.to_csv(tmp_path / "table.csv", index=False)
    assert read_table(tmp_path / "table.csv").warnings == []
    table.assign(left_out=0).to_csv(tmp_path / "table.csv", index=False)
    assert "pascals" in read_table(tmp_path / "table.csv").warnings[0]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_marked_copy_is_the_users_text_but_for_the_marks(tmp_path: Path, end: str) -> None:
    table = valid_table().assign(note='a "quoted", cell', code="007")
    lines = table.to_csv(index=False).replace("72.5", " 72.500").splitlines()
    text = end.join(["", *lines[:5], "", *lines[5:]])
    content = b"\xef\xbb\xbf" + text.encode()
    marked = mark_left_out(content, [4, 9, 12])
    with_marks = [
        line + ("," + ("left_out" if n == 2 else "1" if n in (4, 9, 12) else "") if line else "")
        for n, line in enumerate(text.split(end), 1)
    ]
    assert marked == b"\xef\xbb\xbf" + end.join(with_marks).encode()
    (tmp_path / "table.csv").write_bytes(marked)
    read = read_table(tmp_path / "table.csv")
    assert read.lines[read.table["left_out"] == 1].tolist() == [4, 9, 12]
    # Marked once more, the column is there: what was marked stays so.
    again = mark_left_out(marked, [5, 9])
    changed = [
        n for n, pair in enumerate(zip(marked.splitlines(), again.splitlines(), strict=True), 1) if len({*pair}) > 1
    ]
    assert changed == [5]
    (tmp_path / "table.csv").write_bytes(again)
    pd.testing.assert_frame_equal(
        read_table(tmp_path / "table.csv").table.drop(columns="left_out"), read.table.drop(columns="left_out")
    )
    assert read.lines[read_table(tmp_path / "table.csv").table["left_out"] == 1].tolist() == [4, 5, 9, 12]


WHOLE_FILES = {
    "empty": (b"", "is empty"),
    "only blank lines": (b"\n \n", "is empty"),
    "only a header": (",".join(HEADER).encode(), "holds no rows"),
    "semicolons": (valid_table().to_csv(index=False, sep=";", decimal=",").encode(), "semicolons"),
    "tabs": (valid_table().to_csv(index=False, sep="\t").encode(), "tabs"),
    "UTF-16": (valid_table().to_csv(index=False).encode("utf-16"), "not UTF-8"),
    "Latin 1": (valid_table().assign(note="Prüfstand").to_csv(index=False).encode("latin-1"), "(line 2)"),
    "binary": (b"PK\0\0\0", "binary"),
    "no header": (valid_table().to_csv(index=False, header=False).encode(), "no header"),
    "all buckled": (valid_table().assign(buckled=1).to_csv(index=False).encode(), "marked as buckled"),
    "all marked": (
        valid_table().assign(left_out=lambda t: 1 - t["buckled"]).to_csv(index=False).encode(),
        "marked as buckled or left out",
    ),
    "stray quote": (valid_table().to_csv(index=False).encode() + b'4,"40', "line 26"),
}


@pytest.mark.parametrize(("content", "phrase"), WHOLE_FILES.values(), ids=WHOLE_FILES)
def test_file_that_is_no_table_is_refused_in_one_sentence(tmp_path: Path, content: bytes, phrase: str) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(content)
    with pytest.raises(UserError) as caught:
        read_table(file)
    assert phrase in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_suggests_names(tmp_path: Path) -> None:
    (tmp_path / "measurements.csv").touch()
    with pytest.raises(UserError, match=r"no file .*mesurements\.csv.* holds measurements\.csv"):
        read_table(tmp_path / "mesurements.csv")
    with pytest.raises(UserError, match=r"folder .* does not exist"):
        read_table(tmp_path / "nowhere" / "table.csv")
    with pytest.raises(UserError, match="is a folder"):
        read_table(tmp_path)
    with pytest.raises(UserError, match="not a regular file"):
        read_table("/dev/zero")
    with pytest.raises(UserError, match="cannot be read"):
        read_table(tmp_path / ("x" * 300))


def test_forbidden_file_is_a_users_mistake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # chmod would not stop root, as whom containers run the tests.
    def forbid(*args: object, **options: object) -> io.BufferedReader:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("freelearn.common.files.open", forbid, raising=False)
    (tmp_path / "table.csv").touch()
    with pytest.raises(UserError, match="permissions"):
        read_table(tmp_path / "table.csv")


OTHER_UNITS = {
    "m": ({"length_mm": 1e-3}, "length_mm looks like meters"),
    "cm": ({"length_mm": 0.1}, "length_mm may be in inches or centimeters"),
    "radius in m": ({"outer_radius_mm": 1e-3, "inner_radius_mm": 1e-3}, "outer_radius_mm looks like meters"),
    "radius in inches": ({"outer_radius_mm": 1 / 25.4, "inner_radius_mm": 1 / 25.4}, "it would be 4.77"),
    "elongation in m": ({"elongation_mm": 1e-3}, "in mm it would be 5."),
    "gamma in rad": ({"gamma_deg": 0.0174533}, "gamma_deg looks like radians (largest 0.6981)"),
    "twist in rad": ({"twist_deg": 0.0174533}, "in degrees it would be 120"),
    "Pa": ({"pressure_kpa": 1e3}, "pascals"),
    "psi": ({"pressure_kpa": 1 / 6.894757}, "10 psi = 69 kPa"),
    "bar": ({"pressure_kpa": 0.01}, "in kPa it would be 72.5"),
    "N·m": ({"moment_nmm": 1e-3}, "N·m"),
    "step": ({"step": 0}, "up to 3 pressures"),
}


@pytest.mark.parametrize(("factors", "phrase"), OTHER_UNITS.values(), ids=OTHER_UNITS)
def test_other_unit_is_suspected(tmp_path: Path, factors: dict[str, float], phrase: str) -> None:
    table = valid_table()
    for column, factor in factors.items():
        table[column] *= factor
    # However short the length has become, some must be left.
    table.loc[table["length_mm"] < 10, "elongation_mm"] *= 1e-3
    table.to_csv(tmp_path / "table.csv", index=False)
    warnings = read_table(tmp_path / "table.csv").warnings
    assert any(phrase in warning for warning in warnings), warnings
    assert all(any(column in warning for column in [*factors, "elongation_mm"]) for warning in warnings), warnings


def test_absolute_pressure_is_suspected(tmp_path: Path) -> None:
    table = valid_table()
    table.assign(pressure_kpa=table["pressure_kpa"] + 101.3).to_csv(tmp_path / "table.csv", index=False)
    (warning,) = read_table(tmp_path / "table.csv").warnings
    assert "absolute" in warning


def test_nearly_an_optional_column_is_mentioned(tmp_path: Path) -> None:
    valid_table().assign(times_s=0.0).to_csv(tmp_path / "table.csv", index=False)
    (warning,) = read_table(tmp_path / "table.csv").warnings
    assert "'times_s'" in warning


def test_real_measurements_pass_but_for_a_moment_that_drives_itself_on(shared_data: Path) -> None:
    read = read_table(shared_data / "free70_single" / "measurements.csv")
    assert len(read.table) == 372
    (warning,) = read.warnings
    assert "moment_nmm may have its sign turned" in warning


def test_whole_protocol_is_read_within_two_seconds(tmp_path: Path) -> None:
    table = protocol()
    table["force_n"] = table.index / 7
    table["moment_nmm"] = table.index / 3
    table.to_csv(tmp_path / "table.csv", index=False)
    start = time.perf_counter()
    read = read_table(tmp_path / "table.csv").table
    # Two seconds alone; twice that on a machine whose cores are busy with other tests.
    assert time.perf_counter() - start < 4
    pd.testing.assert_frame_equal(read, table)
