"""What is wrong with a log is said with its line and the cure; a table that is none is not looked at."""

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.common.errors import UserError
from freelearn.data.logs import pieces
from freelearn.data.sets import split_rows
from freelearn.data.states import States, log_direction
from freelearn.testing.small_tables import recordings


def log(**changes):
    return recordings().assign(buckled=0, force_n=1.0, moment_nmm=2.0, **changes)


def wrong(table, tmp_path):
    path = tmp_path / "log.csv"
    table.to_csv(path, index=False)
    with pytest.raises(UserError) as problem:
        fl.read_table(path)
    lines = str(problem.value).splitlines()
    assert len(lines) == 2
    return lines[1]


def test_a_whole_log_is_read_and_its_rows_know_their_recordings(tmp_path):
    path = tmp_path / "log.csv"
    log().to_csv(path, index=False)
    states = States.from_table(fl.read_table(path))
    assert states.recording is not None
    assert states.recording.run.bincount().tolist() == [14, 11, 14, 11]
    assert States.from_table(log().drop(columns="run")).recording is None


def test_time_that_runs_backwards(tmp_path):
    table = log()
    table.loc[[5, 6], "time_s"] = table.loc[[6, 5], "time_s"].to_numpy()
    said = wrong(table, tmp_path)
    assert said.startswith("  line 8, time_s: ")
    assert "runs backwards in run 1" in said
    assert "give what follows another run" in said


def test_a_stamp_that_stands_there_twice(tmp_path):
    table = log()
    table.loc[4, "time_s"] = table.loc[3, "time_s"]
    said = wrong(table, tmp_path)
    assert said.startswith("  line 6, time_s: ")
    assert "stands there twice" in said
    assert "keep one row of each" in said


def test_a_clock_that_jumps(tmp_path):
    table = log()
    table.loc[20:24, "time_s"] += 1e6
    said = wrong(table, tmp_path)
    assert said.startswith("  line 22, time_s: ")
    assert "jumps by 1e+06 s in run 2" in said
    assert "correct the clock" in said


def test_a_recording_of_three_samples(tmp_path):
    table = log()
    said = wrong(table.drop(index=range(17, 25)), tmp_path)
    assert said.startswith("  line 16, run: ")
    assert "has 3 rows, too few" in said


def test_a_recording_in_two_places(tmp_path):
    table = log()
    said = wrong(pd.concat([table, table[:14].assign(time_s=table["time_s"][:14] + 100)]), tmp_path)
    assert said.startswith("  line 52, run: ")
    assert "put each recording's rows together" in said


def test_gaps_and_lost_readings_are_no_faults(tmp_path):
    table = log()
    table.loc[[3, 4, 30], "force_n"] = np.nan
    table = table.drop(index=[7, 8])
    path = tmp_path / "log.csv"
    table.to_csv(path, index=False)
    assert int(fl.read_table(path)["force_n"].isna().sum()) == 3


def test_whole_recordings_are_held_out_and_of_few_blocks_of_time():
    many = pd.concat([log().assign(run=f"{run}") for run in range(3)], ignore_index=True)
    many["run"] = many["run"] + (many["time_s"].diff().fillna(0) < 0).cumsum().astype(str)
    label = split_rows(many, 0, by_states=False)
    assert set(label) == {"train", "validation", "test"}
    keys = many["sample"].astype(str) + many["run"]
    assert (pd.Series(label).groupby(keys).nunique() == 1).all()
    few = log()
    assert len(np.unique(pieces(few))) == 40
    label, piece = split_rows(few, 0, by_states=False), pieces(few)
    assert (pd.Series(label).groupby(piece).nunique() == 1).all()


def test_the_direction_of_a_noisy_pressure_is_that_of_its_branch():
    time = np.linspace(0, 10, 400)
    pressure = 50 - 50 * np.cos(2 * np.pi * time / 10) + np.random.default_rng(0).normal(0, 0.05, 400)
    direction = log_direction(pressure, np.zeros(400, dtype=int))
    assert (direction[40:190] == 1).all()
    assert (direction[220:390] == -1).all()
