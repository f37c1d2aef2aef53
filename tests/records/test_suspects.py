"""Suspected readings by line, in the user's units, and the files about them."""

import hashlib

import numpy as np
import pandas as pd
import pytest

from freelearn.discovery.residuals.suspects import Suspect
from freelearn.records.provenance import Provenance
from freelearn.records.suspected_readings import (
    SuspectedReading,
    flagged,
    suspected_readings,
    worst_of_each,
    write_suspects,
)

TEXT = "sample,step,elongation_mm,twist_deg,pressure_kpa,force_n\n" + "".join(
    f"3,{n},1.0,-20,{10 * n}.00,{n}.50\n" for n in range(6)
)


@pytest.fixture
def table():
    return pd.DataFrame(
        {
            "sample": 3,
            "step": np.arange(6),
            "elongation_mm": 1.0,
            "twist_deg": -20.0,
            "pressure_kpa": 10.0 * np.arange(6),
        }
    )


LINES = np.array([2, 3, 5, 6, 7, 8])


def read(table, *suspects):
    return suspected_readings(suspects, table, LINES)


@pytest.mark.parametrize(
    ("shown", "expected", "sigmas", "words"),
    [
        (3.2, 45.1, -419.6, "+3.2 N where +45.1 N was expected (−420 σ)"),
        (-12.0, -12.31, 7.25, "−12.000 N where −12.310 N was expected (+7.2 σ)"),
        (45123.0, 45.1, 1e6, "+45123 N where +45 N was expected (+1000000 σ)"),
        (0.0, 0.0, 0.0, "+0.000 N where +0.000 N was expected (+0.0 σ)"),
    ],
)
def test_a_sentence_shows_the_difference(table, shown, expected, sigmas, words):
    (reading,) = read(table, Suspect(2, "force", shown, expected, sigmas, "", (2,)))
    assert reading.sentence() == f"line 5: the force shows {words}"


def test_the_moment_is_told_in_newton_millimeters_and_rows_by_their_lines(table):
    (reading,) = read(table, Suspect(2, "moment", 0.5, -0.5, 30.0, "the reading of the row before", (), 1))
    assert (reading.unit, reading.lines) == ("N·mm", (5,))
    assert "shows +500 N·mm where −500 N·mm" in reading.sentence()
    assert reading.sentence().endswith(": the reading of the row before, perhaps line 3's")


def test_what_slipped_together_is_told_once(table):
    block = [Suspect(n, "force", 1.0, 2.0, -10.0 - n, "a block with another scale", (2, 3, 4)) for n in (2, 3, 4)]
    readings = read(table, *block, Suspect(0, "force", 1.0, 3.0, -12.5, "", (0,)))
    assert [reading.line for reading in readings] == [7, 6, 2, 5]
    told = worst_of_each(readings)
    assert [reading.lines for reading in told] == [(5, 6, 7), (2,)]
    assert told[0].sentence() == (
        "lines 5–7: the force shows +1.00 N where +2.00 N was expected in line 7 (−14 σ): a block with another scale"
    )
    assert SuspectedReading.from_plain(told[0].plain()) == told[0]


def test_flags_say_which_load_and_leave_the_row_out_but_no_block(table):
    block = Suspect(3, "moment", 0, 0, 9, "", (3, 4))
    marks = flagged(table, [Suspect(1, "force", 0, 0, 9, "", (1,)), Suspect(4, "moment", 0, 0, 9, "", (4,)), block])
    assert np.flatnonzero(marks["suspect_force"]).tolist() == [1]
    assert np.flatnonzero(marks["suspect_moment"]).tolist() == [4]
    assert np.flatnonzero(marks["left_out"]).tolist() == [1, 4]


def test_marks_are_for_the_file_that_was_searched(table, tmp_path):
    readings = read(table, Suspect(2, "force", 1.0, 2.0, -10.0, "", (2,)))
    path, out = tmp_path / "mine.csv", tmp_path / "out"
    out.mkdir()
    path.write_text(TEXT)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    mine = Provenance("csv", False, path=str(path), sha256=digest)
    write_suspects(readings, mine, out)
    lines = (out / "marked.csv").read_text().splitlines()
    assert [n for n, line in enumerate(lines, 1) if line.endswith(",1")] == [5]
    # Not of a table that is simulated, has changed or is gone, nor where nothing is suspected.
    others = [
        (readings, Provenance("virtual", True, seed=0)),
        (readings, Provenance("csv", False, path=str(path), sha256="0" * 64)),
        (readings, Provenance("csv", False, path=str(tmp_path / "gone.csv"), sha256=digest)),
        ([], mine),
    ]
    for suspected, provenance in others:
        write_suspects(readings, mine, out)
        write_suspects(suspected, provenance, out)
        assert [file.name for file in out.iterdir()] == ["suspects.csv"]
        assert len(pd.read_csv(out / "suspects.csv")) == len(suspected)


def test_a_marked_table_that_is_searched_in_its_own_folder_stays(table, tmp_path):
    path = tmp_path / "marked.csv"
    path.write_text(TEXT)
    searched = Provenance("csv", False, path=str(path), sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    for readings in ([], read(table, Suspect(2, "force", 1.0, 2.0, -10.0, "", (2,)))):
        write_suspects(readings, searched, tmp_path)
        assert path.read_text() == TEXT
