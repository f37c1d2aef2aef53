"""Every option of a command is an argument of the same name, told in the docstring, by default as configured."""

import dataclasses
import inspect
import re

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.api.arguments import settings_of
from freelearn.api.settings.configuration import composed
from freelearn.api.settings.run_settings import PlanSettings, RefereeSettings
from freelearn.api.settings.settings import CsvData, DiscoverSettings, TrainSettings
from freelearn.api.table_files import table_file

# A sweep's own; and what arguments are called that the configuration nests.
ABSENT, NESTED = {"exclude"}, {"plan": "path", "figures": "figures"}


@pytest.fixture(scope="module")
def table():
    rows = {"sample": 1, "step": [0, 1], "elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": [0.0, 50.0]}
    tube = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    return pd.DataFrame(rows | tube | {"force_n": [0.0, 1.0], "moment_nmm": [0.0, -3.0], "buckled": 0})


def names(function):
    return set(inspect.signature(function).parameters)


@pytest.mark.parametrize(("function", "kind"), [(fl.fit, TrainSettings), (fl.discover, DiscoverSettings)])
def test_every_option_is_an_argument(function, kind):
    options = {field.name for field in dataclasses.fields(kind)} - ABSENT
    assert options <= names(function)
    assert {field.name for field in dataclasses.fields(CsvData)} - {"name", "path"} <= names(function)


@pytest.mark.parametrize(("function", "kind"), [(fl.plan, PlanSettings), (fl.referee, RefereeSettings)])
def test_every_option_of_what_asks_a_run_is_an_argument(function, kind):
    options = {NESTED.get(field.name, field.name) for field in dataclasses.fields(kind)}
    # A plan is drawn when it is saved.
    assert options - {"figures"} <= names(function)


@pytest.mark.parametrize(("function", "name"), [(fl.fit, "train"), (fl.discover, "discover")])
def test_defaults_are_those_of_the_configuration(function, name):
    content = composed(name, ["data=virtual"])
    # The simulated bed's sample 3, the pictures and the kept fits are the command line's.
    ours = {"train", "figures", "fits", "data", "checks"}
    for option, parameter in inspect.signature(function).parameters.items():
        if option not in content or option in ours:
            continue
        usual = content[option]
        usual = usual["name"] if isinstance(usual, dict) else usual
        default = list(parameter.default) if isinstance(parameter.default, tuple) else parameter.default
        assert default == usual or (default is True and usual in ("on", True)), option


@pytest.mark.parametrize("function", [fl.fit, fl.discover, fl.plan, fl.referee, fl.read_table])
def test_every_argument_is_told_in_the_docstring(function):
    said = inspect.getdoc(function) + (inspect.getdoc(fl.fit) if function is fl.discover else "")
    for name in names(function) - {"options"}:
        assert re.search(rf"\b{name}\b[^.]*:", said), name


def settings(table, **options):
    return settings_of(TrainSettings, "train", table_file(table, None), {"train": "all", **options})


def test_an_accuracy_is_the_same_in_its_class_and_as_a_mapping(table):
    stated = settings(table, accuracy=fl.Accuracy(force_n=0.1)).data.accuracy
    assert stated == settings(table, accuracy={"force_n": 0.1}).data.accuracy
    assert (stated.force_n, stated.elongation_mm) == (0.1, 0.073)
    assert settings(table, accuracy="estimate").data.accuracy is None


@pytest.mark.parametrize("wrong", [{"force_n": -1.0}, {"force_n": 0}, {"twist_deg": float("nan")}, {"force_n": "much"}])
def test_an_accuracy_that_is_none_is_refused(wrong):
    with pytest.raises(fl.UserError, match=r"fl\.Accuracy|standard deviation"):
        fl.Accuracy(**wrong)


def test_numbers_of_numpy_are_numbers(table):
    chosen = settings(table, seed=np.int64(4), bounds={"C1": np.array([1e4, 1e6])}, fix={"C2": np.float64(2e7)})
    assert chosen.seed == 4
    assert chosen.bounds == {"C1": (1e4, 1e6)}
    assert (chosen.fix, chosen.model.values["C2"]) == (("C2",), 2e7)


def test_a_group_is_a_name_or_options(table):
    chosen = settings(table, model={"name": "linear", "ka": 5.0}, fit={"max_epochs": 7}, split="states")
    assert (chosen.model.name, chosen.model.values["ka"]) == ("linear", 5.0)
    assert (chosen.fit.name, chosen.fit.max_epochs, chosen.split.name) == ("levenberg_marquardt", 7, "states")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"priors": {"C1": 1e6}}, "standard deviation"),
        ({"fix": {"C1": "stiff"}}, "not a number"),
        ({"effect": ["end_clamps"]}, "Did you mean 'effects'"),
        ({"model": 3}, "neither a name nor a mapping"),
        ({"model": "continum"}, "Did you mean 'continuum'"),
        ({"fit": {"name": "adamm"}}, "Unknown fit 'adamm'"),
        ({"data": 3}, "give a mapping of options"),
        ({"accuracy": 0.1}, "fl.Accuracy(force_n"),
        ({"seed.first": 1}, "no option here"),
        ({"fit.tolerances": 1e-6}, "tolerances"),
    ],
)
def test_a_wrong_argument_says_what_to_do(table, options, says):
    with pytest.raises(fl.UserError, match=re.escape(says)):
        settings(table, **options)
