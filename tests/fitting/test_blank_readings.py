"""Fits to readings with blanks and censored rows: SciPy on what is left, degrees of freedom, every bed."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hidden_beds import ALONE, BLOCK, MATERIAL, blanked, model_of, rows_of, table_of
from nightly import usually
from scipy.optimize import least_squares

from freelearn.data.beds import BED, ISOMETRIC
from freelearn.data.error import set_error
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.numpy_peer import continuum
from freelearn.testing.small_tables import random_table

LM = FitOptions("levenberg_marquardt", max_epochs=300, restarts=1, patience=6)
TRUE = 8e5, 2e7
COLUMNS = ("fiber_angle", "reference_length", "inner_radius", "outer_radius", "length", "twist", "pressure")


def fitted(model, rows: Rows):
    fit(model, rows, rows[torch.zeros(0, dtype=torch.int64)], LM, seed=0)
    return model


def measured(seed: int = 0, count: int = 80, blank: float = 0.4, slack: float = 0.0) -> Rows:
    """Rows of the paper's samples with noise of 2 %; a share of readings blank, and of the pushing rows slack: what
    hangs loose shows no force."""
    generator = np.random.default_rng(seed)
    states = States.from_table(random_table(count, seed))
    value = true_loads(states, *TRUE)
    value = value + 0.02 * np.abs(value).max(0) * generator.normal(size=value.shape)
    present = generator.random(value.shape) >= blank
    loose = (value[:, 0] > 0) & (generator.random(count) < slack)
    value[loose, 0] = 0.0
    present[loose] = [True, False]
    value = np.where(present, value, 0.0)
    return Rows(states, Readings(*map(torch.as_tensor, (value, present, loose))), np.arange(count))


def true_loads(states: States, c1: float, c2: float) -> np.ndarray:
    """By the vectorized NumPy of the benchmarks."""
    return np.stack(continuum(*(getattr(states, c).numpy() for c in COLUMNS), c1, c2), axis=1)


def by_scipy(rows: Rows):
    """Least squares in (ln C1, ln C2) over the readings that there are, nothing else in the vector of residuals."""
    told, value = rows.readings.present.numpy(), rows.readings.value.numpy()
    scale, loose = np.abs(value).max(0), rows.readings.slack.numpy()

    def residual(x: np.ndarray) -> np.ndarray:
        missed = (true_loads(rows.states, *np.exp(x)) - value) / scale
        missed[loose, 0] = np.minimum(missed[loose, 0], 0.0)
        return missed[told]

    return least_squares(residual, np.log([5e5, 1e7]), xtol=1e-14, ftol=1e-14, gtol=1e-14)


@pytest.mark.parametrize("slack", [0.0, 0.5])
def test_a_fit_is_scipys_on_what_is_left(slack):
    """Eight quadrature points of the peer are good for 1e-9, both solvers for 1e-6."""
    rows = measured(slack=slack)
    assert bool(rows.readings.slack.any()) == bool(slack)
    model = fitted(build_model("continuum"), rows)
    expected = by_scipy(rows)
    np.testing.assert_allclose(list(model.scalars().values()), np.exp(expected.x), rtol=1e-5)
    problem = Problem(model, rows)
    assert float(problem.residual(model.vector().detach()).square().sum()) == pytest.approx(2 * expected.cost, rel=1e-6)


def test_a_blank_reading_changes_nothing_whatever_was_there():
    rows = measured()
    other = Readings(
        torch.where(rows.readings.present, rows.readings.value, 1e9), rows.readings.present, rows.readings.slack
    )
    scale = rows.readings.value.abs().amax(0)
    vector = build_model("continuum", {"C1": 4e5, "C2": 1e7}).vector().detach()
    one, two = (Problem(build_model("continuum"), replace(rows, readings=r), scale) for r in (rows.readings, other))
    assert torch.equal(one.residual(vector), two.residual(vector))
    assert torch.equal(one.jacobians(vector[None]), two.jacobians(vector[None]))
    blank = ~rows.readings.present.reshape(-1)
    assert (one.residual(vector)[blank] == 0).all()
    assert (one.jacobians(vector[None])[0][blank] == 0).all()


def test_rows_without_any_reading_change_nothing():
    rows = measured()
    empty = (~rows.readings.present).all(1)
    assert empty.sum() > 5
    with_them, without = (fitted(build_model("continuum"), r) for r in (rows, rows[~empty]))
    np.testing.assert_allclose(list(with_them.scalars().values()), list(without.scalars().values()), rtol=1e-6)


@pytest.mark.parametrize("effects", [[], ["pressure_gain"]])
def test_derivatives_of_censored_and_blank_residuals_are_those_of_differences(effects):
    """By hand and by autograd; no reading lies within a step of its kink."""
    rows, model = measured(slack=0.5), build_model("continuum", {"C1": 4e5, "C2": 1e7}, effects)
    problem, vector = Problem(model, rows), model.vector().detach()
    jacobian = problem.jacobians(vector[None])[0]
    for i in range(len(vector)):
        step = torch.zeros_like(vector)
        step[i] = 1e-5
        with torch.no_grad():
            slope = (problem.residual(vector + step) - problem.residual(vector - step)) / 2e-5
        torch.testing.assert_close(jacobian[:, i], slope, rtol=1e-5, atol=1e-7 * float(slope.abs().max()))
    loose = rows.readings.slack & (model(rows.states).loads[:, 0] > 0)
    assert loose.any()
    assert (jacobian.reshape(-1, 2, len(vector))[loose, 0] == 0).all()


def test_slack_rows_that_pull_count_in_full():
    """Marked loose although the model pulls there: as a whole reading."""
    rows = measured(blank=0.0)
    pulls = true_loads(rows.states, *TRUE)[:, 0] < -1.0
    value = rows.readings.value.clone()
    value[torch.as_tensor(pulls), 0] = 0.0
    told = torch.ones_like(value, dtype=torch.bool)
    vector = build_model("continuum", dict(zip(("C1", "C2"), TRUE, strict=True))).vector().detach()
    marked, whole = (
        Problem(build_model("continuum"), replace(rows, readings=Readings(value, told, torch.as_tensor(loose))))
        for loose in (pulls, np.zeros_like(pulls))
    )
    assert pulls.sum() > 10
    assert torch.equal(marked.residual(vector), whole.residual(vector))
    assert torch.equal(marked.jacobians(vector[None]), whole.jacobians(vector[None]))


def test_an_isometric_bed_is_a_kinematic_one_whose_moments_are_blank():
    table = table_of("isometric", seed=1, coarse=2)
    isometric = rows_of(table)
    kinematic = rows_of(table.drop(columns=BED).assign(moment_nmm=np.nan))
    assert isometric.states.bed is ISOMETRIC
    one, other = (fitted(build_model("continuum"), rows) for rows in (isometric, kinematic))
    np.testing.assert_allclose(list(one.scalars().values()), list(other.scalars().values()), rtol=1e-12)
    first, second = (uncertainty(Problem(m, r)) for m, r in ((one, isometric), (other, kinematic)))
    np.testing.assert_allclose(first.stderr, second.stderr, rtol=1e-9)


def test_standard_errors_count_the_readings_that_there_are():
    """s² (JᵀJ)⁻¹ of SciPy's own Jacobian over its own residuals; C as of ln C."""
    rows = measured(slack=0.3)
    model = fitted(build_model("continuum"), rows)
    found, expected = uncertainty(Problem(model, rows)), by_scipy(rows)
    count = int(rows.readings.present.sum())
    assert len(expected.fun) == count == found.residuals
    covariance = 2 * expected.cost / (count - 2) * np.linalg.inv(expected.jac.T @ expected.jac)
    np.testing.assert_allclose(found.stderr_independent, np.exp(expected.x) * np.sqrt(covariance.diagonal()), rtol=1e-3)
    assert found.chi_square == pytest.approx(2 * expected.cost, rel=1e-6)


# Coming to rest under a load takes long.
QUICKER = usually(*(bed for bed in (*ALONE, BLOCK) if bed != "dead_load"), nightly=["dead_load"])


@pytest.mark.parametrize("bed", [*ALONE, BLOCK])
def test_a_fit_on_each_bed_finds_the_reference_beds_moduli(bed):
    """Within five of its own standard errors, which are at most a few percent."""
    table = table_of(bed, seed=2)
    model = fitted(model_of(table), rows_of(table))
    told = uncertainty(Problem(model, rows_of(table)))
    truth = np.array(MATERIAL)
    assert (np.abs(told.values - truth) < 5 * told.stderr + 1e-4 * truth).all()
    assert (told.stderr < 0.1 * truth).all()


@pytest.mark.parametrize("bed", QUICKER)
@pytest.mark.parametrize("name", ["linear", "continuum_inextensible"])
def test_every_model_starts_and_ends_on_every_bed(bed, name):
    """Also with two readings in five blank. They are wrong models of these data, but not worse than saying zero."""
    table = table_of(bed, seed=3, coarse=2)
    columns = [c for c in ("force_n", "moment_nmm") if c in table and bed != "dead_load"] or ["elongation_mm"]
    rows = rows_of(blanked(table, columns, 0.4, 3))
    model = fitted(model_of(table, name=name), rows)
    problem = Problem(model, rows)
    with torch.no_grad():
        usable = model(rows.states).status == 0
        left = problem.residual(model.vector()).reshape(-1, 2)[usable].square().sum()
    nothing_said = (rows.readings.value / problem.scale)[usable].square().sum()
    assert usable.sum() > 20
    assert left < nothing_said


@pytest.mark.parametrize("bed", QUICKER)
def test_a_network_learns_each_bed_from_what_is_not_blank(bed):
    """Whatever the bed measures, by itself; four readings in ten blank. On rows it never saw it does better than the
    mean would (E of a constant is about a half)."""
    columns = ["elongation_mm", "twist_deg"] if bed == "dead_load" else ["force_n"]
    rows = rows_of(blanked(table_of(bed, seed=5), columns, 0.4, 5))
    model, part = model_of(table_of(bed, seed=5, coarse=4), name="mlp"), np.random.default_rng(1).permutation(len(rows))
    train, validation, test = (rows[torch.as_tensor(np.sort(p))] for p in np.split(part, [len(rows) * 6 // 10, -40]))
    fit(model, train, validation, replace(LM, max_epochs=60), seed=0)
    with torch.no_grad():
        error = set_error(test, model(test.states).loads, torch.ones(len(test), dtype=torch.bool))
    assert error.E < 0.25


def test_a_stiffness_that_no_reading_tells_stays_as_it_was():
    """A muscle that is never twisted, its force alone measured: kb and kc act on nothing."""
    table = table_of("isometric", seed=4, coarse=2)
    own = {"ka": 1e3, "kb": 0.3, "kc": 0.5}
    model = build_model("linear", own)
    model = fitted(model, rows_of(table))
    found = uncertainty(Problem(model, rows_of(table)))
    assert model.scalars()["kb"] == pytest.approx(0.3)
    assert np.isfinite(found.stderr).tolist() == [True, False, False]
