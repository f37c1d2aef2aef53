"""python -m freelearn.specimens with recordings: what it chooses, writes, draws and refuses."""

import io
import json
import sys

import numpy as np
import pandas as pd
import pytest
from nightly import EVERY
from relaxing_rubber import integrated, ramp_and_hold, sheared
from rich.console import Console

from freelearn.cli import specimen_fits as command
from freelearn.common.errors import UserError
from freelearn.records.specimen_record import load_parameters

MODULUS, TIME = 1e5, 2.0


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Two ramps and holds of one arm beside a rubber of 200 kPa, with noise of 0.5 %."""
    generator, parts = np.random.default_rng(1), []
    for name, rate in (("fast", 4.0), ("slow", 0.4)):
        stop = 2 / rate
        time = np.concatenate([np.linspace(0, stop, 30), stop + np.geomspace(0.05, 20, 30)])
        path = ramp_and_hold(rate, 2.0)
        stress = integrated(sheared, 2e5, [(MODULUS, TIME)], path, time, (0.0, 0.0))
        stress += 0.005 * stress.max() * generator.standard_normal(len(time))
        shear = [path(t) for t in time]
        parts.append(pd.DataFrame({"specimen": name, "time_s": time, "shear": shear, "stress_mpa": stress / 1e6}))
    path = tmp_path_factory.mktemp("recorded") / "table.csv"
    pd.concat(parts).assign(mode="SS").to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def run(table):
    """The command's folder and text; at night with nothing said of the relaxation, which takes four times as long."""
    text = io.StringIO()
    out, wanted = table.parent / "out", None if EVERY else command.Wanted("1")
    console = Console(file=text, width=120)
    command.fit_specimens(command.read_specimens([str(table)]), [], [], out, console, wanted=wanted)
    return out, text.getvalue()


@pytest.mark.nightly
def test_the_relaxation_is_chosen_by_what_it_predicts(run):
    out, text = run
    result = json.loads((out / "specimen.json").read_text())
    assert result["relaxation"]["kind"] == 1
    assert not result["relaxation"]["softened"]
    constants = result["parameters"] | result["relaxation"]["parameters"]
    for name, value in (("C1", 2e5), ("arm_1.modulus", MODULUS), ("arm_1.time", TIME)):
        low, high = constants[name]["interval"]
        assert low < constants[name]["value"] < high
        assert constants[name]["value"] == pytest.approx(value, rel=0.03)
    assert set(result["modes"]) == {"fast", "slow"}
    assert all(0.003 < mode["held_out"] < 0.02 for mode in result["modes"].values())
    tried = pd.read_csv(out / "relaxations.csv").set_index("relaxation")
    assert tried.loc["none", "held_out"] > 4 * tried.loc["1 arm", "held_out"]
    assert "relaxation: 1 arm" in text
    assert "held out" in text
    assert {p.name for p in out.iterdir()} == {
        "curves.csv", "curves.png", "relaxations.csv", "report.html", "specimen.json",
    }  # fmt: skip


def test_a_model_takes_over_the_rubber_at_rest(run):
    assert load_parameters(run[0] / "specimen.json") == pytest.approx({"C1": 2e5}, rel=0.03)


def test_curves_hold_every_sample_measured_and_fitted(run, table):
    curves = pd.read_csv(run[0] / "curves.csv")
    assert curves["source"].value_counts().tolist() == [len(pd.read_csv(table))] * 2
    wide = curves.pivot(index=["specimen", "time_s"], columns="source", values="stress_mpa")
    assert (wide["measured"] - wide["neo-Hookean"]).abs().max() < 0.03 * wide["measured"].max()
    page = (run[0] / "report.html").read_text()
    assert "time since the recording" in page


def test_a_recording_held_out_is_named_by_its_specimen(table, capsys, monkeypatch):
    out = table.parent / "held"
    words = ["specimens", str(table), "--relaxation", "1", "--held-out", "fast", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", words)
    command.main()
    modes = json.loads((out / "specimen.json").read_text())["modes"]
    assert {name: mode["fitted"] for name, mode in modes.items()} == {"fast": False, "slow": True}
    assert modes["fast"]["error"] < 0.02
    assert "fast (held out)" in capsys.readouterr().out


def test_a_pull_alone_does_not_tell_what_is_left_at_rest(tmp_path):
    # A slow arm beside nothing: over 2 s it pulls as rubber at rest would.
    time = np.linspace(0, 2, 40)
    stress = integrated(sheared, 0.0, [(MODULUS, 50.0)], lambda t: t, time, (0.0, 0.0))
    stress += 0.01 * stress.max() * np.random.default_rng(2).standard_normal(len(time))
    pull = pd.DataFrame({"time_s": time, "shear": time, "stress_mpa": stress / 1e6})
    pull.to_csv(tmp_path / "pull.csv", index=False)
    data, text = command.read_specimens([f"SS={tmp_path / 'pull.csv'}"]), io.StringIO()
    command.fit_specimens(data, [], [], tmp_path / "o", Console(file=text, width=200), wanted=command.Wanted("1"))
    assert "C1, the rubber at rest, is anywhere from" in text.getvalue() or "C1 is not determined" in text.getvalue()


def test_what_cannot_be_is_said_in_a_sentence(table, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["specimens", str(table), "--held-out", "quick", "--out", str(tmp_path / "o")])
    with pytest.raises(SystemExit) as caught:
        command.main()
    assert "Test quick cannot be held out: the data hold fast, slow." in str(caught.value)
    monkeypatch.setattr(sys, "argv", ["specimens", str(table), "--softened"])
    with pytest.raises(SystemExit):
        command.main()
    assert "add --relaxation" in capsys.readouterr().err
    still = tmp_path / "still.csv"
    still.write_text("stretch,stress_mpa\n1.1,0.1\n1.5,0.4\n")
    data = command.read_specimens([f"UT={still}"])
    with pytest.raises(UserError, match="No test has a time"):
        command.fit_specimens(data, [], [], tmp_path / "p", Console(), wanted=command.Wanted("1"))
