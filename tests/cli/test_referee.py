"""`python referee.py`: the checks of what a run claims, of runs of discover and of train."""

import json

import pytest
from hidden_tables import table
from rich.console import Console
from small_runs import make_csv, run

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.common.errors import UserError


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """A discovery that ends with friction."""
    folder = tmp_path_factory.mktemp("named")
    path = folder / "table.csv"
    table({"friction_hysteresis": {"force": 0.6, "moment": 0.02}}, share=0.04).to_csv(path, index=False)
    # One that the rows could have told, and one that one tube tells nothing of.
    absent = "ruled_out=[force_gain,wall_modulus]"
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false", absent])
    with open(folder / "terminal.txt", "w") as file:
        discovery = discover(asked, folder, Console(file=file))
    assert discovery.content["effects"] == ["friction_hysteresis"]
    return folder


def test_the_command_says_of_a_discovery_what_the_search_said(named, commands):
    before = json.loads((named / "referee.json").read_text())
    ended = commands.run("referee", f"run={named}")
    assert ended.status == 0, ended.told
    assert "Does the claim stand" in ended.out
    after = json.loads((named / "referee.json").read_text())
    assert (after["claimed"], after["verdict"]) == (before["claimed"], before["verdict"])
    assert {c["name"]: c["result"] for c in after["checks"]} == {c["name"]: c["result"] for c in before["checks"]}
    # The friction that the table has could have been seen; so could others.
    assert all(size > 0 for sizes in after["visible"].values() for size in sizes.values())
    assert "force_offset" in after["visible"]
    assert not {"force_gain", "wall_modulus"} & set(after["visible"])


@pytest.mark.slow
@pytest.mark.nightly
def test_a_simulation_goes_on_where_it_was_interrupted_and_tells_its_rates(named):
    lines = named / "referee_tables.jsonl"
    entry = {"seed": 0, "number": 0, "hidden": [], "verdict": "named", "effects": ["x"], "classes": [["x"]]}
    lines.write_text(json.dumps(entry) + "\n")
    done = freelearn.referee(named, "simulate", 3, cores=1)
    # The first is the one that was there, which claims something wrong; the others were searched.
    assert (done.simulated["wrong"]["count"], done.simulated["wrong"]["of"]) == (1, 3)
    assert done.simulated["found"]["friction_hysteresis"]["count"] == 1
    assert not lines.exists()
    assert "simulated" in json.loads((named / "referee.json").read_text())


def test_of_a_run_of_train_the_model_is_judged_and_nothing_claimed(tmp_path):
    folder = tmp_path / "run"
    run(folder, f"data.path={make_csv(tmp_path / 'table.csv')}", "data=csv", "model=continuum")
    done = freelearn.referee(folder)
    assert done.claimed == ""
    names = [check.name for check in done.checks]
    assert "parameters plausible" in names
    assert any(name.startswith("black box") for name in names)
    assert (folder / "referee.json").exists()


def test_what_is_no_run_is_one_sentence(tmp_path):
    with pytest.raises(UserError, match="run"):
        freelearn.referee(tmp_path)
