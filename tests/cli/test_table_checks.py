"""What `python discover.py` says and claims of a table whose load cell was not tared."""

import json

import numpy as np
import pytest
from hidden_tables import QUICK, table
from rich.console import Console

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover


@pytest.fixture(scope="module")
def heavy():
    rows = table({}, samples=(3,))
    state = (rows[["elongation_mm", "twist_deg"]].diff().abs().sum(axis=1) > 0).cumsum()
    few = rows[np.isin(state, np.unique(state)[::16])]
    return few.assign(force_n=few["force_n"] + 15.0)


def run(rows, folder, *overrides):
    folder.mkdir(exist_ok=True)
    rows.to_csv(folder / "table.csv", index=False)
    data = ["data=csv", f"data.path={folder / 'table.csv'}", "figures=false", *overrides]
    with open(folder / "terminal.txt", "w") as file:
        discover(settings(DiscoverSettings, data), folder, Console(file=file, width=100))
    return json.loads((folder / "discovery.json").read_text())


def test_a_failed_check_leaves_nothing_claimed_and_comes_first(heavy, tmp_path):
    found = run(heavy, tmp_path)
    assert found["verdict"] == "undecided"
    assert "load cell was not tared" in found["says"].split(". ")[0]
    assert [c["name"] for c in found["checks"] if c["status"] == "fail"]
    terminal = (tmp_path / "terminal.txt").read_text()
    assert terminal.index("load cell was not tared") < terminal.index("Undecided")
    assert "A look at the table, before any search" in (tmp_path / "report.html").read_text()
    referee = json.loads((tmp_path / "referee.json").read_text())
    assert (referee["claimed"], referee["verdict"]) == ("undecided", "undecided")
    assert freelearn.referee(tmp_path).stands() == "Nothing was claimed (undecided)."


@pytest.mark.nightly
def test_checks_that_are_overruled_stop_nothing_and_are_noted(heavy, tmp_path):
    found = run(heavy, tmp_path, "checks=off")
    assert "load cell was not tared" not in found["says"]
    assert any(note.startswith("checks=off overrules") for note in found["notes"])
    assert [c for c in found["checks"] if c["status"] == "fail"]


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_of_one_row_nothing_is_said_but_that_it_is_one(heavy, tmp_path):
    """Two numbers go through two readings whichever sign or unit is tried: none of these is suspected."""
    found = run(heavy[:1].assign(elongation_mm=-1.0), tmp_path, "figures=true")
    assert found["verdict"] == "undecided"
    assert not [c["name"] for c in found["checks"] if c["status"] == "fail"]
    assert found["says"].startswith("Undecided: 1 row with 2 readings: too few to look for a missing effect.")
    terminal = (tmp_path / "terminal.txt").read_text()
    assert "on 1 row;" in terminal
    assert "Held-out error from" not in terminal


@pytest.mark.nightly
def test_what_a_look_at_the_table_told_is_not_told_again(heavy, tmp_path):
    run(heavy.assign(moment_nmm=-heavy["moment_nmm"]), tmp_path, QUICK)
    lines = (tmp_path / "terminal.txt").read_text().splitlines()
    assert len([line for line in lines if line.startswith("! moment_nmm may have its sign turned")]) == 1


def test_of_rows_that_were_sorted_nothing_is_searched_for(tmp_path):
    """The states are lost: whatever a search would find belongs to others."""
    rows = table({}, samples=(3,)).sort_values("pressure_kpa", kind="stable")
    rows = rows.assign(time_s=20.0 * np.arange(len(rows)), step=0)
    found = run(rows, tmp_path)
    assert (found["verdict"], found["effects"], found["models"]) == ("undecided", [], [])
    assert found["says"].startswith("Undecided: the rows were sorted")
    assert [check["name"] for check in found["referee"]] == ["order of the rows"]
    # Who says that they were not has them looked at.
    assert run(rows[:30], tmp_path / "overruled", "checks=off", QUICK)["models"]
