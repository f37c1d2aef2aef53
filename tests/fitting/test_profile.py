"""Profile intervals beside lmfit's, profiles made by hand, normal intervals where these are exact, and the truth."""

from dataclasses import replace

import lmfit
import nist
import numpy as np
import pytest
import torch
from decays import Cliff, Decay, Line, Ripple, Rough, SlowDecay, Sum, Unidentified, fitted, forces
from scipy.optimize import brentq, least_squares
from scipy.stats import f as fisher
from scipy.stats import t as student

from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.fitting import profile_end
from freelearn.fitting.fit import fit
from freelearn.fitting.options import NORMAL, PROFILE, FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.profile_allowance import Allowance
from freelearn.fitting.profile_end import Ending, EndSearch, Limit
from freelearn.fitting.profile_line import Coordinate, Quantity, Spot, Squares
from freelearn.fitting.profiles import profiled
from freelearn.fitting.uncertainty import Uncertainty, uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.testing.small_tables import random_table

STATES, ROWS = 8, 3
X = np.linspace(0, 3, STATES * ROWS)
STATE = np.arange(STATES * ROWS) // ROWS
DECAY = 2 * np.exp(-X)


def errors(seed: int = 0, size: float = 0.1) -> np.ndarray:
    """Mostly shared by the rows of a state."""
    generator = np.random.default_rng(seed)
    return size * (generator.normal(size=STATES)[STATE] + 0.5 * generator.normal(size=len(X)))


def both(problem: Problem) -> tuple[Uncertainty, Uncertainty]:
    """Normal and profile intervals."""
    known = uncertainty(problem)
    return known, profiled(problem, known)


def words(told: Uncertainty, name: str) -> str:
    return told.words[told.names.index(name)]


def ends(told: Uncertainty, name: str) -> tuple[float, float]:
    i = told.names.index(name)
    return float(told.low[i]), float(told.high[i])


def table_fit(
    name: str, effects: list[str], noise: float, count: int = 150, per_sample: bool = False, **truth: float
) -> Problem:
    """A fit to loads that the bare model itself makes of `truth`, with noise."""
    table = random_table(count, 0)
    states = States.from_table(table)
    with torch.no_grad():
        loads, status = build_model(name, truth, [])(states)
    generator = torch.Generator().manual_seed(0)
    loads = loads + noise * loads.abs().amax(0) * torch.randn(loads.shape, dtype=loads.dtype, generator=generator)
    samples = sorted(set(table["sample"])) if per_sample else []
    model: Model = build_model(name, truth, effects, samples)
    problem = Problem(model, Rows.whole(states, loads, kinematic_state(table))[status == Status.OK])
    model.set_vector(Squares.from_problem(problem).least(model.vector().detach()).x)
    return problem


TUBE = {"C1": 1e6, "C2": 2e7}


# --- where the answer is known -------------------------------------------------------------------------------------


def test_of_a_linear_model_they_are_the_normal_ones_errors_shared_or_not():
    for state in (STATE, None):
        known, told = both(fitted(Line(), forces(X, 1 + 0.5 * X + errors(), state)))
        assert told.kinds == [PROFILE, PROFILE]
        np.testing.assert_allclose([told.low, told.high], [known.low, known.high], rtol=1e-9)
        assert told.words == ["", ""]
        assert told.remark == ""
        np.testing.assert_array_equal(told.stderr, known.stderr)


def test_a_stiffness_matrix_has_those_of_its_entries():
    """ka, kb and kc are linear in the loads, but no raw parameter is one of them."""
    known, told = both(table_fit("linear", [], 0.02, ka=1e3, kb=0.1, kc=0.0))
    np.testing.assert_allclose([told.low, told.high], [known.low, known.high], rtol=1e-4)
    assert told.kinds == [PROFILE] * 3


def by_hand(x: np.ndarray, force: np.ndarray, state: np.ndarray) -> tuple[float, float, float, float]:
    """The profile of k in A exp(−k x), in NumPy: k, both ends, and by how much the sum may rise.

    The best A at each k is that of a straight line; the curvature has the residuals' second derivatives."""

    def best(k: float) -> tuple[float, np.ndarray]:
        shape = np.exp(-k * x)
        a = shape @ force / (shape @ shape)
        return a, a * shape - force

    def total(k: float) -> float:
        return float(np.square(best(k)[1]).sum())

    k = least_squares(lambda v: best(v[0])[1], [1.0], xtol=1e-15, ftol=1e-15, gtol=1e-15).x[0]
    a, residual = best(k)
    shape = np.exp(-k * x)
    jacobian = np.stack([shape, -a * x * shape], axis=1)
    second = np.array([[0 * x, -x * shape], [-x * shape, a * x * x * shape]]) @ residual
    bread = np.linalg.inv(jacobian.T @ jacobian + second)
    scores = np.array([(jacobian * residual[:, None])[state == s].sum(0) for s in np.unique(state)])
    count = len(scores)
    robust = bread @ scores.T @ scores @ bread * count / (count - 2)
    rise = student.ppf(0.975, count - 2) ** 2 * robust[1, 1] / bread[1, 1]
    goal = total(k) + rise
    low, high = (brentq(lambda v: total(v) - goal, k, end, xtol=1e-14) for end in (1e-3, 20.0))
    return k, low, high, rise


@pytest.mark.parametrize("state", [STATE, np.arange(len(X))])
def test_a_rate_has_the_ends_of_the_profile_made_by_hand(state):
    force = DECAY + errors(1, 0.3)
    k, *expected, _ = by_hand(X, force, state)
    problem = fitted(Decay(), forces(X, force, state))
    known, told = both(problem)
    assert problem.model.scalars()["k"] == pytest.approx(k, rel=1e-7)
    assert ends(told, "k") == pytest.approx(expected, rel=2e-5)
    # Not what the normal interval says.
    assert np.abs(np.log(np.array(ends(known, "k")) / expected)).max() > 0.01


def test_they_are_the_same_in_whatever_form_a_parameter_is_fitted():
    """k as a logarithm, and τ = 1/k as it is: normal intervals differ, these do not."""
    rows = forces(X, DECAY + errors(1, 0.2), STATE)
    (_, rate), (known, time) = both(fitted(Decay(), rows)), both(fitted(SlowDecay(), rows))
    np.testing.assert_allclose(ends(rate, "k"), 1 / np.array(ends(time, "tau"))[::-1], rtol=2e-5)
    np.testing.assert_allclose(ends(rate, "A"), ends(time, "A"), rtol=2e-5)
    assert abs(ends(known, "tau")[0] * ends(rate, "k")[1] - 1) > 0.01


def test_lmfit_finds_the_same_ends_for_the_same_rise():
    """Every row a state of its own; lmfit's F test is asked for the probability of the rise."""
    force = DECAY + 0.15 * np.random.default_rng(2).normal(size=len(X))
    _, told = both(fitted(Decay(), forces(X, force)))

    def residual(p: lmfit.Parameters) -> np.ndarray:
        return p["A"].value * np.exp(-np.exp(p["u"].value) * X) - force

    start = lmfit.Parameters()
    start.add("A", 2.0)
    start.add("u", 0.0)
    minimizer = lmfit.Minimizer(residual, start)
    result = minimizer.minimize(ftol=1e-14, xtol=1e-14)
    *_, rise = by_hand(X, force, np.arange(len(X)))
    probability = fisher.cdf(rise / (result.chisqr / result.nfree), 1, result.nfree)
    found = lmfit.conf_interval(minimizer, result, p_names=["u"], sigmas=[probability])
    (_, low), _, (_, high) = found["u"]
    assert ends(told, "k") == pytest.approx((np.exp(low), np.exp(high)), rel=1e-3)


@pytest.mark.parametrize("name", ["Misra1a", "Chwirut2", "DanWood", "Rat42", "BoxBOD", "Misra1d", "Eckerle4"])
def test_certified_problems_have_the_ends_that_lmfit_finds(name):
    """NIST's StRD from the certified values, 95 %, by the F test."""
    problem = nist.read(name)
    sizes = problem.certified.abs()
    free = len(problem.y) - len(sizes)
    rise = problem.rss / free * student.ppf(0.975, free) ** 2

    def residuals(vectors: torch.Tensor) -> torch.Tensor:
        return torch.stack([problem.residual(v * sizes) for v in vectors])

    def jacobians(vectors: torch.Tensor) -> torch.Tensor:
        return torch.stack([torch.func.jacfwd(lambda v: problem.residual(v * sizes))(v) for v in vectors])

    infinite = torch.full_like(sizes, torch.inf)
    squares = Squares(residuals, jacobians, -infinite, infinite)
    center = squares.least(problem.certified / sizes)
    covariance = torch.linalg.inv(center.jacobian.T @ center.jacobian)
    start = lmfit.Parameters()
    for i, value in enumerate(problem.certified.tolist()):
        start.add(f"b{i}", value)
    minimizer = lmfit.Minimizer(
        lambda p: problem.residual(torch.tensor([p[f"b{i}"].value for i in range(len(sizes))])).numpy(), start
    )
    found = lmfit.conf_interval(minimizer, minimizer.minimize(ftol=1e-14, xtol=1e-14), sigmas=[0.95])
    for i, size in enumerate(sizes.tolist()):
        line = Coordinate(i)
        reach = float((rise * covariance[i, i]).sqrt())
        spot = Spot(line.place(center.x), float(center.loss), center.x, True)
        allowance = Allowance(rise, reach, covariance[:, i] / covariance[i, i])
        search = EndSearch(squares, line, spot, allowance, reach, lambda v: v, False, lambda v: True)
        for side, (_, expected) in ((-1, found[f"b{i}"][0]), (1, found[f"b{i}"][2])):
            end = search.toward(Limit(spot.place + side * 1e3, Ending.OPEN), reach)
            assert end.ending is Ending.FOUND
            # lmfit stops its search at a probability within 1e-3 of the goal's.
            assert abs(end.place * size - expected) < 0.01 * reach * size


def test_where_a_model_misfits_they_are_as_wide_as_refits_to_other_states_scatter():
    """The curvature of the sum of squares is not JᵀJ there: bootstrap over the kinematic states."""
    generator = np.random.default_rng(0)
    states, rows = 60, 2
    state = np.arange(states * rows) // rows
    x = generator.uniform(0, 3, states)[state]
    force = 2 / (1 + x) ** 4 + 0.7 + 0.02 * generator.normal(size=len(x))
    problem = fitted(Decay(), forces(x, force, state))
    known, told = both(problem)
    found = []
    for _ in range(300):
        place = np.concatenate([np.flatnonzero(state == s) for s in generator.integers(states, size=states)])

        def residual(v: np.ndarray, place: np.ndarray = place) -> np.ndarray:
            return v[0] * np.exp(-np.exp(v[1]) * x[place]) - force[place]

        found.append(least_squares(residual, problem.model.vector().detach().numpy()).x[1])
    width = np.subtract(*np.percentile(found, [97.5, 2.5]))
    assert np.log(ends(told, "k")[1] / ends(told, "k")[0]) == pytest.approx(width, rel=0.15)
    assert abs(np.log(ends(known, "k")[1] / ends(known, "k")[0]) / width - 1) > 0.2


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("kind", "name", "truth", "count"), [(Line, "b", 0.03, 200), (Decay, "k", 1.0, 200), (Sum, "B", 0.01, 120)]
)
def test_they_cover_the_truth_as_often_as_they_say(kind, name, truth, count):
    """A logarithm that is well known, a bounded parameter 1 σ from its bound, a positive one that may be nothing."""
    states, rows, covered = 20, 3, []
    x = np.linspace(0, 3, states * rows)
    state = np.arange(states * rows) // rows
    force = {Decay: 2 * np.exp(-x), Line: 1 + 0.03 * x, Sum: 1 + 0.01 * x**2}[kind]
    for seed in range(count):
        generator = np.random.default_rng(seed)
        noise = 0.1 * (generator.normal(size=states)[state] + 0.5 * generator.normal(size=len(x)))
        _, told = both(fitted(kind(), forces(x, force + noise, state)))
        low, high = ends(told, name)
        covered.append(low <= truth <= high)
    assert 0.92 <= np.mean(covered) <= 0.99


# --- bounds, open sides, what rows do not tell ---------------------------------------------------------------------


def test_an_interval_ends_at_a_bound_and_says_so():
    known, told = both(fitted(Line(), forces(X, 1 + 0.02 * X + errors(2), STATE)))
    assert ends(known, "b")[0] < 0
    assert ends(told, "b") == pytest.approx((0.0, ends(known, "b")[1]), rel=1e-6)
    assert words(told, "b") == "its interval ends at the bound 0 N"
    # A line that has to fall is no line of this model: the fit is at the bound itself.
    problem = fitted(Line(), forces(X, 1 - 0.05 * X + errors(2), STATE))
    assert problem.model.scalars()["b"] == 0
    _, told = both(problem)
    low, high = ends(told, "b")
    assert low == 0 < high < 0.1
    assert "bound 0 N" in words(told, "b")


@pytest.mark.parametrize("value", [-0.05, -0.3])
def test_of_a_positive_parameter_that_has_gone_to_zero_an_upper_limit_is_known(value):
    force = 1 + value * X**2 + errors(4, 0.3)
    problem = fitted(Sum(), forces(X, force, STATE))
    assert problem.model.scalars()["B"] < 1e-8
    _, told = both(problem)
    low, high = ends(told, "B")
    assert low == 0
    assert words(told, "B") == f"only an upper limit is known: below {high:.3g} N"
    # By hand: the sum of squares along B ≥ 0, A fitted anew.
    shape = np.ones_like(X)

    def total(b: float) -> float:
        a = max((shape @ (force - b * X**2)) / len(X), 0.0)
        return float(np.square(a + b * X**2 - force).sum())

    jacobian = np.stack([shape, X**2], axis=1)
    bread = np.linalg.inv(jacobian.T @ jacobian)
    scores = jacobian * (force.mean() - force)[:, None]
    grouped = np.array([scores[s == STATE].sum(0) for s in range(STATES)])
    grouped -= grouped.mean(0)
    robust = bread @ grouped.T @ grouped @ bread * STATES / (STATES - 2)
    rise = student.ppf(0.975, told.freedom) ** 2 * robust[1, 1] / bread[1, 1]
    assert high == pytest.approx(brentq(lambda b: total(b) - total(0.0) - rise, 0.0, 10.0), rel=1e-3)
    assert ends(told, "A")[0] < problem.model.scalars()["A"] < ends(told, "A")[1]


def test_the_others_come_back_from_zero_along_a_profile():
    """At the estimate B has gone; where A is smaller it is wanted, and a search from B = 1e-16 would not notice."""
    force = 1 - 0.02 * X**2 + errors(4, 0.3)
    problem = fitted(Sum(), forces(X, force, STATE))
    assert problem.model.scalars()["B"] < 1e-8
    _, told = both(problem)
    squares = Squares.from_problem(problem)
    center = squares.at(problem.model.vector().detach())

    def total(a: float) -> float:
        b = max(X**2 @ (force - a) / (X**2 @ X**2), 0.0)
        return float(np.square(a + b * X**2 - force).sum())

    low, high = ends(told, "A")
    assert total(low) - center == pytest.approx(total(high) - center, rel=1e-3)
    # With B held at nothing the lower end would be nearer.
    assert np.square(low - force).sum() > total(low) + 0.1 * (total(low) - center)


def test_what_the_rows_do_not_determine_is_said_and_open():
    known, told = both(fitted(Unidentified(), forces(X, 0.5 * X + errors(), STATE)))
    assert np.isnan(known.low).all()
    for name, limits in (("idle", (-np.inf, np.inf)), ("lazy", (0.0, np.inf))):
        assert words(told, name) == "the rows do not determine it: every value allowed fits equally well"
        assert ends(told, name) == limits
    # Of twins the bound of one is the other's end: a + b is well known, and b ≥ −1.
    low, high = ends(told, "a")
    assert (low, words(told, "a")) == (-1.0, "its interval ends at the bound -1 N")
    total = sum(fitted(Unidentified(), forces(X, 0.5 * X + errors(), STATE)).model.scalars()[n] for n in "ab")
    assert total + 1 < high < total + 1.1


def test_a_lower_limit_alone_is_told_too():
    """Rows at rest hold A; by the next ones all has decayed, however fast."""
    x = np.concatenate([np.zeros(8), np.linspace(1, 3, 16)])
    noise = 0.05 * np.random.default_rng(6).normal(size=len(x))
    noise[8:] -= noise[8:].mean() - 0.001
    _, told = both(fitted(Decay(A=1.0, k=3.0), forces(x, np.where(x == 0, 1.0, 0.0) + noise)))
    low, high = ends(told, "k")
    assert 1 < low < 5
    assert high == np.inf
    assert words(told, "k") == f"only a lower limit is known: above {low:.3g}"


def test_an_end_where_rows_lose_their_prediction_is_said_to_be_one(monkeypatch):
    rows = forces(X, DECAY + errors(), STATE)
    smooth = fitted(Decay(), rows)
    limit = smooth.model.scalars()["k"] * 1.03
    monkeypatch.setattr(Cliff, "LIMIT", limit)
    _, told = both(fitted(Cliff(**smooth.model.scalars()), rows))
    assert ends(told, "k")[1] == pytest.approx(limit, rel=1e-5)
    assert "beyond which rows lose their prediction" in words(told, "k")
    _, free = both(smooth)
    assert ends(told, "k")[0] == pytest.approx(ends(free, "k")[0], rel=1e-4)


# --- what may go wrong ---------------------------------------------------------------------------------------------


def test_a_search_that_does_not_finish_says_so_and_the_normal_interval_stays(monkeypatch):
    monkeypatch.setattr(profile_end, "MOST_PLACES", 1)
    known, told = both(fitted(Decay(), forces(X, DECAY + errors(1, 0.3), STATE)))
    assert told.kinds == [NORMAL, NORMAL]
    np.testing.assert_array_equal([told.low, told.high], [known.low, known.high])
    assert "the search for its lower end did not finish" in words(told, "k")
    assert words(told, "k").endswith("so this is the normal interval")


def test_a_model_without_a_minimum_is_told_in_words():
    """Derivatives that are not the loads': no search arrives."""
    known, told = both(fitted(Rough(), forces(X, DECAY + errors(), STATE)))
    assert NORMAL in told.kinds or told.remark
    assert (np.isfinite(told.low) == np.isfinite(known.low)).all()
    for kind, said in zip(told.kinds, told.words, strict=True):
        assert kind == PROFILE or said or told.remark


def test_a_fit_that_ended_beside_its_minimum_says_where_it_is():
    problem = fitted(Decay(), forces(X, DECAY + errors(), STATE))
    _, right = both(problem)
    best = problem.model.scalars()
    problem.model.set_values({"A": best["A"] * 1.005})
    _, told = both(problem)
    assert f"A = {best['A']:.5g}" in told.remark
    assert "the interval is about" in words(told, "A")
    np.testing.assert_allclose([told.low, told.high], [right.low, right.high], rtol=1e-4)
    # Far from it the intervals would hold values that the fit is none of.
    problem.model.set_values({"A": 5.0})
    known, told = both(problem)
    assert told.kinds == [NORMAL, NORMAL]
    assert "Fit again" in told.remark
    np.testing.assert_array_equal(told.low, known.low)
    assert problem.model.scalars()["A"] == pytest.approx(5.0)


def test_a_better_fit_that_a_profile_meets_is_told():
    """A minimum among others: on the way to the end of its interval lies a deeper one."""
    force = np.sin(2 * X) + errors(0, 0.3)
    problem = fitted(Ripple(w=4.0), forces(X, force, STATE))
    assert problem.model.scalars()["w"] > 2.5
    known, told = both(problem)
    assert told.kinds == [NORMAL]
    assert "w = 2.0" in told.remark or "w = 1.9" in told.remark
    np.testing.assert_array_equal(told.low, known.low)


def test_a_perfect_fit_and_a_single_state_keep_their_normal_intervals():
    for rows, said in (
        (forces(X, DECAY, STATE), "to the last digit"),
        (forces(X, DECAY + errors(), 0 * STATE), "Too few kinematic states"),
    ):
        known, told = both(fitted(Decay(), rows))
        assert said in told.remark
        assert told.kinds == [NORMAL, NORMAL]
        np.testing.assert_array_equal(told.low, known.low)


@pytest.mark.parametrize("effects", [[], ["force_gain"]])
def test_networks_keep_their_normal_intervals_and_say_why(effects):
    problem = table_fit("continuum", [], 0.02, 40, **TUBE)
    network: Model = build_model("mlp", {}, effects)
    network.prepare(problem.rows)
    known, told = both(Problem(network, problem.rows))
    assert "rofile intervals are" in told.remark
    assert set(told.kinds) == {NORMAL}
    np.testing.assert_array_equal(told.low, known.low)


# --- the package's models ------------------------------------------------------------------------------------------


def test_effects_of_every_sample_have_intervals_of_their_own_and_the_model_stays_as_it_is():
    problem = table_fit("continuum", ["twist_offset"], 0.03, 160, per_sample=True, **TUBE)
    before = problem.model.vector().detach().clone()
    heard = []
    known = uncertainty(problem)
    told = profiled(problem, known, lambda name, done, total: heard.append((name, done, total)))
    assert torch.equal(problem.model.vector().detach(), before)
    assert len(told.names) == 10
    assert told.kinds == [PROFILE] * 10
    assert ((told.low < told.values) & (told.values < told.high)).all()
    width = (told.high - told.low) / (known.high - known.low)
    assert width == pytest.approx(np.ones(10), abs=0.15)
    assert [done for _, done, _ in heard] == [i + j for i in range(0, 20, 2) for j in range(3)]
    assert {total for *_, total in heard} == {20}
    assert {name for name, *_ in heard} == set(told.names)


@pytest.mark.slow
@pytest.mark.nightly
def test_gains_that_nothing_tells_apart_reach_as_far_as_their_bounds_let_them():
    """All moduli and the pressure, larger by one factor, give loads larger by that factor."""
    known, told = both(table_fit("continuum", ["force_gain", "moment_gain", "pressure_gain"], 0.02, 60, **TUBE))
    assert np.isnan(known.stderr).all()
    assert ends(told, "pressure_gain.gain") == pytest.approx((-0.5, 0.5))
    assert "the rows do not determine it" in words(told, "pressure_gain.gain")
    low, high = ends(told, "C1")
    # The gain's bounds alone give a factor of 1.5 / 0.5, and what is known of C1 beside it some more.
    assert 3 < high / low < 4


def test_fibers_that_are_not_there_have_an_upper_limit():
    table = random_table(120, 0)
    states = States.from_table(table)

    def made(c2: float) -> torch.Tensor:
        with torch.no_grad():
            loads: torch.Tensor = build_model("continuum", {"C1": 1e6, "C2": c2}, [])(states).loads
        return loads

    # As if the fibers pushed back: stiffnesses below zero would fit best.
    loads = made(1.0) - (made(1e4) - made(1.0))
    noise = torch.randn(loads.shape, dtype=loads.dtype, generator=torch.Generator().manual_seed(0))
    rows = Rows.whole(states, loads + 0.02 * loads.abs().amax(0) * noise, kinematic_state(table))
    model: Model = build_model("continuum", TUBE, [])
    fit(model, rows, rows[torch.zeros(0, dtype=torch.int64)], FitOptions("levenberg_marquardt", 300, 1, 6), seed=0)
    assert model.scalars()["C2"] < 1e-3
    _, told = both(Problem(model, rows))
    low, high = ends(told, "C2")
    assert low == 0
    assert 1e2 < high < 1e6
    assert words(told, "C2") == f"only an upper limit is known: below {high:.3g} Pa"
    assert told.kinds == [PROFILE, PROFILE]
    assert words(told, "C1") == ""


def test_a_number_of_several_raw_parameters_is_followed_exactly():
    """Quantity against Coordinate: the same ends, on a parameter that is both."""
    problem = fitted(Decay(), forces(X, DECAY + errors(1, 0.2), STATE))
    squares, vector = Squares.from_problem(problem), problem.model.vector().detach()
    found = []
    for line in (Coordinate(1), Quantity(lambda v: v[1])):
        spot = Spot(line.place(vector), squares.at(vector), vector, True)
        allowance = Allowance(0.2, 0.1, torch.zeros_like(vector))
        search = EndSearch(squares, line, spot, allowance, 0.1, lambda v: v, False, lambda v: True)
        found.append([search.toward(Limit(side * 10.0, Ending.OPEN), 0.1).place for side in (-1, 1)])
    np.testing.assert_allclose(*found, rtol=1e-5)


def test_uncertainty_itself_is_as_before_and_frozen():
    known = uncertainty(fitted(Decay(), forces(X, DECAY + errors(), STATE)))
    assert known.kinds == [NORMAL, NORMAL]
    assert known.words == ["", ""]
    assert replace(known, remark="x").remark == "x"
