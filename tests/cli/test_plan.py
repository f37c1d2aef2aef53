"""`python plan.py` after a small discovery: from its folder to rows that can be measured, and back."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from hidden_tables import table
from rich.console import Console
from small_runs import make_csv, run

import freelearn
from freelearn.api.settings.configuration import composed, settings
from freelearn.api.settings.run_settings import plan_settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.common.errors import UserError
from freelearn.data.beds import KINEMATIC
from freelearn.data.columns import Columns
from freelearn.data.states import kinematic_state
from freelearn.data.table.measurement_table import read_table
from freelearn.records.plan_record import Certificate, Expected, Narrowed, Plan
from freelearn.report.tables.plan_tables import parameter_rows, plan_lines


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A discovery that ends in the class pressure_offset or twist_offset."""
    folder = tmp_path_factory.mktemp("class")
    path = folder / "table.csv"
    table({"pressure_offset": {"pressure": 600.0}}, share=0.04).to_csv(path, index=False)
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false"])
    with open(folder / "terminal.txt", "w") as file:
        discovery = discover(asked, folder, Console(file=file))
    assert discovery.content["verdict"] == "class"
    return folder


def test_the_command_plans_rows_that_can_be_measured_and_appended(found, commands, tmp_path):
    out = tmp_path / "out"
    done = commands.run("plan", f"run={found}", "rows=6", f"hydra.run.dir={out}", cwd=tmp_path)
    assert done.status == 0, done.told
    assert "What to measure next" in done.out
    assert {p.name for p in out.iterdir()} == {"plan.csv", "plan.json", "plan_places.png", "plan_places.csv"}
    rows, content = pd.read_csv(out / "plan.csv"), json.loads((out / "plan.json").read_text())
    assert list(rows) == [*Columns(KINEMATIC).listed, "expected_z"]
    assert len(rows) == content["rows"] == 6
    assert rows[["force_n", "moment_nmm"]].isna().all().all()
    assert content["goal"] == "discriminate"
    assert {(e["true"], e["rival"]) for e in content["expected"]} == {
        ("pressure_offset", "twist_offset"),
        ("twist_offset", "pressure_offset"),
    }
    assert (rows["expected_z"] ** 2).sum() == pytest.approx(content["expected_z"] ** 2, rel=0.05)
    assert 0.5 < content["certificate"]["efficiency"] <= 1.01
    measured = pd.read_csv(found / "table.csv")
    for name in ("elongation_mm", "twist_deg", "pressure_kpa"):
        assert rows[name].between(measured[name].min() - 1e-9, measured[name].max() + 1e-9).all()
    # Once measured they belong into the table.
    filled = rows.assign(force_n=1.0, moment_nmm=2.0)
    filled.to_csv(tmp_path / "measured.csv", index=False)
    assert len(read_table(tmp_path / "measured.csv").table) == 6


def test_a_plan_of_ones_own_is_judged_as_the_program_judges_its_own(found, tmp_path):
    made = freelearn.plan(found, rows=6)
    made.table.to_csv(tmp_path / "mine.csv", index=False)
    mine = freelearn.plan(found, path=tmp_path / "mine.csv")
    assert [e.plain() for e in mine.expected] == [e.plain() for e in made.expected]
    assert mine.table.equals(made.table)
    assert mine.certificate.value == pytest.approx(made.certificate.value)
    assert mine.certificate.bound == pytest.approx(made.certificate.bound, rel=0.01)
    # A poor plan is told to be one: everything at one place in the middle.
    poor = made.table.assign(elongation_mm=0.0, twist_deg=10.0, pressure_kpa=np.arange(6.0), step=np.arange(6))
    poor[poor["sample"] == poor["sample"].iloc[0]].to_csv(tmp_path / "poor.csv", index=False)
    assert freelearn.plan(found, path=tmp_path / "poor.csv").certificate.efficiency < 0.3


@pytest.mark.nightly
def test_rows_outside_the_reach_are_said_and_scored(found, tmp_path):
    made = freelearn.plan(found, rows=4)
    made.table.assign(elongation_mm=7.5).to_csv(tmp_path / "far.csv", index=False)
    far = freelearn.plan(found, path=tmp_path / "far.csv")
    assert any("4 of 4 rows lie outside the reach: elongation_mm" in note for note in far.notes)
    wider = freelearn.plan(found, rows=40, reach={"elongation_mm": (-8.0, 8.0)})
    assert wider.table["elongation_mm"].abs().max() <= 8
    assert not wider.notes


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_plan_and_more_rows_tell_more(found):
    few, again, many = (freelearn.plan(found, rows=n) for n in (4, 4, 12))
    assert few.table.equals(again.table)
    assert many.weakest.after > few.weakest.after
    assert many.certificate.bound > few.certificate.bound


@pytest.mark.parametrize(
    ("per_state", "mountings"),
    [(2, 3), *(pytest.param(*case, marks=pytest.mark.nightly) for case in [(1, 6), (4, 2)])],
)
def test_rows_of_a_mounting_are_as_asked(found, per_state, mountings):
    made = freelearn.plan(found, rows=6, per_state=per_state)
    sizes = np.unique(kinematic_state(made.table), return_counts=True)[1]
    assert made.mountings == len(sizes) <= mountings
    assert sizes.max() <= per_state
    assert (made.table.groupby(kinematic_state(made.table))["step"].max().to_numpy() == sizes - 1).all()


def test_a_dear_mounting_makes_for_fewer_of_them(found):
    cheap = freelearn.plan(found, rows=8, goal="narrow", parameter="C1", mounting_rows=0)
    dear = freelearn.plan(found, rows=8, goal="narrow", parameter="C1", mounting_rows=30)
    assert dear.mountings < cheap.mountings


def test_a_parameter_is_halved_with_about_as_many_rows_as_said(found):
    few = freelearn.plan(found, rows=8, goal="narrow", parameter="C1")
    (one,) = few.parameters
    assert 0.5 < one.factor < 1
    needed = int(np.ceil(few.rows_needed))
    many = freelearn.plan(found, rows=needed, goal="narrow", parameter="C1")
    assert many.parameters[0].factor == pytest.approx(0.5, abs=0.03)


def test_an_effect_that_nobody_found_can_be_settled(found):
    made = freelearn.plan(found, rows=10, goal="detect", effect="force_gain")
    assert [p.name for p in made.parameters] == ["force_gain.gain"]
    assert made.parameters[0].after < made.parameters[0].before
    assert made.weakest.after > made.weakest.before


def test_friction_is_settled_by_pressures_that_fall_after_higher_ones(found):
    made = freelearn.plan(found, rows=8, goal="detect", effect="friction_hysteresis", per_state=4)
    falls = []
    for _, part in made.table.groupby(kinematic_state(made.table)):
        falls.append((part["pressure_kpa"].diff() < 0).any())
    assert any(falls)


def test_after_a_training_run_the_widest_interval_is_halved(tmp_path):
    run(tmp_path / "run", f"data.path={make_csv(tmp_path / 't.csv')}", "data=csv", "train=all", "figures=false")
    made = freelearn.plan(tmp_path / "run", rows=5)
    assert made.goal == "narrow"
    assert made.parameters[0].name in ("C1", "C2")
    assert made.parameters[0].factor < 1
    with pytest.raises(UserError, match="no class of effects to discriminate"):
        freelearn.plan(tmp_path / "run", rows=5, goal="discriminate")


def test_mistakes_are_told_in_a_sentence(found, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "header.csv").write_text("sample,step,elongation_mm,twist_deg,pressure_kpa\n")
    (tmp_path / "blank.csv").write_text("sample,step,elongation_mm,twist_deg,pressure_kpa\n3,0,1.0,,10\n")
    (tmp_path / "other.csv").write_text("sample,step,elongation_mm,twist_deg,pressure_kpa\n9,0,1.0,2.0,10\n")
    (tmp_path / "lacks.csv").write_text("sample,step,elongation_mm\n3,0,1.0\n")
    wrong = [
        ({"run": tmp_path / "none", "rows": 4}, "No folder at"),
        ({"run": tmp_path / "empty", "rows": 4}, "it holds neither results.json nor discovery.json"),
        ({"rows": 0}, "rows = 0 is too small"),
        ({}, "needs a number of rows"),
        ({"rows": 4, "path": tmp_path / "blank.csv"}, "leave out rows="),
        ({"rows": 4, "goal": "detect"}, "effect=NAME"),
        ({"rows": 4, "goal": "detect", "effect": "force_gian"}, "Did you mean 'force_gain'"),
        ({"rows": 4, "goal": "narrow", "parameter": "C3"}, "Unknown parameter 'C3'"),
        ({"rows": 4, "effect": "force_gain"}, "belongs to goal=detect"),
        ({"rows": 40, "per_state": 30}, "per_state = 30 is too many"),
        ({"path": tmp_path / "header.csv"}, "holds no rows"),
        ({"path": tmp_path / "blank.csv"}, "twist_deg"),
        ({"path": tmp_path / "other.csv"}, "plans sample 9"),
        ({"path": tmp_path / "lacks.csv"}, "lacks the columns twist_deg, pressure_kpa"),
        ({"path": tmp_path / "nowhere.csv"}, "nowhere.csv"),
    ]
    for options, message in wrong:
        with pytest.raises(UserError, match=message):
            freelearn.plan(options.pop("run", found), **options)


def test_a_mistake_leaves_no_folder_behind(tmp_path):
    command = [sys.executable, ROOT / "plan.py", "run=nowhere", "rows=4"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: No folder at nowhere")
    assert not list(tmp_path.iterdir())


def test_a_reach_is_taken_from_the_command_line():
    content = composed("plan", ["run=somewhere", "rows=4", "reach={elongation_mm:[-5,5],pressure_kpa:[0,70]}"])
    assert plan_settings(content).reach == {"elongation_mm": (-5.0, 5.0), "pressure_kpa": (0.0, 70.0)}


@pytest.mark.parametrize(
    ("before", "now", "more"),
    [
        ("split", "discriminate", []),
        ("settle", "detect", ["effect=force_gain"]),
        ("halve", "narrow", ["parameter=C1"]),
    ],
)
def test_goals_are_understood_by_what_they_were_called(before, now, more):
    content = composed("plan", ["run=somewhere", "rows=4", f"goal={before}", *more])
    assert plan_settings(content).goal == now


def test_a_parameter_of_which_the_rows_say_nothing_has_no_digits_and_is_told():
    lost = Narrowed("C1", "Pa", 1.7712e15, 5.6e19, 5.6e19, untold=True)
    known = Narrowed("C2", "Pa", 1.0e6, 2.0e4, 1.0e4)
    plan = Plan(
        "narrow", pd.DataFrame({"elongation_mm": [0.0, 0.0]}), pd.DataFrame(), (Expected(("C1",), 0.0, 0.0),), (lost,),
        Certificate(0.0, 0.0), 1, np.inf, (), {},
    )  # fmt: skip
    assert parameter_rows(replace(plan, parameters=(lost, known))).rows == (
        ("C1", "1.8e+15", "–", "–", "1.00", "Pa"),
        ("C2", "1e+06", "2e+04", "1e+04", "0.50", "Pa"),
    )
    lines = plan_lines(plan)
    assert lines[0] == "2 rows in 1 mounting: the interval of C1 stays as wide as it is."
    said = "C1 = 1.8e+15 Pa is not determined by these rows: its standard error is 3.2e+04 times as large."
    assert said in lines
