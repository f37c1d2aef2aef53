"""Many rows are evaluated in pieces: the same fit, the same standard errors, whatever the bed and the blanks."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from freelearn.data.accuracy import PAPER
from freelearn.data.beds import BED, DEAD_LOAD, INFLATION
from freelearn.data.rows import Rows
from freelearn.discovery.noise.noise import Whitener, sensitivities, variances
from freelearn.fitting import problem
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.trust_region import reduced
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.testing.small_tables import random_table

OPTIONS = FitOptions("levenberg_marquardt", max_epochs=60, restarts=2, patience=20)
ROWS = 300


def measured(model: Model, bed: str = "kinematic", blank: bool = False) -> Rows:
    """Rows with the model's own loads, and noise on them."""
    table = random_table(ROWS, seed=3)
    if bed != "kinematic":
        table[BED] = bed
        table["outer_diameter_mm"] = 2 * table["outer_radius_mm"]
    rows = Rows.from_table(table)
    with torch.no_grad():
        shown = model(rows.states).loads.numpy()
    shown = shown + np.random.default_rng(0).normal(0, 0.01, shown.shape) * np.abs(shown).max(0)
    for i, quantity in enumerate(rows.states.bed.readings):
        table[quantity.column] = shown[:, i] / quantity.factor
    if blank:
        table.loc[::4, "moment_nmm"] = np.nan
        table["slack"] = (np.arange(ROWS) % 5 == 0).astype(int)
    return Rows.from_table(table)


def answered(model, vectors, rows):
    """Rows that come to rest at every vector: where there is no rest, a search ends where its way there led it."""
    with torch.no_grad():
        found = [model.chain(rows.states, model.physical(vector)).status == Status.OK for vector in vectors]
    kept = torch.stack(found).all(0)
    assert int(kept.sum()) > 150
    return rows[torch.nonzero(kept)[:, 0]]


@pytest.fixture
def in_pieces(monkeypatch):
    monkeypatch.setattr(problem, "MANY_ROWS", 100)
    monkeypatch.setattr(problem, "PIECE", 64)


CASES = {
    "continuum": ("continuum", (), "kinematic", False),
    "blanks": ("continuum", (), "kinematic", True),
    "effect": ("continuum", ("force_gain", "relaxation"), "kinematic", False),
    "linear": ("linear", (), "kinematic", False),
    "dead load": ("linear", (), DEAD_LOAD.name, False),
    "inflation": ("continuum", (), INFLATION.name, False),
}
# Its loads come to rest at each step of a fit.
LONG = ["dead load"]


@pytest.mark.parametrize(("name", "effects", "bed", "blank"), CASES.values(), ids=CASES)
def test_residuals_and_derivatives_of_pieces_are_those_of_the_whole(name, effects, bed, blank, in_pieces, monkeypatch):
    model = build_model(name, {}, effects)
    vectors = model.vector().detach() + torch.tensor([[0.0], [0.02], [-0.03]], dtype=torch.float64)
    rows = answered(model, vectors, measured(model, bed, blank))
    for some in (vectors[:1], vectors):
        parted = Problem(model, rows)
        assert parted.parted
        with monkeypatch.context() as whole:
            whole.setattr(problem, "MANY_ROWS", 10**9)
            whole = Problem(model, rows)
            assert not whole.parted
        with torch.no_grad():
            residuals, jacobians = whole.residuals(some), whole.jacobians(some)
            torch.testing.assert_close(parted.residuals(some), residuals, rtol=1e-9, atol=1e-12)
        pieces = list(parted.pieces(some))
        assert len(pieces) == -(-len(rows) // 64)
        torch.testing.assert_close(torch.cat(pieces, dim=1), jacobians, rtol=1e-7, atol=1e-10)
        # ‖J p‖² and rᵀJ p are all that a step depends on.
        found = reduced(parted.pieces(some), residuals)
        torch.testing.assert_close(found.factor.mT @ found.factor, jacobians.mT @ jacobians, rtol=1e-7, atol=1e-9)
        torch.testing.assert_close(
            (found.factor.mT @ found.projection[..., None])[..., 0],
            (jacobians.mT @ residuals[..., None])[..., 0], rtol=1e-7, atol=1e-8,
        )  # fmt: skip
        torch.testing.assert_close(found.columns, jacobians.norm(dim=1), rtol=1e-7, atol=1e-10)


@pytest.mark.parametrize(
    ("name", "effects", "bed", "blank"),
    [pytest.param(*case, id=name, marks=pytest.mark.nightly if name in LONG else []) for name, case in CASES.items()],
)
def test_a_fit_in_pieces_ends_where_the_whole_one_does(name, effects, bed, blank, monkeypatch):
    truth = build_model(name, {}, effects)
    rows = measured(truth, bed, blank)
    none = rows[torch.zeros(0, dtype=torch.int64)]
    found = []
    for many in (10**9, 100):
        monkeypatch.setattr(problem, "MANY_ROWS", many)
        monkeypatch.setattr(problem, "PIECE", 64)
        model = build_model(name, {}, effects)
        outcome = fit(model, rows, none, OPTIONS, seed=0)
        found.append((outcome, uncertainty(Problem(model, rows[torch.as_tensor(outcome.kept)]))))
    (whole, known), (parted, known_parted) = found
    assert whole.converged
    assert parted.converged
    np.testing.assert_array_equal(parted.kept, whole.kept)
    small = 1e-5 * known.stderr
    np.testing.assert_array_less(
        np.abs(known_parted.values - known.values), np.where(np.isfinite(small), small, np.inf) + 1e-12
    )
    for what in ("stderr", "stderr_independent", "covariance", "low", "high", "chi_square"):
        np.testing.assert_allclose(getattr(known_parted, what), getattr(known, what), rtol=1e-5)
    for what in ("freedom", "residuals", "rows", "names"):
        assert getattr(known_parted, what) == getattr(known, what)


def test_a_piece_that_is_not_finite_is_no_start(in_pieces):
    """The search says so, as it does of a whole Jacobian."""
    from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
    from freelearn.fitting.solver import Termination

    target = torch.linspace(1, 2, 10, dtype=torch.float64)

    def residual(x):
        return x[:, :1] * target - 1

    def pieces(x, broken=torch.nan):
        yield (target[:4] * broken)[None, :, None]
        yield target[4:][None, :, None]

    def solved(made):
        return LevenbergMarquardt(residual, pieces=made, batched=True).solve(torch.ones(1, 1, dtype=torch.float64))

    assert int(solved(pieces).status) == Termination.INVALID_START
    done = solved(lambda x: pieces(x, 1.0))
    assert Termination(int(done.status)).converged
    assert float(done.x) == pytest.approx(float(target.sum() / target.square().sum()), rel=1e-12)


@pytest.mark.parametrize("bed", ["kinematic", INFLATION.name])
def test_variances_are_the_whiteners(bed):
    model = build_model("continuum", {}, ())
    rows = measured(model, bed, blank=bed == "kinematic")
    present = rows.readings.present
    whiten = Whitener(
        sensitivities(model, rows.states), torch.as_tensor(rows.state), PAPER, bed=rows.states.bed, present=present
    )
    assert torch.equal(variances(model, rows.states, PAPER, present), whiten.variance)


def test_what_rows_remember_is_made_when_it_is_asked_for_and_then_the_same():
    states = Rows.from_table(random_table(ROWS, seed=3)).states
    some = torch.arange(0, ROWS, 7)
    part = states[some].replace(twist=states.twist[some])[2:9]
    assert "past_severity" not in vars(states)
    assert "past_severity" not in vars(part)
    for name in ("clock", "dwell", "moved_length", "moved_twist", "severity", "past_severity"):
        assert torch.equal(getattr(part, name), getattr(states, name)[some][2:9])
    assert float(states.clock.max()) > 0
    changed = states.replace(clock=states.clock + 1)
    assert torch.equal(changed[some].clock, states.clock[some] + 1)
    assert torch.equal(changed[some].dwell, states.dwell[some])
    with pytest.raises(AttributeError):
        states.unknown  # noqa: B018
