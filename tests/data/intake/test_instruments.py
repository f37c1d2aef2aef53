"""Files as instruments and their programs write them: each becomes the table that it says, or one question is asked."""

import datetime

import numpy as np
import openpyxl
import pytest
from test_draft_questions import USUAL, interview
from test_messy import write

from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.joined import guess_and_table
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.recipes.recipe_file import recipe_of

# Fifteen seconds at 20 Hz [s, kPa, N, mm, N·mm].
TIME = np.arange(300) * 0.05
TRUE = {
    "time_s": TIME, "pressure_kpa": 60 - 60 * np.cos(0.9 * TIME), "force_n": -30 * np.cos(0.7 * TIME),
    "elongation_mm": 4 * np.sin(0.4 * TIME), "moment_nmm": 5 * np.sin(0.7 * TIME),
}  # fmt: skip
T, P, F, X, M = TRUE.values()
BEGAN = datetime.datetime(2026, 3, 1, 12, 0, 3)


def rows(*columns, separator="\t", decimal=".", form="{:.7f}"):
    cells = (
        [v if isinstance(v, str) else form.format(v).replace(".", decimal) for v in row]
        for row in zip(*columns, strict=True)
    )
    return "\n".join(separator.join(row) for row in cells) + "\n"


def segment(first, last):
    """One of LabVIEW's, whose times begin at 0."""
    head = (
        "Channels\t2\t\t\t\nSamples\t100\t100\t\t\nY_Unit_Label\tkPa\tN\t\t\nX_Dimension\tTime\tTime\t\t\n"
        "X0\t0.0E+0\t0.0E+0\t\t\nDelta_X\t0.05\t0.05\t\t\n***End_of_Header***\t\t\t\nX_Value\tPressure\tForce\tComment\n"
    )
    own = slice(first, last)
    return head + rows(T[own] - T[first], P[own], F[own], [""] * (last - first)) + "\n"


LABVIEW = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDate\t2026/03/01\n***End_of_Header***\t\n\t\n"
OPTITRACK = (
    "Format Version,1.23,Capture Frame Rate,20.000000,Rotation Type,XYZ,Length Units,Meters\n\n,,Rigid Body,Rigid Body,"
    "Rigid Body,Rigid Body\n,,top,top,top,top\n,,\"2\",\"2\",\"2\",\"2\"\n,,Rotation,Position,Position,Position\n"
    "Frame,Time (Seconds),Y,X,Y,Z\n"
)  # fmt: skip
ZWICK = (
    '"Prüfprotokoll";"testXpert"\n"Probe";"Muskel 7"\n"Länge unbelastet";"150";"mm"\n\n'
    '"Prüfzeit";"Standardweg";"Standardkraft";"Druck"\n"s";"mm";"N";"bar"\n'
)
INSTRON = (
    '"Specimen label","M1"\n"Date","3/1/2026"\n\n"Results Table 1"\n"Time","Extension","Load","Pressure"\n'
    '"(s)","(mm)","(N)","(MPa)"\n'
)
STAMPS = [BEGAN + datetime.timedelta(seconds=float(t)) for t in T]


def merged(path):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet["A1"], sheet["A2"], sheet["C2"] = "Messreihe 12: Muskel DMSP", "Rig", "Load cell"
    for area in ("A1:D1", "A2:B2", "C2:D2"):
        sheet.merge_cells(area)
    for row in (("Time", "Pressure", "Force", "Moment"), ("s", "bar", "N", "Nm")):
        sheet.append(row)
    for row in zip(T.tolist(), (P / 100).tolist(), F.tolist(), (M / 1000).tolist(), strict=True):
        sheet.append(row)
    book.save(path)
    return path.read_bytes()


def repeated():
    lines = rows(T, P, F).splitlines()
    head = "Time (s)\tP (kPa)\tF (N)"
    lines[50] = lines[50].rsplit("\t", 1)[0] + "\tNaN"
    return "\n".join([head, *lines[:100], head, *lines[100:200], head, *lines[200:], ""])


def sparse():
    """Topics of a robot's recording, each with rows of its own."""
    own = [
        f"{1772366403.5 + t:.6f},{p:.7f},\n{1772366403.513 + t:.6f},,{f:.7f}" for t, p, f in zip(T, P, F, strict=True)
    ]
    return "\n".join(["__time,/pressure/data,/wrench/force/z", *own, ""])


UNITS = {"unit./pressure/data": "kPa", "unit./wrench/force/z": "N"}
READ, SET = "pressure_kpa force_n", "elongation_mm pressure_kpa force_n"
CATMAN = (
    "HBM_CATMAN_DATAFILE_40\n\nNO_OF_CHANNELS=3\nSTART_DATE=01.03.26\nSTART_TIME=12:00:03\n\n"
    "Time  1 - default sample rate [s]\tpressure_sensor [bar]\tU9C_50N [N]\n"
)
WHOLE = segment(0, 300).replace("Samples\t100", "Samples\t300")
TIMELESS = "\n".join("\t" + row.split("\t", 1)[1] if row[:1].isdigit() else row for row in WHOLE.split("\n"))
NANOSECONDS = [str(1772366403000000000 + round(1e9 * t)) for t in T]
OF_DAY = [f"{s:%H:%M:%S},{s.microsecond // 1000:03d}" for s in STAMPS]
SECONDS = [f"{s:%Y-%m-%d %H:%M:%S}" for s in STAMPS]
GAINS = {"scale.P [V]": "25", "offset.P [V]": "0.5", "scale.F [mV]": "10", "offset.F [mV]": "0"}
SMALL = rows(1e3 * T, 1e3 * X, 10 * P, 1e3 * F, separator=";", decimal=",")
ABSOLUTE = rows(T, P / 6.894757293 + 14.695949, F / 1000, separator=",", form="{:.10f}")
# Name → content, answers besides the usual ones, and the columns of the table that it has.
FILES = {
    "labview.lvm": (LABVIEW + WHOLE, {}, READ),
    "no times.lvm": (LABVIEW + TIMELESS, {}, READ),
    "zwick.csv": ((ZWICK + rows(T, X, F, P / 100, separator=";", decimal=",")).encode("cp1252"), {"bed": "1"}, SET),
    "instron.csv": (INSTRON + rows(T, X, F, P / 1000, separator=",", form='"{:.9f}"'), {"bed": "1"}, SET),
    "daq.txt": (repeated(), {}, "pressure_kpa"),
    "catman.asc": (CATMAN + rows(T, P / 100, F), {}, READ),
    "ros.csv": ("%time,field.pressure_kPa,field.force_N\n" + rows(NANOSECONDS, P, F, separator=","), {}, READ),
    "marks and units.csv": ("\ufeffZeit [ms];Weg [µm];Druck [mbar];Kraft [mN]\r\n" + SMALL, {"bed": "1"}, SET),
    "stamps with commas.txt": ("Zeit\tDruck [bar]\tKraft [N]\n" + rows(OF_DAY, P / 100, F, decimal=","), {}, READ),
    "whole seconds.csv": ("Timestamp,P [kPa],F [N]\n" + rows(SECONDS, P, F, separator=","), {"even": "y"}, READ),
    "volts.csv": ("t [s],P [V],F [mV]\n" + rows(T, 0.5 + P / 25, F / 10, separator=","), GAINS, READ),
    "absolute.csv": ("t [s],P [psia],F [kN]\n" + ABSOLUTE, {"absolute": ""}, READ),
    "fixed.dat": ("   Time   Press  Force\n   [s]   [kPa]    [N]\n" + rows(T, P, F, separator="  "), {}, READ),
    "merged.xlsx": (merged, {}, "pressure_kpa force_n moment_nmm"),
}


@pytest.mark.parametrize("name", FILES)
def test_what_an_instrument_wrote_becomes_its_table(name, tmp_path):
    content, answers, has = FILES[name]
    content = content(tmp_path / name) if callable(content) else content
    path = write(tmp_path / name, content)
    found, joined, raw = guess_and_table(path)
    _, asked, recipe = interview(found, USUAL | {"held": "0", "words": "2"} | answers, joined, raw)
    assert "TODO" not in recipe
    table = convert(recipe_of(recipe, name), {name: path.read_bytes()}).table
    for column in ("time_s", *has.split()):
        np.testing.assert_allclose(table[column], TRUE[column], atol=2e-5, err_msg=column)
    assert set(table["run"]) == {1}
    # Nothing is asked that the file says.
    assert {key.split(".")[0] for key in asked} - {*answers, "scale", "offset"} <= {
        *("run", "bed", "design", "braid", "held", "sign", "zero", "slack", "absolute", "rest", "levels"),
    }  # fmt: skip


def test_segments_of_labview_are_recordings_and_their_headers_no_rows():
    content = (LABVIEW + segment(0, 100) + segment(100, 200) + segment(200, 300)).encode()
    raw = raw_table(content, "three.lvm")
    assert len(raw) == 300
    assert raw.lines[100] == raw.lines[99] + 10, "lines are those of the file"
    _, _, recipe = interview(guess_table(raw), USUAL | {"held": "0"}, raw=raw)
    made = convert(recipe_of(recipe, "r"), {"three.lvm": content})
    assert made.table["run"].tolist() == [1] * 100 + [2] * 100 + [3] * 100
    np.testing.assert_allclose(made.table["force_n"], F, atol=1e-6)
    np.testing.assert_allclose(made.table["time_s"], np.tile(T[:100], 3), atol=1e-6)


def test_numbers_of_markers_above_the_header_are_no_rows():
    content = OPTITRACK + rows([str(i) for i in range(300)], T, M, X / 1e3, 0 * T, 0 * T, separator=",")
    raw = raw_table(content.encode(), "take.csv")
    assert list(raw.columns) == ["Frame", "Time (Seconds)", "Rotation Y", "X", "Position Y", "Z"]
    np.testing.assert_allclose(raw.numbers("Rotation Y"), M, atol=1e-6)
    assert raw.lines[0] == 8
    # A header that stands there again later is passed over, and what is above it is kept.
    head, first = "t [s],P [kPa],F [N]\n", rows(T[:2], P[:2], F[:2], separator=",")
    again = raw_table((head + first + head + rows(T[2:], P[2:], F[2:], separator=",")).encode(), "again.csv")
    assert len(again) == 300


def test_a_channel_of_rows_of_its_own_is_read_between_them():
    content = sparse().encode()
    raw = raw_table(content, "bag.csv")
    _, asked, recipe = interview(guess_table(raw), USUAL | {"held": "0"} | UNITS, raw=raw)
    assert "gaps./pressure/data" in asked
    made = convert(recipe_of(recipe, "r"), {"bag.csv": content}).table
    np.testing.assert_allclose(made["time_s"], 0.513 + T[:-1], atol=1e-5)
    np.testing.assert_allclose(made["force_n"], F[:-1], atol=1e-6)
    # A straight line over 50 ms, against the curve itself: the bend of 48.6 kPa/s² times 25 ms squared, over two.
    np.testing.assert_allclose(made["pressure_kpa"], 60 - 60 * np.cos(0.9 * (T[:-1] + 0.013)), atol=0.016)


def test_a_header_in_the_middle_of_a_file_is_no_reading():
    """A program that was started again: the words stand in a column that nobody uses."""
    lines = rows([f"{i}" for i in range(300)], T, P, F, separator=",").splitlines()
    content = "\n".join(["n,t [s],P [kPa],F [N]", *lines[:150], "Samples,100,100,7", *lines[150:], ""]).encode()
    raw = raw_table(content, "a.csv")
    _, asked, recipe = interview(guess_table(raw), USUAL | {"held": "0", "beside": "n"}, raw=raw)
    assert "beside.n" in asked
    np.testing.assert_allclose(convert(recipe_of(recipe, "r"), {"a.csv": content}).table["force_n"], F, atol=1e-6)
    assert len(convert(recipe_of(recipe.replace("drop: [", "about: x #"), "r"), {"a.csv": content}).table) == 301


@pytest.mark.parametrize("times", [np.repeat([0.0, 1, 5, 6, 20, 21], 10), np.full(60, 3.0)])
def test_a_time_that_no_even_rows_round_to_is_not_spread(times, tmp_path):
    content = ("t [s],P [kPa],F [N]\n" + rows(times, P[:60], F[:60], separator=",")).encode()
    raw = raw_table(content, "a.csv")
    assert "even" not in interview(guess_table(raw), USUAL | {"held": "0", "rest": "no"}, raw=raw)[1]
    recipe = (
        "bed: isometric\nconstants: {gamma_deg: 20, length_mm: 90, inner_radius_mm: 5, outer_radius_mm: 6, "
        "elongation_mm: 0, twist_deg: 0}\ncolumns:\n  time_s: {from: 't [s]', unit: s, even: true}\n"
        "  pressure_kpa: {from: 'P [kPa]', unit: kPa}\n  force_n: {from: 'F [N]', unit: N}\n"
    )
    with pytest.raises(UserError, match="no rounded time of rows that were taken evenly"):
        convert(recipe_of(recipe, "r"), {"a.csv": content})
    with pytest.raises(UserError, match="even is for a time alone"):
        recipe_of(recipe.replace("unit: kPa", "unit: kPa, even: true"), "r")
