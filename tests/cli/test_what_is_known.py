"""What a user knows of parameters, from the command line to the reports."""

import json

import pytest
from hidden_tables import table
from rich.console import Console
from small_runs import make_csv, run

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings, plus_minus, quoted
from freelearn.api.tasks.discover_task import discover
from freelearn.api.tasks.preparation import known_of
from freelearn.common.errors import UserError
from freelearn.physics.models.build import load_model


@pytest.fixture(scope="module")
def csv(tmp_path_factory):
    return make_csv(tmp_path_factory.mktemp("known") / "table.csv")


def train(csv, folder, *overrides):
    run(folder, "train=all", "data=csv", f"data.path={csv}", "figures=false", *overrides)
    return json.loads((folder / "results.json").read_text())


def test_the_reports_say_what_was_fixed_and_what_was_known(csv, tmp_path):
    found = train(csv, tmp_path, "model.C1=1e6±1e5", "model.C2=2.2e7", "fix=[C2]")
    C1, C2 = (found["parameters"][name] for name in ("C1", "C2"))
    assert (C2["value"], C2["stderr"], C2["beforehand"]) == (2.2e7, 0.0, "fixed")
    assert C1["beforehand"] == "1e+06 ± 1e+05"
    assert 0 < C1["stderr"] < 1e5
    for name in ("report.html", "fit_report.txt"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "beforehand" in text
        assert "fixed" in text
    assert load_model(tmp_path / "checkpoint.ckpt").beforehand() == {"C1": "1e+06 ± 1e+05", "C2": "fixed"}


def test_nothing_is_said_where_nothing_was(csv, tmp_path):
    found = train(csv, tmp_path)
    assert "beforehand" not in found["parameters"]["C1"]
    assert "beforehand" not in (tmp_path / "fit_report.txt").read_text(encoding="utf-8")


def test_a_material_and_bounds_move_a_fit(csv, tmp_path):
    plain = train(csv, tmp_path / "plain")["parameters"]["C1"]["value"]
    soft = train(csv, tmp_path / "soft", "material=Ecoflex_00_30")["parameters"]["C1"]
    assert soft["value"] < plain
    assert soft["beforehand"] == "1.6e+04 ± 1e+04"
    bounded = train(csv, tmp_path / "bounded", "bounds={C1:[1e5,5e5]}")["parameters"]["C1"]
    assert bounded["value"] == pytest.approx(5e5)
    assert "C1 is at its bound (500000 Pa)" in (tmp_path / "bounded/fit_report.txt").read_text(encoding="utf-8")


def test_an_effect_may_be_held_where_it_is_known(csv, tmp_path):
    held = ["effects=[end_clamps]", "+model.end_clamps.clamp_length=1e-3", "fix=[end_clamps.clamp_length]"]
    entry = train(csv, tmp_path, *held)["parameters"]["end_clamps.clamp_length"]
    assert (entry["value"], entry["stderr"]) == (1e-3, 0.0)


@pytest.mark.nightly
def test_a_search_holds_what_is_fixed_and_believes_what_is_known(tmp_path):
    path = tmp_path / "table.csv"
    table({"friction_hysteresis": {"force": 0.6, "moment": 0.02}}).to_csv(path, index=False)
    said = ["model.C2=2e7", "fix=[C2]", "model.C1=8.5e5±1e5", "figures=false"]
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", *said])
    with open(tmp_path / "terminal.txt", "w", encoding="utf-8") as file:
        discover(asked, tmp_path, Console(file=file, width=120))
    found = json.loads((tmp_path / "discovery.json").read_text())
    assert found["effects"] == ["friction_hysteresis"]
    C1, C2 = (found["parameters"][name] for name in ("C1", "C2"))
    assert (C2["value"], C2["stderr"], C2["beforehand"]) == (2e7, 0.0, "fixed")
    assert C1["value"] == pytest.approx(8e5, rel=0.01)
    assert C1["beforehand"] == "8.5e+05 ± 1e+05"
    assert found["covariance"][1] == [0.0] * len(found["covariance"])
    assert "parameters determined" not in [c["name"] for c in found["referee"] if c["result"] != "pass"]
    assert "fixed" in (tmp_path / "terminal.txt").read_text(encoding="utf-8")


def test_the_command_takes_a_value_with_an_error_and_tells_mistakes(csv, commands, tmp_path):
    def command(*words):
        asked = ["data=csv", f"data.path={csv}", "fits=null", "train=all", "figures=false"]
        return commands.run("train", *asked, f"hydra.run.dir={tmp_path / 'run'}", *words)

    ended = command("model.C1=1e6±2e5")
    assert ended.status == 0, ended.told
    assert "1e+06 ± 2e+05" in ended.out
    ended = command("fix=[C3]", "material=ecoflex_30")
    assert ended.status == 1
    assert "Unknown parameter of model continuum: 'C3'" in ended.err
    assert "Traceback" not in ended.err


MISTAKES = {
    "fix=C2": "fix = 'C2': give a list of parameters",
    "bounds=3": "bounds = 3: give {parameter: [lowest, highest]}",
    "bounds={C1:1e5}": "give {parameter: [lowest, highest]}",
    "priors=perhaps": "priors = 'perhaps': choose on or off",
    "material=3": "material = 3 is not a text",
    "model.C1=1e6±nan": "model.C1 = nan is not a finite number",
    "model.C1=soft±3": "model.C1 = 'soft±3' is not a number",
}


@pytest.mark.parametrize("kind", [TrainSettings, DiscoverSettings])
@pytest.mark.parametrize("override", MISTAKES)
def test_a_mistake_is_told_in_words(kind, override):
    with pytest.raises(UserError) as told:
        settings(kind, [override])
    assert MISTAKES[override] in str(told.value)


def test_other_fits_do_not_heed_what_is_known():
    for how in ("fit=adam", "fit.intervals=profile"):
        with pytest.raises(UserError, match="needs fit=levenberg_marquardt"):
            known_of(settings(TrainSettings, [how, "material=latex"]))
        assert known_of(settings(TrainSettings, [how, "fix=[C2]"])).fixed == ("C2",)


def test_bounds_of_effects_are_for_searches_and_for_models_that_have_them():
    said = "bounds={end_clamps.clamp_length:[0,1e-3]}"
    assert known_of(settings(DiscoverSettings, [said])).bounds == {"end_clamps.clamp_length": (0.0, 1e-3)}
    assert not known_of(settings(TrainSettings, [said, "effects=[end_clamps]"])).nothing
    with pytest.raises(UserError, match=r"has no end_clamps: add it to effects"):
        known_of(settings(TrainSettings, [said]))


@pytest.mark.parametrize(
    ("text", "known"),
    [("1.2e6±0.2e6", (1.2e6, 2e5)), ("1e6+-1e5", (1e6, 1e5)), ("-1e-3 +/- 2e-3", (-1e-3, 2e-3)), ("1±2±3", None)],
)
def test_a_value_with_an_error_is_read_as_it_is_typed(text, known):
    assert plus_minus(text) == known


def test_a_sweep_over_values_with_errors_is_quoted_one_by_one():
    assert quoted("model.C1=1e6±2e5,2e6±2e5") == "model.C1='1e6±2e5','2e6±2e5'"
    assert quoted("model.C1='1e6±2e5'") == "model.C1='1e6±2e5'"
    assert quoted("train=all") == "train=all"
