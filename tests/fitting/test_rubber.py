"""Rubber specimens: stresses follow from the energy, fits find known parameters and agree with SciPy on real rubber."""

import numpy as np
import pytest
import torch
from closed_forms import ACROSS, I1, I2, STRESS, gent, sources, synthetic, yeoh
from scipy.optimize import least_squares

from freelearn.common.errors import UserError
from freelearn.data.specimen_schema import MODES, mode_name
from freelearn.data.specimen_table import read_specimens
from freelearn.data.states import States
from freelearn.fitting.rubber_effects import compare, conclusion
from freelearn.fitting.rubber_fit import fit_rubber
from freelearn.physics.effects.registry import make_effects
from freelearn.physics.mechanics.energy import Energy, NeoHookean, nominal_stress
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.rubber import Rubber

# In equibiaxial tension the energy is spent in two directions.
LOADED = {"uniaxial": 1, "equibiaxial": 2, "pure_shear": 1}


class SecondInvariant(Energy):
    """Ψ = 2e4 (I₂ − 3) + 1e3 (I₂ − 3)²."""

    depends_on = ("i2",)

    def psi(self, *invariants: torch.Tensor) -> torch.Tensor:
        return 2e4 * (invariants[0] - 3) + 1e3 * (invariants[0] - 3) ** 2


def tensor(x: float | np.ndarray) -> torch.Tensor:
    return torch.tensor(x, dtype=torch.float64)


@pytest.mark.parametrize("mode", I1)
def test_stress_is_the_slope_of_the_energy(mode):
    x, h = np.array([0.6, 0.9, 1.0, 1.3, 2.0, 4.0]), 1e-5

    def energy(x):
        first, second = I1[mode](x) - 3, I2[mode](x) - 3
        return 1.5e5 * first + 3e3 * first**2 + 2e4 * second + 1e3 * second**2

    slope = (energy(x + h) - energy(x - h)) / (2 * h) / LOADED[mode]
    stiffening = make_effects(["wall_stiffening"], "continuum")[0]
    values = {"C1": tensor(3e5), "C2": tensor(0.0), "wall_stiffening.C20": tensor(3e3)}
    terms = [NeoHookean(values["C1"]), stiffening.term(values), SecondInvariant()]
    stress = nominal_stress(terms, tensor(x), tensor(ACROSS[mode](x))).numpy()
    np.testing.assert_allclose(stress, slope, rtol=1e-7, atol=1e-3)


@pytest.mark.parametrize(("mode", "modulus"), [("uniaxial", 3), ("equibiaxial", 6), ("pure_shear", 4)])
def test_small_strain_modulus_is_that_of_an_incompressible_solid(mode, modulus):
    values = {"C1": tensor(4e5)}
    along = np.array([1 + 1e-6])
    stress = Rubber().stress(values, tensor(along), tensor(MODES[mode].across(along)))
    assert float(stress[0]) / 1e-6 == pytest.approx(modulus * 4e5, rel=1e-5)


def test_a_tube_without_fiber_or_pressure_pulls_like_a_uniaxial_specimen():
    values = {"C1": 3e5, "wall_stiffening.C20": 2e4}
    tube = Continuum(effects=make_effects(["wall_stiffening"], "continuum"))
    tube.set_values({**values, "C2": 1e-6})
    stretch = tensor([0.9, 1.1, 1.4])
    fixed = {"fiber_angle": 0.6, "reference_length": 0.1, "inner_radius": 4e-3, "outer_radius": 6e-3}
    state = {"length": 0.1 * stretch, "twist": tensor([0.0] * 3), "pressure": tensor([0.0] * 3)}
    none = torch.zeros(3, dtype=torch.float64)
    states = States(**{n: tensor([v] * 3) for n, v in fixed.items()}, **state, sample=none, direction=none)
    force = tube(states).loads[:, 0].detach()
    area = torch.pi * (6e-3**2 - 4e-3**2)
    rubber = Rubber(["wall_stiffening"])
    stress = rubber.stress({n: tensor(v) for n, v in values.items()}, stretch, stretch**-0.5)
    torch.testing.assert_close(-force / area, stress, rtol=1e-6, atol=1.0)


@pytest.mark.parametrize(("C1", "C20"), [(2e4, 50.0), (3e5, 8e3), (6e6, 1e3)])
def test_fit_finds_the_parameters_of_exact_data(C1, C20):
    result = fit_rubber(Rubber(["wall_stiffening"]), synthetic(C1, C20))
    assert result.values["C1"] == pytest.approx(C1, rel=1e-6)
    assert result.values["wall_stiffening.C20"] == pytest.approx(C20, rel=1e-5)
    assert result.error < 1e-8
    assert result.message.startswith("Converged")


def test_standard_errors_are_those_of_linear_regression():
    table = synthetic(3e5, 8e3)
    table["stress_mpa"] *= 1 + 0.05 * np.random.default_rng(0).standard_normal(len(table))
    result = fit_rubber(Rubber(["wall_stiffening"]), table)
    columns, target = [], []
    for mode, rows in table.groupby("mode"):
        x, scale = rows["stretch"].to_numpy(), rows["stress_mpa"].abs().max() * 1e6
        columns.append(np.stack([yeoh(mode, x, 1, 0), yeoh(mode, x, 0, 1)], axis=1) / scale)
        target.append(rows["stress_mpa"] * 1e6 / scale)
    A, b = np.concatenate(columns), np.concatenate(target)
    x, loss, *_ = np.linalg.lstsq(A / [1e-5, 1e-4], b)
    error = np.sqrt(np.diag(np.linalg.inv(A.T @ A)) * loss / (len(b) - 2))
    np.testing.assert_allclose(list(result.values.values()), x / [1e-5, 1e-4], rtol=1e-6)
    np.testing.assert_allclose(list(result.stderr.values()), error, rtol=1e-5)
    assert result.error == pytest.approx(np.sqrt(loss[0] / len(b)), rel=1e-9)


def test_a_mode_held_out_has_no_say():
    table = synthetic(3e5, 8e3)
    table.loc[table["mode"] == "equibiaxial", "stress_mpa"] *= 2
    result = fit_rubber(Rubber(["wall_stiffening"]), table, ["equibiaxial"])
    assert result.values["C1"] == pytest.approx(3e5, rel=1e-6)
    assert {m: e.fitted for m, e in result.modes.items()} == {
        "uniaxial": True,
        "equibiaxial": False,
        "pure_shear": True,
    }
    # Half of every stress is missing.
    half = table.loc[table["mode"] == "equibiaxial", "stress_mpa"] / 2
    assert result.modes["equibiaxial"].error == pytest.approx(np.sqrt((half**2).mean()) / (2 * half.max()), rel=1e-6)


def test_bounds_hold_and_are_told():
    softening = synthetic(3e5, 0.0)
    softening["stress_mpa"] *= 1 - 0.1 * (softening["stretch"] - 1)
    result = fit_rubber(Rubber(["wall_stiffening"]), softening)
    assert result.values["wall_stiffening.C20"] == 0
    assert result.at_bound == ["wall_stiffening.C20"]
    assert np.isnan(result.stderr["wall_stiffening.C20"])
    alone = fit_rubber(Rubber(), softening)
    assert result.values["C1"] == pytest.approx(alone.values["C1"], rel=1e-8)


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        (["fiber_tension_only"], "depends on the fiber"),
        (["end_clamps"], "adds no strain energy"),
        (["wall_stifening"], "Did you mean 'wall_stiffening'"),
    ],
)
def test_effects_that_rubber_cannot_show_are_refused(effects, words):
    with pytest.raises(UserError, match=words):
        Rubber(effects)


def test_what_cannot_be_fitted_is_refused():
    table = synthetic(3e5, 8e3)
    with pytest.raises(UserError, match="nothing is left to fit"):
        fit_rubber(Rubber(), table, list(I1))
    with pytest.raises(UserError, match="pure_shear cannot be held out"):
        fit_rubber(Rubber(), table[table["mode"] == "uniaxial"], ["pure_shear"])
    with pytest.raises(UserError, match="1 stresses cannot determine 2 parameters"):
        fit_rubber(Rubber(["wall_stiffening"]), table[:1])


def test_modes_go_by_their_usual_names():
    assert [mode_name(t) for t in ("UT", "et", "Pure shear", "pure-shear", "BT", "x")] == [
        *("uniaxial", "equibiaxial", "pure_shear", "pure_shear", "biaxial"),
        None,
    ]
    assert {*STRESS, "simple_shear", "biaxial"} == set(MODES)


def scipy_fit(table, stress, start, scale):
    """An independent bounded fit of a closed form: parameters and the root mean square residual."""
    parts = [(m, r["stretch"].to_numpy(), r["stress_mpa"].to_numpy() * 1e6) for m, r in table.groupby("mode")]

    def residual(x):
        return np.concatenate([(stress(m, s, *(x * scale)) - p) / np.abs(p).max() for m, s, p in parts])

    tolerances = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-14)
    result = least_squares(residual, start, bounds=(0, np.inf), x_scale="jac", **tolerances)
    return result.x * scale, np.sqrt((result.fun**2).mean())


@pytest.fixture(params=["treloar_1944", "meunier_2008"])
def rubber(request, shared_data):
    return read_specimens(sources(shared_data / "rubber" / request.param)).table


def test_yeoh_fit_of_real_rubber_is_that_of_scipy(rubber):
    values, error = scipy_fit(rubber, yeoh, [1.0, 1.0], np.array([3e5, 3e3]))
    result = fit_rubber(Rubber(["wall_stiffening"]), rubber)
    np.testing.assert_allclose(list(result.values.values()), values, rtol=1e-5)
    assert result.error == pytest.approx(error, rel=1e-9)


def test_gent_fit_of_real_rubber_is_that_of_scipy(rubber):
    values, error = scipy_fit(rubber, gent, [1.0, 0.5], np.array([3e5, 0.01]))
    result = fit_rubber(Rubber(["limited_extensibility"]), rubber)
    np.testing.assert_allclose(list(result.values.values()), values, rtol=1e-4)
    assert result.error == pytest.approx(error, rel=1e-8)


def test_neo_hooke_fails_where_rubber_is_stretched_far_and_effects_mend_it(shared_data):
    table = read_specimens(sources(shared_data / "rubber/treloar_1944")).table
    alone = fit_rubber(Rubber(), table)
    far = table[(table["mode"] == "uniaxial") & (table["stretch"] > 7)]
    values = {"C1": tensor(alone.values["C1"])}
    along, across = (tensor(far[name].to_numpy()) for name in ("stretch", "stretch_2"))
    predicted = alone.rubber.stress(values, along, across) / 1e6
    # Crystallizing chains carry far more than a neo-Hookean solid.
    assert (predicted.numpy() < 0.75 * far["stress_mpa"]).all()
    for effect in ("wall_stiffening", "limited_extensibility"):
        assert fit_rubber(Rubber([effect]), table).error < alone.error / 2


@pytest.mark.nightly
def test_natural_rubber_asks_for_chains_that_run_out_and_not_for_a_linear_second_invariant(shared_data):
    # Gent & Thomas (1958) and Gent (1996) made their energies for just these tests of Treloar's.
    data = read_specimens(sources(shared_data / "rubber/treloar_1944"))
    said = conclusion(compare(data.table, data.modes))
    named = said.split(":")[0]
    assert "second_invariant_log" in named
    assert "limited_extensibility" in named or "wall_stiffening" in named
    assert "second_invariant" not in named.replace("second_invariant_log", "")


def test_one_mode_decides_nothing(shared_data):
    table = read_specimens([f"UT={shared_data / 'rubber/treloar_1944/UT.csv'}"]).table
    assert conclusion(compare(table, ["uniaxial"])).startswith("One mode alone")
