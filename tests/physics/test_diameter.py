"""The outer diameter that a bed of inflation measures: textbook, volume, derivatives."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from braided import BraidedMuscle
from braids import random_tubes, textbook_rows

from freelearn.common.errors import UserError
from freelearn.data.beds import INFLATION
from freelearn.discovery.noise.noise import sensitivities
from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.inextensible import helix
from freelearn.physics.models.build import build_model
from freelearn.testing.contract_checks import parameter_derivatives
from freelearn.testing.reference.total_energy import outer_diameter

VALUES = {"C1": 8e5, "C2": 2e7}


def inflated(count: int, seed: int):
    return replace(random_tubes(count, seed, blank=0.3), bed=INFLATION)


def reading(model, states):
    with torch.no_grad():
        return model(states)


def test_the_outer_diameter_is_the_textbooks_and_the_force_that_of_the_kinematic_bed():
    """r_o² = r_i² + (R_o² − R_i²) L/l, r_i by the textbook's root finding."""
    states, model = inflated(20, 1), build_model("continuum", VALUES)
    shown, status = reading(model, states)
    expected = textbook_rows(states, **VALUES)
    assert (status == Status.OK).all()
    outer, inner, stretch = states.outer_radius.numpy(), states.inner_radius.numpy(), states.length / 0.09842
    np.testing.assert_allclose(
        shown[:, 1].numpy(), 2 * np.sqrt(expected[:, 2] ** 2 + (outer**2 - inner**2) / stretch.numpy()), rtol=1e-9
    )
    assert (np.abs(shown[:, 0].numpy() - expected[:, 0]) / np.abs(expected[:, 0]).max()).max() < 1e-8


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("pressure_gain", {"gain": 0.1}),
        ("length_offset", {"length": 1e-3}),
        ("wall_thickness", {"outer_radius": 2e-4}),
        ("end_clamps", {"clamp_length": 3e-3}),
        ("stress_softening", {"depth": 0.2, "severity": 0.05}),
        ("force_offset", {"force": 1.0}),
    ],
)
def test_it_is_that_of_the_actuator_as_it_really_is(name, size):
    """The reference's radius is bisected to 1e-14; a load cell's error is no change of shape."""
    past = {name: torch.full((20,), s, dtype=torch.float64) for name, s in (("severity", 0.1), ("past_severity", 0.2))}
    states = inflated(20, 2).replace(**past)
    model = build_model("continuum", VALUES | {f"{name}.{p}": v for p, v in size.items()}, [name])
    shown = reading(model, states).loads[:, 1].numpy()
    s = {"gamma": states.fiber_angle.numpy(), "reference": states.reference_length.numpy()}
    s["gamma2"] = np.where(states.second_share > 0, states.second_angle, np.nan)
    s |= {n: getattr(states, f"{n}_radius").numpy() for n in ("inner", "outer")}
    s |= {n: getattr(states, n).numpy() for n in ("length", "twist", "pressure", "severity", "past_severity")}
    s["length"] = s["length"] + size.get("length", 0.0)
    s["pressure"] = s["pressure"] * (1 + size.get("gain", 0.0))
    np.testing.assert_allclose(shown, outer_diameter(s, VALUES["C1"], VALUES["C2"], {name: size}), rtol=1e-9)


def test_the_wall_keeps_its_volume():
    """π (r_o² − r_i²) l is the unloaded wall's."""
    states = inflated(30, 3)
    outer = reading(build_model("continuum", VALUES), states).loads[:, 1].numpy() / 2
    inner = textbook_rows(states, **VALUES)[:, 2]
    volume = (outer**2 - inner**2) * states.length.numpy()
    unloaded = (states.outer_radius**2 - states.inner_radius**2) * states.reference_length
    np.testing.assert_allclose(volume, unloaded.numpy(), rtol=1e-8)


@pytest.mark.parametrize("name", ["linear", "continuum_inextensible"])
def test_of_inextensible_fibers_it_is_their_own_helix(name):
    states = inflated(20, 4)
    shown, status = reading(build_model(name), states)
    ok = status == Status.OK
    torch.testing.assert_close(shown[ok, 1], 2 * helix(states).radius2[ok].sqrt())
    assert shown.isfinite().all()


def test_a_higher_pressure_swells_more():
    states, model = inflated(30, 5), build_model("continuum", VALUES)
    here, more = (reading(model, states.replace(pressure=states.pressure + p)).loads[:, 1] for p in (0.0, 1e4))
    assert (more > here).all()


def test_derivatives_are_those_of_differences():
    states, model = inflated(15, 6), build_model("continuum", VALUES, ["pressure_gain", "wall_stiffening"])
    steps = {"C1": 1e-4, "C2": 1e-4, "pressure_gain.gain": 1e-4, "wall_stiffening.C20": 1.0}
    parameter_derivatives(model, states, steps)
    slopes = sensitivities(model, states)
    for i, (name, h) in enumerate((("length", 1e-6), ("twist", 1e-5), ("pressure", 1.0))):
        here = getattr(states, name)
        up, down = (reading(model, states.replace(**{name: here + s * h})).loads for s in (1, -1))
        slope = (up - down) / (2 * h)
        assert ((slopes[:, :, i] - slope).abs() / slope.abs().amax(0)).max() < 1e-6


def test_a_model_without_a_wall_says_that_it_has_no_diameter():
    with pytest.raises(UserError, match="no outer diameter"):
        BraidedMuscle()(inflated(2, 7))
