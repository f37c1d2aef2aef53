"""Fits in which parameters are fixed, bounded, or known beforehand."""

import numpy as np
import pytest
import torch
from scipy.optimize import least_squares
from test_fit import LM, nothing, rows_from

from freelearn.common.errors import UserError
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem, Pull
from freelearn.fitting.profiles import profiled
from freelearn.fitting.store import fit_key
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.stated_knowledge import stated


@pytest.fixture(scope="module")
def rows():
    return rows_from(Continuum(3e5, 2e7), noise=0.03)


def fitted(rows, known, values=None, name="continuum", effects=()):
    model = build_model(name, values, effects, known=known)
    fit(model, rows, nothing(rows), LM, seed=0)
    return model, uncertainty(Problem(model, rows))


def test_what_is_fixed_stays_and_the_rest_is_the_fit_of_the_smaller_problem(rows):
    model, u = fitted(rows, Known(fixed=("C2",)), {"C2": 1e7})
    assert model.scalars()["C2"] == 1e7

    def residual(raw):
        vector = torch.tensor([raw[0], np.log(1e7)], dtype=torch.float64)
        with torch.no_grad():
            return Problem(Continuum(), rows).residual(vector).numpy()

    peer = least_squares(residual, [np.log(3e5)], xtol=1e-12, ftol=1e-12)
    assert model.scalars()["C1"] == pytest.approx(float(np.exp(peer.x[0])), rel=1e-5)
    assert u.stderr[1] == u.stderr_independent[1] == 0
    assert (u.low[1], u.high[1]) == (1e7, 1e7)
    # Of one parameter in 2n numbers.
    spread = 2 * peer.cost / (u.residuals - 1) / float((peer.jac**2).sum())
    assert u.stderr_independent[0] == pytest.approx(model.scalars()["C1"] * spread**0.5, rel=1e-4)
    assert np.isfinite(u.covariance).all()


def test_an_effect_may_be_held_and_a_bound_holds(rows):
    known = Known(starts={"twist_offset.angle": 0.05}, fixed=("twist_offset.angle",), bounds={"C1": (1e5, 2e5)})
    model, u = fitted(rows, known, effects=["twist_offset"])
    assert model.scalars()["twist_offset.angle"] == 0.05
    assert model.scalars()["C1"] == pytest.approx(2e5)
    assert u.stderr[2] == 0


def test_profiles_leave_out_what_is_fixed(rows):
    model, u = fitted(rows, Known(fixed=("C2",)), {"C2": 2e7})
    with_profiles = profiled(Problem(model, rows), u)
    assert with_profiles.kinds == ["profile", "normal"]
    assert with_profiles.low[0] < model.scalars()["C1"] < with_profiles.high[0]


@pytest.mark.parametrize("name", ["continuum", "continuum_thin_wall"])
def test_a_prior_pulls_by_as_much_as_it_is_sure(rows, name):
    free, _ = fitted(rows, None, name=name)
    found = free.scalars()["C1"]
    pulled = []
    for error in (1e3, 1e5, 1e8):
        known = stated(name, values={"C1": 2 * found}, errors={"C1": error})
        model, u = fitted(rows, known, name=name)
        pulled.append(model.scalars()["C1"])
        assert u.stderr[0] < 1.2 * error
    assert pulled[0] == pytest.approx(2 * found, rel=0.02)
    assert found < pulled[1] < pulled[0]
    assert pulled[2] == pytest.approx(found, rel=1e-2)


def test_the_most_probable_parameters_have_no_slope_left(rows):
    known = stated("continuum", values={"C1": 5e5}, errors={"C1": 5e4})
    free, _ = fitted(rows, None)
    weighed = Pull.from_problem(Problem(build_model("continuum", known=known), rows), free.vector().detach())
    model, _ = fitted(rows, known)
    vector = model.vector().detach()
    problem = Problem(model, rows)
    slope = problem.jacobians(vector[None])[0].T @ problem.residual(vector).detach()
    own = weighed.root.T @ weighed.residuals(vector[None])[0]
    assert float((slope + own).norm()) < 1e-5 * float(own.norm())


def test_what_is_known_needs_levenberg_marquardt(rows):
    model = build_model("continuum", known=stated("continuum", of="latex"))
    with pytest.raises(UserError, match="levenberg_marquardt"):
        fit(model, rows, nothing(rows), FitOptions("adam", max_epochs=2, restarts=1, patience=2), seed=0)


def test_a_kept_fit_is_of_what_was_known(rows):
    known = [None, Known(fixed=("C2",)), Known(bounds={"C1": (1e4, 1e6)}), stated("continuum", of="latex")]
    keys = {fit_key(build_model("continuum", known=k), rows, nothing(rows), LM, 0) for k in known}
    assert len(keys) == len(known)
