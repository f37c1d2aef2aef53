"""Bands: between their ends lie 95 of a hundred new measurements, whatever is asked for and however the noise looks."""

import beds
import numpy as np
import pandas as pd
import pytest
import torch
from fitted_folders import LOADS, PLACE, continuum, design, fitted, shown
from scipy import stats
from scipy.optimize import least_squares

from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.data.rows import Rows
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.models.build import MODELS, build_model
from freelearn.queries.inverse.held_out import held_out
from freelearn.queries.inverse.raw_covariance import RawCovariance

ERRORS = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
SENSORS = Accuracy.engineering(0.0, 0.0, 0.0, 0.03, 0.6)


def normal(generator, name, count):
    return ERRORS[name] * generator.normal(size=count)


def heavy(generator, name, count):
    """Student's t with three degrees of freedom, of the sensors alone."""
    size = generator.standard_t(3, size=count) if name in LOADS else generator.normal(size=count)
    return ERRORS[name] * size


def slipped(generator, name, count):
    """Three in a hundred readings of the sensors are off by twenty times the noise."""
    slip = 20 * (generator.random(count) < 0.03) * (name in LOADS)
    return ERRORS[name] * (generator.normal(size=count) + slip)


def measured(model, count, seed, noise=normal, rows_a_place=1):
    """Rows at random places of sample 3 as a bed with these errors reads them: place, pressure and loads."""
    generator = np.random.default_rng(seed)
    draw, places = generator.uniform, count // rows_a_place
    true = pd.DataFrame({"elongation_mm": draw(-4, 4, places), "twist_deg": draw(-100, 100, places)})
    true = true.loc[np.repeat(true.index, rows_a_place)].reset_index(drop=True)
    true = shown(model, true.assign(pressure_kpa=draw(5, 70, count), **design(3), step=0, buckled=0))
    return true.assign(**{name: true[name] + noise(generator, name, count) for name in ERRORS})


def fit(model, table, scale=None):
    """The model at SciPy's least squares, and the covariance of its parameters."""
    problem = Problem(model, Rows.from_table(table), scale)
    start = model.vector().detach().numpy()
    found = least_squares(lambda v: problem.residual(torch.as_tensor(v)).detach().numpy(), start, x_scale=np.abs(start))
    model.set_vector(torch.as_tensor(found.x))
    freedom = 2 * len(table) - len(start)
    raw = np.linalg.inv(found.jac.T @ found.jac) * 2 * found.cost / freedom
    values = np.array([model.scalars()[n] if p.log else 1.0 for n, p in model.declared.items()])
    return raw * np.outer(values, values)


def covered(answers, truth, name):
    """Share of the measurements between the ends, where one answer alone makes it clear which they are of."""
    table = answers.filled
    inside = (table[f"{name}_low"] <= truth[name]) & (truth[name] <= table[f"{name}_high"])
    there = (table["status"] == "ok") & (table["solutions"] == 1)
    assert there.mean() > 0.75
    assert table.loc[there, f"{name}_low"].notna().all()
    return inside[there].mean()


PATTERNS = [
    ["force_n", "moment_nmm"],
    ["elongation_mm", "twist_deg"],
    ["pressure_kpa"],
    ["twist_deg", "pressure_kpa"],
    ["elongation_mm", "moment_nmm"],
]


@pytest.fixture(scope="module", params=[(normal, PAPER), (heavy, PAPER), (slipped, PAPER), (normal, None)],
                ids=["normal", "heavy tails", "slipped", "no accuracy"])  # fmt: skip
def calibrated(request, tmp_path_factory):
    noise, accuracy = request.param
    model = continuum()
    table = measured(model, 1500, 1, noise)
    new = measured(continuum(), 1200, 2, noise)
    covariance = fit(model, table)
    return fitted(tmp_path_factory.mktemp("run"), model, table, covariance=covariance, accuracy=accuracy), new


@pytest.mark.parametrize("blank", PATTERNS, ids="+".join)
def test_between_the_ends_lie_95_of_a_hundred_new_measurements(calibrated, blank):
    run, new = calibrated
    answers = run.invert(new.drop(columns=["step", *blank]))
    for name in blank:
        assert 0.93 <= covered(answers, new, name) <= 0.972, name


class Slopes(Parameters):
    push: torch.Tensor = parameter("a", "m²", start=1e-5, scale=1e-5)
    turn: torch.Tensor = parameter("b", "m³", start=1e-8, scale=1e-8)
    axial: torch.Tensor = parameter("k", "N/m", start=1000.0, scale=500.0)
    twisting: torch.Tensor = parameter("s", "N·m/rad", start=0.02, scale=0.01)


class Straight(Model[Slopes]):
    """F = a P − k Δl, M = b P − s φ: linear in its parameters."""

    name = "straight"
    parameter_class = Slopes
    conservative = True

    def structure(self, states, p):
        force = p.push * states.pressure - p.axial * (states.length - states.reference_length)
        return torch.stack([force, p.turn * states.pressure - p.twisting * states.twist], dim=-1)


TRUE = {"push": 2e-5, "turn": 4e-8, "axial": 800.0, "twisting": 0.02}


@pytest.fixture
def straight(monkeypatch):
    monkeypatch.setitem(MODELS, "straight", Straight)

    def make(count, seed=0, rows_a_state=1, sensors=normal):
        """A table with noise in its loads alone, the model at its exact least squares, and each channel's own."""
        generator = np.random.default_rng(seed)
        states = -(-count // rows_a_state)
        places = np.repeat(generator.uniform(-1, 1, (states, 2)) * (4, 90), rows_a_state, axis=0)[:count]
        table = pd.DataFrame(places, columns=PLACE).assign(pressure_kpa=generator.uniform(0, 70, count), **design(3))
        table = table.assign(step=np.arange(count) % rows_a_state, buckled=0)
        table = shown(Straight(**TRUE), table)
        table = table.assign(**{name: table[name] + sensors(generator, name, count) for name in LOADS})
        model, covariance = Straight(**TRUE), np.zeros((4, 4))
        names = list(model.declared)
        for (x, y), own, size in zip(
            channels(table), (("push", "axial"), ("turn", "twisting")), (0.03, 6e-4), strict=True
        ):
            model.set_values(dict(zip(own, np.linalg.lstsq(x, y, rcond=None)[0], strict=True)))
            place = [names.index(n) for n in own]
            covariance[np.ix_(place, place)] = size**2 * np.linalg.inv(x.T @ x)
        return model, table, covariance

    return make


def channels(table):
    """Regressors (n, 2) and readings (n,) of force and of moment, SI."""
    pressure = table["pressure_kpa"].to_numpy() * KPA
    force = np.c_[pressure, -table["elongation_mm"].to_numpy() * MM], table["force_n"].to_numpy()
    return force, (np.c_[pressure, -table["twist_deg"].to_numpy() * DEG], table["moment_nmm"].to_numpy() * NMM)


def test_of_a_linear_model_the_band_is_the_textbook_s_prediction_interval(straight, tmp_path):
    model, table, covariance = straight(3000)
    run = fitted(tmp_path, model, table, covariance=covariance, accuracy=SENSORS)
    # The last far beyond what was measured, so that its parameters count: a leverage of about one.
    where = pd.DataFrame(
        {"elongation_mm": [0.0, 3.0, 150.0], "twist_deg": [0.0, -80.0, 4000.0], "pressure_kpa": [10.0, 60.0, 900.0]}
    )
    answers = run.invert(where).filled
    for (x, _), (at, _), name, size in zip(
        channels(table), channels(where.assign(force_n=0.0, moment_nmm=0.0)), LOADS, (0.03, 0.6), strict=True
    ):
        leverage = np.einsum("ni,ij,nj->n", at, np.linalg.inv(x.T @ x), at)
        half = (answers[f"{name}_high"] - answers[f"{name}_low"]) / 2
        np.testing.assert_allclose(half, stats.norm.ppf(0.975) * size * np.sqrt(1 + leverage), rtol=0.06)
        np.testing.assert_allclose(half / half[0], np.sqrt((1 + leverage) / (1 + leverage[0])), rtol=0.03)
        assert leverage[2] > 0.3


@pytest.mark.parametrize(("count", "rows_a_state"), [(60, 3), (36, 4)], ids=["one step", "few states"])
def test_a_row_is_left_out_with_its_state_as_by_a_fit_of_its_own(straight, count, rows_a_state):
    model, table, covariance = straight(count, 3, rows_a_state)
    rows = Rows.from_table(table)
    held = held_out(model, rows, torch.ones(count, dtype=torch.bool), True, RawCovariance.from_model(model, covariance))
    for i, (x, y) in enumerate(channels(table)):
        for state in np.unique(rows.state):
            own = rows.state == state
            without = np.linalg.lstsq(x[~own], y[~own], rcond=None)[0]
            np.testing.assert_allclose(held.residual[own, i], x[own] @ without - y[own], rtol=1e-6, atol=1e-10)
            # Least squares of the other rows predict it with this variance.
            rest = np.linalg.inv(x[~own].T @ x[~own])
            variance = (0.03, 6e-4)[i] ** 2 * np.einsum("na,ab,nb->n", x[own], rest, x[own])
            np.testing.assert_allclose(held.by_parameters[own, i, i], variance, rtol=1e-6)


def test_of_the_continuum_one_step_leaves_out_nearly_what_a_fit_does():
    model = continuum()
    # States of four rows, so that one has some weight.
    table = measured(model, 160, 5, rows_a_place=4).assign(step=np.arange(160) % 4)
    table[PLACE] = table[PLACE].groupby(np.arange(160) // 4).transform("first")
    fit(model, table)
    rows = Rows.from_table(table)
    nothing = RawCovariance.from_model(model, np.full((len(model.declared),) * 2, np.nan))
    held = held_out(model, rows, torch.ones(160, dtype=torch.bool), True, nothing)
    assert held.by_parameters is None
    with torch.no_grad():
        plain = (model(rows.states).loads - rows.loads).numpy()
    moved, truth = [], []
    for state in np.unique(rows.state)[:6]:
        own = rows.state == state
        other = build_model("continuum", model.scalars())
        fit(other, table[~own], Problem(model, rows).scale)
        with torch.no_grad():
            left = (other(rows[torch.as_tensor(own)].states).loads - rows.loads[own]).numpy()
        moved.append(held.residual[own].numpy() - plain[own])
        truth.append(left - plain[own])
    moved, truth = np.concatenate(moved), np.concatenate(truth)
    assert np.abs(moved - truth).max() < 0.1 * np.abs(truth).max()


def test_where_a_parameter_is_not_known_what_hangs_on_it_has_no_band(straight, tmp_path):
    model, table, covariance = straight(300)
    place = list(model.declared).index("turn")
    covariance[place], covariance[:, place] = np.nan, np.nan
    run = fitted(tmp_path, model, table, covariance=covariance, accuracy=SENSORS)
    row = run.invert(pd.DataFrame({"elongation_mm": [1.0], "twist_deg": 10.0, "pressure_kpa": 30.0})).filled.iloc[0]
    assert np.isfinite(row["force_n_low"])
    assert np.isnan(row["moment_nmm_low"])
    row = run.invert(pd.DataFrame({"force_n": [1.0], "moment_nmm": 1.0, "pressure_kpa": 30.0})).filled.iloc[0]
    assert np.isfinite(row["elongation_mm_low"])
    assert np.isnan(row["twist_deg_low"])
    assert np.isfinite(row["twist_deg"])


def test_of_a_moment_that_was_never_measured_nothing_is_known(tmp_path):
    """An isometric bed: the moment's answer has no band, nor has any place that hangs on a moment."""
    model = continuum(c1=beds.C1, c2=beds.C2)
    table = beds.isometric({}).query("slack == 0").assign(bed="isometric").reset_index(drop=True)
    table["step"] = table.groupby("elongation_mm").cumcount()
    run = fitted(tmp_path, model, table)
    loads = run.invert(pd.DataFrame({"elongation_mm": [-4.0], "twist_deg": 0.0, "pressure_kpa": 150.0})).filled.iloc[0]
    assert np.isfinite(loads[["force_n", "force_n_low", "moment_nmm"]].astype(float)).all()
    assert np.isnan(loads["moment_nmm_low"])
    given = {"pressure_kpa": [150.0], "force_n": [loads["force_n"]]}
    free = run.invert(pd.DataFrame({**given, "moment_nmm": 0.0})).filled.iloc[0]
    assert free["twist_deg"] == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(free["twist_deg_low"])
    held = run.invert(pd.DataFrame({**given, "twist_deg": 0.0})).filled.iloc[0]
    assert held["elongation_mm"] == pytest.approx(-4.0)
    assert np.isfinite(held["elongation_mm_low"])
    assert np.isnan(held["moment_nmm_low"])


@pytest.mark.slow
@pytest.mark.nightly
def test_where_a_length_was_never_measured_the_twist_alone_has_a_band(tmp_path):
    """Torsion under dead loads of an actuator whose length nobody read."""
    table = beds.dead_load({}).query("sample == 2").assign(bed="dead_load").reset_index(drop=True)
    model = continuum(c1=beds.C1, c2=beds.C2)
    blind = fitted(tmp_path / "blind", model, table)
    question = pd.DataFrame({"pressure_kpa": [20.0], "force_n": 0.0, "moment_nmm": 30.0})
    row = blind.invert(question).filled.iloc[0]
    assert row["status"] == "ok"
    assert np.isfinite(row["twist_deg_low"])
    assert np.isnan(row["elongation_mm_low"])
    both = fitted(tmp_path / "both", model, beds.dead_load({}).query("sample == 1").assign(bed="dead_load"))
    row = both.invert(question).filled.iloc[0]
    assert np.isfinite(row[["twist_deg_low", "elongation_mm_low"]].astype(float)).all()


@pytest.mark.slow
@pytest.mark.nightly
def test_under_hung_loads_the_bands_hold_what_the_bed_reads(tmp_path):
    model = continuum(c1=beds.C1, c2=beds.C2)
    tables = [beds.dead_load({}, seed).query("sample == 1") for seed in range(26)]
    own = pd.concat([t.assign(bed="dead_load") for t in tables[:13]], ignore_index=True)
    new = pd.concat([t.assign(bed="dead_load") for t in tables[13:]], ignore_index=True)
    run = fitted(tmp_path, model, own)
    answers = run.invert(new.drop(columns=["step", "bed", *PLACE]))
    # Of 52 loads as hung, each with an error that its rows share: a share of 0.95 ± 0.03.
    for name in PLACE:
        assert 0.9 <= covered(answers, new, name) <= 0.99, name


def test_a_network_speaks_by_the_rows_that_it_did_not_see(tmp_path):
    """It fits the rows that it saw as well as it likes: only the others say how far it misses."""
    network = build_model("mlp")
    torch.manual_seed(0)
    network.set_vector(0.3 * torch.randn(62, dtype=torch.float64))
    table = measured(continuum(), 400, 3)
    network.prepare(Rows.from_table(table))
    table = shown(network, table)
    split = np.where(np.arange(400) % 2 == 0, "train", "test")
    off = np.where(split == "test", 1.0, 0.0) * np.random.default_rng(0).normal(size=400)
    run = fitted(tmp_path, network, table.assign(force_n=table["force_n"] + 5 * off), split=split)
    row = run.invert(table[[*PLACE, "pressure_kpa"]].iloc[:1]).filled.iloc[0]
    half = (row["force_n_high"] - row["force_n_low"]) / 2
    assert half == pytest.approx(1.96 * 5, rel=0.2)
