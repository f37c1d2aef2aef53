"""What is wrong with a log is said with its line and the cure; a table that is none is not looked at."""

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.api.tasks.intake_task import taken_in
from freelearn.common.errors import UserError
from freelearn.data.logs import pieces
from freelearn.data.sets import split_rows
from freelearn.data.states import States, last_direction
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


def test_recordings_in_which_nothing_was_read_are_told_and_stay(tmp_path):
    table = log()
    table.loc[14:24, ["force_n", "moment_nmm"]] = np.nan
    path = tmp_path / "log.csv"
    table.to_csv(path, index=False)
    read = fl.read_table(path)
    (said,) = [warning for warning in read.attrs["warnings"] if "no reading" in warning]
    assert said.startswith("run 2 (11 rows from line 16) has no reading in any row: nothing is fitted or scored by it")
    assert len(read) == len(table)
    table.loc[39:, ["force_n", "moment_nmm"]] = np.nan
    table.to_csv(path, index=False)
    assert any(
        "has no reading in any row, nor in 1 more" in warning for warning in fl.read_table(path).attrs["warnings"]
    )
    # One reading is one, and rows that are left out anyway are no loss.
    table.loc[[20, 45], "force_n"] = 1.0
    table.to_csv(path, index=False)
    assert not any("no reading" in warning for warning in fl.read_table(path).attrs["warnings"])
    log().assign(left_out=(table["sample"] == 3) * 1).to_csv(path, index=False)
    assert not any("no reading" in warning for warning in fl.read_table(path).attrs["warnings"])


def backwards(table):
    table.loc[[5, 6], "time_s"] = table.loc[[6, 5], "time_s"].to_numpy()
    return table, 8, "runs backwards in run 1"


def twice(table):
    table.loc[4, "time_s"] = table.loc[3, "time_s"]
    return table, 6, "stands there twice in run 1"


def jumps(table):
    table.loc[20:24, "time_s"] += 1e6
    return table, 22, "jumps by 1e+06 s in run 2"


def three(table):
    return table.drop(index=range(17, 25)), 16, "has 3 rows, too few"


@pytest.mark.parametrize("damage", [backwards, twice, jumps, three])
def test_intake_a_fit_and_a_search_say_the_same(damage, tmp_path):
    """In intake's sentence the line is that of the raw file."""
    table, line, told = damage(log())
    raw, recipe = tmp_path / "raw.csv", tmp_path / "recipe.yaml"
    table.rename(columns={"pressure_kpa": "gauge", "time_s": "clock"}).to_csv(raw, index=False)
    same = ["gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]
    same += ["elongation_mm", "twist_deg", "force_n", "moment_nmm"]
    columns = "".join(f"  {name}: {{from: {name}, unit: {name.split('_')[-1]}}}\n" for name in same)
    recipe.write_text(
        f"bed: kinematic\nsample: {{from: sample}}\ncolumns:\n{columns}"
        "  pressure_kpa: {from: gauge, unit: kPa}\n  time_s: {from: clock, unit: s}\nstep: each_row\ncarry: [run]\n"
    )
    with pytest.raises(UserError) as taken:
        taken_in(raw, recipe, tmp_path / "table.csv")
    assert f"raw.csv line {line}, " in str(taken.value)
    assert told in str(taken.value)
    assert not (tmp_path / "table.csv").exists()
    for way in (fl.fit, fl.discover):
        with pytest.raises(UserError) as asked:
            way(table, progress=False)
        assert f"row {line - 2}, " in str(asked.value)
        assert told in str(asked.value)


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
    direction = last_direction(pressure, np.zeros(400, dtype=int))
    assert (direction[40:190] == 1).all()
    assert (direction[220:390] == -1).all()


def test_no_rounding_turns_a_direction():
    """A pointer with play, moved sample by sample; half of the pressures are whole digits, which meet its ends."""
    for seed in range(40):
        generator = np.random.default_rng(seed)
        pressure = np.cumsum(generator.normal(size=400)) * generator.choice([1, 7.3, 1e3]) + 0.3
        pressure = np.round(pressure, 1) if seed % 2 else pressure
        band, pointer, direction = 0.01 * (1 + 1e-9) * np.ptp(pressure), pressure[0], [0.0]
        for value in pressure[1:]:
            moved = value - pointer - np.clip(value - pointer, -band, band)
            pointer += moved
            direction.append(np.sign(moved) if abs(moved) > 1e-12 * band else direction[-1])
        np.testing.assert_array_equal(last_direction(pressure, np.zeros(400, dtype=int)), direction)
