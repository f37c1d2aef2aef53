"""Strain energies of the effects against the closed forms of their sources, and their hand-written derivatives."""

import math

import numpy as np
import pytest
import torch

from freelearn.data.states import States
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.models.build import build_model

STRETCH = np.array([0.8, 0.95, 1.05, 1.3, 1.8])
C1 = 3e5
ENERGIES = [name for name, kind in EFFECTS.items() if kind.port == "energy"]


def tensor(x) -> torch.Tensor:
    return torch.as_tensor(x, dtype=torch.float64)


def tube_stress(values: dict[str, float], effects: list[str], fiber_angle: float = 0.5) -> np.ndarray:
    """Nominal stress [Pa] of an unpressurised, untwisted tube as the model sees it, (5,): its pull over its section."""
    inner, outer, count = 4e-3, 6e-3, len(STRETCH)
    columns = {"fiber_angle": fiber_angle, "reference_length": 0.1, "inner_radius": inner, "outer_radius": outer}
    states = States(
        **{name: tensor([value] * count) for name, value in columns.items()},
        length=tensor(0.1 * STRETCH),
        twist=tensor([0.0] * count),
        pressure=tensor([0.0] * count),
        sample=torch.ones(count, dtype=torch.int64),
        direction=tensor([0.0] * count),
    )
    loads = build_model("continuum", values, effects)(states).loads.detach().numpy()
    return -loads[:, 0] / (math.pi * (outer**2 - inner**2))


def isotropic(psi1, psi2=0.0) -> np.ndarray:
    """2 (λ − λ⁻²)(Ψ₁ + Ψ₂/λ), the nominal stress of an incompressible isotropic solid in simple tension."""
    return 2 * (STRETCH - STRETCH**-2) * (psi1 + psi2 / STRETCH)


I1 = STRETCH**2 + 2 / STRETCH


def test_neo_hooke_and_second_invariant_are_mooney_rivlin():
    # Treloar's form: (λ − λ⁻²)·2 (C₁₀ + C₀₁/λ) with C₁₀ = C1/2, C₀₁ = C01/2.
    found = tube_stress({"C1": C1, "C2": 1e-3, "second_invariant.C01": 1e5}, ["second_invariant"])
    np.testing.assert_allclose(found, isotropic(C1 / 2, 1e5 / 2), rtol=1e-7)


def test_neo_hooke_and_the_logarithm_are_gent_thomas():
    # Ψ = µ/2 (I₁ − 3) + c ln(I₂/3) with c = 3 C_ln/2; I₂ = 2λ + λ⁻² in simple tension.
    found = tube_stress({"C1": C1, "C2": 1e-3, "second_invariant_log.modulus": 1e5}, ["second_invariant_log"])
    np.testing.assert_allclose(found, isotropic(C1 / 2, 1.5e5 / (2 * STRETCH + STRETCH**-2)), rtol=1e-7)


def test_near_rest_the_logarithm_and_the_second_invariant_are_one():
    """Both add their modulus to the shear modulus, so they part with the strain's square only."""
    at = tensor(3 + 1e-4)
    moduli = [make_effects([n], "continuum")[0].term({"C1": tensor(C1), "C2": tensor(1.0), f"{n}.{p}": tensor(1e5)})
              for n, p in (("second_invariant", "C01"), ("second_invariant_log", "modulus"))]  # fmt: skip
    first, second = (float(term.gradient(at)[0]) for term in moduli)
    assert second == pytest.approx(first, rel=1e-4)


def test_neo_hooke_and_wall_stiffening_are_yeoh():
    found = tube_stress({"C1": C1, "C2": 1e-3, "wall_stiffening.C20": 4e4}, ["wall_stiffening"])
    np.testing.assert_allclose(found, isotropic(C1 / 2 + 2 * 4e4 * (I1 - 3)), rtol=1e-7)


def test_neo_hooke_and_limited_extensibility_are_gent():
    # (λ − λ⁻²) µ J_m/(J_m − I₁ + 3), Gent (1996).
    limit = 5.0
    found = tube_stress({"C1": C1, "C2": 1e-3, "limited_extensibility.beta": 1 / limit}, ["limited_extensibility"])
    np.testing.assert_allclose(found, (STRETCH - STRETCH**-2) * C1 * limit / (limit - I1 + 3), rtol=1e-7)


def along_the_load(psi1, psi4) -> np.ndarray:
    """2 (λ − λ⁻²) Ψ₁ + 2 λ Ψ₄: simple tension along the fiber, I₄ = λ²."""
    return 2 * (STRETCH - STRETCH**-2) * psi1 + 2 * STRETCH * psi4


def test_fiber_stiffening_is_holzapfels_exponential():
    x, k2 = STRETCH**2 - 1, 0.6
    found = tube_stress({"C1": C1, "C2": 1e5, "fiber_stiffening.k2": k2}, ["fiber_stiffening"], fiber_angle=0.0)
    np.testing.assert_allclose(found, along_the_load(C1 / 2, 1e5 * x * np.exp(k2 * x**2)), rtol=1e-7)


def test_fiber_dispersion_is_that_of_gasser():
    kappa = 0.1
    strain = kappa * (I1 - 3) + (1 - 3 * kappa) * (STRETCH**2 - 1)
    found = tube_stress({"C1": C1, "C2": 1e5, "fiber_dispersion.kappa": kappa}, ["fiber_dispersion"], fiber_angle=0.0)
    expected = along_the_load(C1 / 2 + 1e5 * kappa * strain, 1e5 * (1 - 3 * kappa) * strain)
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_fully_dispersed_fibres_have_no_direction():
    values = {"C1": C1, "C2": 1e5, "fiber_dispersion.kappa": 1 / 3}
    along = tube_stress(values, ["fiber_dispersion"], fiber_angle=0.0)
    np.testing.assert_allclose(tube_stress(values, ["fiber_dispersion"], fiber_angle=1.1), along, rtol=1e-7)


def test_a_share_of_one_leaves_no_compressive_fibre_stress():
    values = {"C1": C1, "C2": 1e5, "fiber_tension_only.share": 1.0}
    found = tube_stress(values, ["fiber_tension_only"], fiber_angle=0.0)
    x = np.maximum(STRETCH**2 - 1, 0)
    np.testing.assert_allclose(found, along_the_load(C1 / 2, 1e5 * x), rtol=1e-7)


# --- derivatives ----------------------------------------------------------------------------------------------


def term(name: str, size: float):
    """The effect's energy with its first parameter at `size` times its scale, others at their start."""
    first, *others = EFFECTS[name].declared_parameters()
    values = {"C1": tensor(C1), "C2": tensor(2e6), f"{name}.{first.name}": tensor(size * first.scale)}
    values |= {f"{name}.{p.name}": tensor(p.start) for p in others}
    return make_effects([name], "continuum")[0].term(values)


def invariants(name: str) -> tuple[torch.Tensor, ...]:
    """From compression to far beyond what a tube reaches, for each invariant of the effect."""
    ranges = {"i1": (3.0, 9.0), "i2": (3.0, 9.0), "i4": (0.4, 6.0)}
    return tuple(torch.linspace(*ranges[n], 41, dtype=torch.float64) for n in EFFECTS[name].depends_on)


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.1, 1.0, 3.0])
@pytest.mark.parametrize("name", ENERGIES)
def test_the_hand_written_gradient_is_that_of_the_energy(name, size):
    energy, at = term(name, size), invariants(name)
    automatic = torch.func.grad(lambda *x: energy.psi(*x).sum(), argnums=tuple(range(len(at))))(*at)
    for by_hand, expected in zip(energy.gradient(*at), automatic, strict=True):
        assert expected.isfinite().all()
        torch.testing.assert_close(by_hand, expected, rtol=1e-7, atol=1e-8)  # 1e-8 Pa: rounding of C2


@pytest.mark.parametrize("name", ENERGIES)
def test_the_gradient_rate_is_the_slope_of_the_gradient(name):
    energy, at = term(name, 0.3), invariants(name)
    rates = tuple(torch.full_like(x, 1.0 + 0.5 * i) for i, x in enumerate(at))
    _, slopes = energy.gradient_rate(at, rates)
    h = 1e-6
    up, down = (energy.gradient(*(x + s * h * r for x, r in zip(at, rates, strict=True))) for s in (1, -1))
    for slope, high, low in zip(slopes, up, down, strict=True):
        difference = (high - low) / (2 * h)
        # At its kink or join an energy has one slope on either side.
        close = (slope - difference).abs() <= 1e-5 * difference.abs() + 1e-6 * 2e6
        assert close.double().mean() >= 0.95


@pytest.mark.parametrize(("name", "past"), [("limited_extensibility", 4.5), ("fiber_stiffening", 1.6)])
def test_beyond_its_limit_the_energy_goes_on_finite_and_growing(name, past):
    size = 1 / EFFECTS[name].declared_parameters()[0].scale * (1.0 if name == "limited_extensibility" else 50.0)
    x = torch.linspace(past - 1, past + 100, 2000, dtype=torch.float64)
    energy = term(name, size)
    gradient = energy.gradient(x)[0]
    assert energy.psi(x).isfinite().all()
    assert (gradient.diff() > 0).all()
