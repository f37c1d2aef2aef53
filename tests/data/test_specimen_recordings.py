"""Recordings in tables of specimen tests: read, named, thinned where they are long, refused in a sentence."""

import numpy as np
import pandas as pd
import pytest

from freelearn.common.errors import UserError
from freelearn.data.specimen_table import read_specimens
from freelearn.data.specimen_tests import MOST, names_of

RAMP = [(t / 2, 1 + t / 10, t / 50) for t in range(10)]


@pytest.fixture
def file(tmp_path):
    def write(rows: list[tuple[object, ...]], name: str = "pull.csv", header: str = "time_s,stretch,stress_mpa") -> str:
        path = tmp_path / name
        path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
        return str(path)

    return write


def test_a_test_with_a_time_is_named_after_its_file_or_its_specimen(file):
    one = file(RAMP, "slow.csv")
    two = file([("SS", "b", t, x - 1, p) for t, x, p in RAMP], "t.csv", "mode,specimen,time_s,shear,stress_mpa")
    shear = file([(x, 0.1 * x) for x in (0.5, 1.0)], "still.csv", "stretch,stress_mpa")
    data = read_specimens([f"UT={one}", two, f"PS={shear}"])
    assert list(dict.fromkeys(names_of(data.table))) == ["slow", "b", "pure_shear"]
    assert data.table["time_s"].notna().sum() == 2 * len(RAMP)


def test_one_specimen_pulled_and_sheared_is_two_tests(file):
    rows = [("UT", "a", *row) for row in RAMP] + [("PS", "a", *row) for row in RAMP]
    data = read_specimens([file(rows, header="mode,specimen,time_s,stretch,stress_mpa")])
    assert list(dict.fromkeys(names_of(data.table))) == ["uniaxial a", "pure_shear a"]


def test_an_amount_of_shear_becomes_the_principal_stretch(file):
    data = read_specimens(["SS=" + file([(t, t / 4, t / 10) for t in range(9)], header="time_s,shear,stress_mpa")])
    stretch = data.table["stretch"].to_numpy()
    # The eigenvalues of C = [[1, γ], [γ, 1 + γ²]] are those of λ², by NumPy.
    for amount, found in zip(np.arange(9) / 4, stretch, strict=True):
        assert found**2 == pytest.approx(np.linalg.eigvalsh([[1, amount], [amount, 1 + amount**2]])[-1])
    assert (data.table["stretch_2"] == 1).all()


def test_a_long_recording_keeps_what_it_shows(file):
    # A ramp of 2 s and a hold of an hour at 10 Hz.
    time = np.arange(0, 3600, 0.1)
    stretch = 1 + np.minimum(time, 2) / 2
    data = read_specimens(["UT=" + file(list(zip(time, stretch, stretch - 1, strict=True)))])
    kept = data.table
    assert len(kept) <= MOST + 5
    assert "36000 samples are thinned" in data.warnings[0]
    assert kept["time_s"].iloc[[0, -1]].tolist() == [0.0, time[-1]]
    assert (kept["time_s"] <= 2).sum() >= 15
    # As many in the first seconds of the hold as in its last half hour.
    held = kept["time_s"] - 2
    assert ((held > 0) & (held < 10)).sum() > (held > 1800).sum()
    # What was between the samples that are kept is a straight line.
    np.testing.assert_allclose(np.interp(time, kept["time_s"], kept["stretch"]), stretch, atol=1e-9)


def test_stresses_may_be_blank_in_a_recording(file):
    rows = [*RAMP[:5], *((t, x, "") for t, x, _ in RAMP[5:])]
    assert read_specimens(["UT=" + file(rows)]).table["stress_mpa"].notna().sum() == 5


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([*RAMP, RAMP[3]], "line 12, time_s: '1.5' is earlier than the row before: keep the rows in the order of time"),
        ([*RAMP, RAMP[-1]], "line 12, time_s: '4.5' stands twice: delete one of the two lines"),
        (RAMP[:3], "Recording pull has 3 samples, and a fit over time needs 8: record faster"),
        (
            [(t, x + 1, p) for t, x, p in RAMP],
            "Recording pull begins at a stretch of 2, .*: keep the rows from rest on",
        ),
        ([*RAMP, ("", 2.0, 0.3)], "line 12, time_s: is blank, and other rows of its specimen have a time"),
        ([*RAMP, ("x", 2.0, 0.3)], "line 12, time_s: 'x' is not a number"),
        ([(t, x, "") for t, x, _ in RAMP], "Every stress in mode uniaxial is zero|holds no stress"),
    ],
)
def test_what_is_no_recording_is_refused(file, rows, words):
    with pytest.raises(UserError, match=words):
        read_specimens(["UT=" + file(rows)])


def test_recordings_of_one_name_in_two_files_are_refused(file):
    rows = [("a", *row) for row in RAMP]
    header = "specimen,time_s,stretch,stress_mpa"
    with pytest.raises(UserError, match="Recording a stands in two files: name the specimens"):
        read_specimens(["UT=" + file(rows, "one.csv", header), "UT=" + file(rows, "two.csv", header)])


def test_shear_belongs_to_simple_shear_alone(file):
    rows = [("UT", *row) for row in RAMP]
    with pytest.raises(UserError, match="is given an amount of shear: only simple_shear has one"):
        read_specimens([file(rows, header="mode,time_s,shear,stress_mpa")])
    with pytest.raises(UserError, match="belongs to no sheared sheet"):
        read_specimens(["SS=" + file([(1.0, 0.1, 0.2)], header="shear,stress_mpa,stress_2_mpa")])


def test_a_table_without_times_has_no_column_of_them(file):
    data = read_specimens(["UT=" + file([(1.1, 0.1)], header="stretch,stress_mpa")])
    assert "time_s" not in data.table
    pd.testing.assert_series_equal(data.table["stretch_2"], pd.Series([1.1**-0.5], name="stretch_2"))
