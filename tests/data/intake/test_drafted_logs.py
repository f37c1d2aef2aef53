"""Logs as laboratories write their time down: the draft proposes a time that counts from its beginning and the
recordings, and the log that is read has them."""

import datetime
import io

import numpy as np
import openpyxl
import pandas as pd
import pytest
from test_draft_questions import USUAL, interview

import freelearn as fl
from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.readers.stamps import seconds, seconds_of
from freelearn.data.intake.recipes.recipe_file import recipe_of

# Ten seconds at 20 Hz, which go over midnight.
TIME = np.arange(200) * 0.05
BEGAN = datetime.datetime(2026, 3, 1, 23, 59, 55, 250_000)
STAMPS = [BEGAN + datetime.timedelta(seconds=float(t)) for t in TIME]
SECONDS = 1_772_409_595.25
PRESSURE, FORCE = 60 - 60 * np.cos(0.9 * TIME), -30 * np.cos(0.7 * TIME)


def log(times, name="Time", rows=range(200), separator=",", more=()):
    head = separator.join([*(n for n, _ in more), name, "P [kPa]", "F [N]"])
    cells = ([*(c[i] for _, c in more), times[i], f"{PRESSURE[i]:.9g}", f"{FORCE[i]:.9g}"] for i in rows)
    return "\n".join([head, *(separator.join(map(str, row)) for row in cells), ""])


def read(content, tmp_path, name="raw.csv", answers=()):
    """The log that start's recipe makes of a file, the questions, and the recipe."""
    content = content if isinstance(content, bytes) else content.encode()
    raw = raw_table(content, name)
    given = USUAL | {"held": "0", "slack": "n", "zero": "n", "words": "1"} | dict(answers)
    _, asked, recipe = interview(guess_table(raw), given, raw=raw)
    assert "TODO" not in recipe
    (tmp_path / name).write_bytes(content)
    (tmp_path / "recipe.yaml").write_text(recipe)
    return fl.read_table(tmp_path / name, bed="isometric", recipe=tmp_path / "recipe.yaml"), asked, recipe


def workbook():
    book = openpyxl.Workbook()
    book.active.append(["Time", "P [kPa]", "F [N]"])
    for row in zip(STAMPS, PRESSURE.tolist(), FORCE.tolist(), strict=True):
        book.active.append(row)
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def written(form):
    return [stamp.strftime(form) for stamp in STAMPS]


WRITTEN = {
    "ISO": log(written("%Y-%m-%d %H:%M:%S.%f")),
    "ISO of another name": log(written("%Y-%m-%dT%H:%M:%S.%fZ"), "Aufgenommen"),
    "compact": log(written("%Y%m%dT%H%M%S.%f"), "Timestamp"),
    "German": log(written("%d.%m.%Y %H:%M:%S.%f"), "Zeit", separator=";"),
    "American": log(written("%m/%d/%Y %I:%M:%S.%f %p"), "Date/Time"),
    "British": log(written("%d/%m/%Y %H:%M:%S.%f"), "Date/Time"),
    "MATLAB": log(written("%d-%b-%Y %H:%M:%S.%f"), "datetime"),
    "of day": log(written("%H:%M:%S.%f")),
    "of day with a colon": log([f"{s:%H:%M:%S}:{s.microsecond // 1000:03d}" for s in STAMPS]),
    "a date beside it": log(written("%H:%M:%S.%f"), more=[("Date", written("%Y-%m-%d"))]),
    "epoch": log([f"{SECONDS + t:.3f}" for t in TIME]),
    "epoch in ms": log([round(1e3 * (SECONDS + t)) for t in TIME], "timestamp"),
    "epoch in ns": log([round(SECONDS * 100) * 10_000_000 + round(1e9 * t) for t in TIME], "field.header.stamp"),
    "a spreadsheet's days": log([f"{25_569 + (SECONDS + t) / 86_400:.10f}" for t in TIME]),
    "a workbook's dates": workbook(),
}


@pytest.mark.parametrize("form", WRITTEN)
def test_a_time_of_any_form_counts_from_its_beginning(form, tmp_path):
    name = "raw.xlsx" if form.startswith("a workbook") else "raw.csv"
    table, asked, recipe = read(WRITTEN[form], tmp_path, name)
    np.testing.assert_allclose(table["time_s"], 0.25 + TIME, atol=2e-5)
    np.testing.assert_allclose(table["force_n"], FORCE, rtol=1e-8)
    assert table["run"].astype(str).tolist() == ["1"] * 200
    assert "run" in asked
    assert not [key for key in asked if key.startswith(("unit", "what"))]
    # What was taken for granted stands in the recipe of an untouched draft, too.
    assert "counts from" in draft(guess_table(raw_table(
        WRITTEN[form] if isinstance(WRITTEN[form], bytes) else WRITTEN[form].encode(), name
    )))  # fmt: skip
    assert "run: derive" in recipe


def test_stamps_that_leave_something_open_are_none():
    assert seconds_of("2/3/2026 10:00:00") is None
    assert seconds_of("02:30") is None, "minutes, or hours?"
    assert seconds_of("10:00:05:12") is None, "a frame of a film, or hundredths?"
    # Of the day and the month the reading that lies closer together is taken.
    values, bad = seconds(["2/3/2026 10:00:00", "2/3/2026 10:00:01", "3/3/2026 10:00:00"])
    assert not bad
    np.testing.assert_allclose(np.diff(values), [1, 86_399])
    np.testing.assert_allclose(np.diff(seconds(["23:59:59", "", "00:00:01"])[0]), [np.nan, np.nan])
    np.testing.assert_allclose(np.ptp(seconds(["23:59:59", "00:00:01"])[0]), 2)


def three(times):
    """Three recordings after each other, of 60, 80 and 60 rows."""
    return [*times[:60], *times[:80], *times[:60]]


RUNS = [1] * 60 + [2] * 80 + [3] * 60


def test_recordings_that_follow_each_other_begin_where_the_time_does(tmp_path):
    content = log([f"{t:.2f}" for t in three(TIME)], "t [s]")
    table, asked, _ = read(content, tmp_path)
    assert table["run"].astype(int).tolist() == RUNS
    np.testing.assert_allclose(table["time_s"], three(TIME), atol=1e-9)
    assert "run" in asked
    told = convert(recipe_of((tmp_path / "recipe.yaml").read_text(), "r"), {"raw.csv": content.encode()}).warnings
    assert any("begins anew, or jumps, at lines 62, 142: 3 recordings" in sentence for sentence in told)


def test_a_clock_that_goes_on_after_a_long_break_begins_a_recording(tmp_path):
    times = [f"{t + (4_000 if i >= 60 else 0):.2f}" for i, t in enumerate(TIME)]
    table, *_ = read(log(times, "t [s]"), tmp_path)
    assert table["run"].astype(int).tolist() == [1] * 60 + [2] * 140


@pytest.mark.parametrize("column", ["test", "Versuch", "run_no", "Recording"])
def test_a_column_that_names_recordings_is_taken_for_it(column, tmp_path):
    names = ["slow"] * 60 + ["fast"] * 80 + ["held"] * 60
    content = log([f"{t:.2f}" for t in three(TIME)], "t [s]", more=[(column, names)])
    table, asked, recipe = read(content, tmp_path, answers={"sample": "1"})
    assert table["run"].tolist() == names
    assert table["sample"].unique().tolist() == [1]
    assert f"run: {{from: {column}}}" in recipe
    # Words may as well name actuators: that is asked.
    assert {"run", "sample"} <= set(asked)


def test_a_column_of_recordings_that_stands_in_one_channel_alone_names_the_rows(tmp_path):
    """The rig's log says which test it is; the load cell's, whose rows the table has, does not."""
    names = ["a"] * 60 + ["b"] * 80 + ["c"] * 60
    rig = pd.DataFrame({"t": TIME, "P": PRESSURE, "test": names})
    cell = pd.DataFrame({"t2": TIME[:-1] + 0.02, "F": FORCE[:-1]})
    recipe = (
        "bed: isometric\nconstants: {gamma_deg: 20, length_mm: 90, inner_radius_mm: 5, outer_radius_mm: 6, "
        "elongation_mm: 0, twist_deg: 0}\ncolumns: {time_s: {from: t2, unit: s}, force_n: {from: F, unit: N}}\n"
        "join: [{file: rig.csv, time: {from: t, unit: s}, columns: {pressure_kpa: {from: P, unit: kPa}}}]\n"
        "run: {from: test}\n"
    )
    for name, frame in (("rig.csv", rig), ("cell.csv", cell)):
        frame.to_csv(tmp_path / name, index=False)
    (tmp_path / "recipe.yaml").write_text(recipe)
    table = fl.read_table(tmp_path / "cell.csv", bed="isometric", recipe=tmp_path / "recipe.yaml")
    assert table["run"].tolist() == names[:-1]


def test_readings_at_rest_that_have_a_time_are_no_log(tmp_path):
    rows = [(60.0 * i, x, p, 3 - p) for i, (x, p) in enumerate((x, p) for x in range(9) for p in range(0, 280, 40))]
    content = "\n".join(["t [s],dl [mm],P [kPa],F [N]", *(",".join(map(str, row)) for row in rows), ""])
    table, asked, recipe = read(content, tmp_path)
    assert "run" in asked
    assert "run:" not in recipe
    assert "run" not in table
    assert table["time_s"].tolist() == [row[0] for row in rows]
    made, _, _ = read(content, tmp_path, answers={"run": "1"})
    assert set(made["run"].astype(int)) == {1}


HEAD = """\
bed: isometric
constants: {gamma_deg: 20, length_mm: 90, inner_radius_mm: 5, outer_radius_mm: 6, elongation_mm: 0, twist_deg: 0}
columns:
  time_s: {from: t, unit: s}
  pressure_kpa: {from: P, unit: kPa}
  force_n: {from: F, unit: N}
"""


@pytest.mark.parametrize(
    ("more", "changed", "says"),
    [
        ("run: derive\nplateaus: {of: {pressure_kpa: 1}}\n", None, "plateaus averages them: keep one"),
        ("run: derive\ncarry: [run]\n", None, "carry keeps the column run"),
        ("run: derived\n", None, "did you mean derive"),
        ("run: {form: test}\n", None, "run has no key form|names no column"),
        ("run: {from: tset}\n", None, "has no column 'tset': did you mean 'test'"),
        ("run: derive\n", ("t", 7, ""), "raw.csv, line 9: time_s is blank"),
        ("run: {from: test}\n", ("test", 7, ""), "raw.csv, line 9: run is blank"),
        ("run: derive\n", ("t", 7, "0.01"), "has 7 rows, too few"),
    ],
)  # fmt: skip
def test_what_makes_no_log_says_so(more, changed, says, tmp_path):
    frame = pd.DataFrame({"t": TIME, "P": PRESSURE, "F": FORCE, "test": "a"}).astype(str)
    if changed:
        frame.loc[changed[1], changed[0]] = changed[2]
    frame.to_csv(tmp_path / "raw.csv", index=False)
    (tmp_path / "recipe.yaml").write_text(HEAD + more)
    with pytest.raises(UserError, match=says):
        fl.read_table(tmp_path / "raw.csv", bed="isometric", recipe=tmp_path / "recipe.yaml")


def test_run_without_a_time_says_so():
    text = HEAD.replace("  time_s: {from: t, unit: s}\n", "") + "run: derive\n"
    with pytest.raises(UserError, match="needs the time of its rows: add time_s"):
        recipe_of(text, "recipe.yaml")
