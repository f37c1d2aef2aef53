"""A push that saturates, against the elastica, and after what creep carries in a log."""

import math

import numpy as np
import pytest
import torch
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import recordings, visits

FLEXIBILITY = 100.0


def evaded(force, length):
    """What a tube of this length pushes that would push so hard if it were straight."""
    loads = torch.tensor([[f, 0.1] for f in force], dtype=torch.float64)
    states = States.from_table(visits())[slice(0, len(loads))]
    states = states.replace(reference_length=torch.full((len(loads),), length, dtype=torch.float64))
    p: Parameters = EFFECTS["buckling"]().own({"buckling.flexibility": torch.tensor(FLEXIBILITY, dtype=torch.float64)})
    return EFFECTS["buckling"]().evade(loads, states, p)


@pytest.mark.parametrize("length", [0.1, 0.3])
def test_pushes_end_at_the_load_of_a_clamped_elastica(length):
    """Love's (1892) elastica clamped at both ends: (2K/π)² times Euler's load, shortened by 2 (1 − E/K)."""
    euler = 4 * math.pi**2 / FLEXIBILITY / length**2
    for shortening in (0.01, 0.13):
        m = brentq(lambda m, s=shortening: 2 * (1 - ellipe(m) / ellipk(m)) - s, 1e-9, 0.9)
        elastica = euler * (2 * ellipk(m) / math.pi) ** 2
        assert float(evaded([50 * euler], length)[0, 0]) == pytest.approx(elastica, rel=0.08)


def test_pulls_and_moments_are_what_they_were_and_small_pushes_nearly():
    found = evaded([-30.0, 0.0, 1e-3, 1.0, 5.0, 40.0], 0.2)
    assert torch.equal(found[:2, 0], torch.tensor([-30.0, 0.0], dtype=torch.float64))
    assert float(found[2, 0]) == pytest.approx(1e-3, rel=1e-3)
    assert bool((found[:, 1] == 0.1).all())
    assert bool((found[:, 0].diff() > 0).all())


def test_in_a_log_it_comes_after_what_creep_carries():
    """Creep's own log, and the tube that bends after it."""
    states = States.from_table(recordings((3,)).assign(elongation_mm=-4.0))
    values = TRUTH["continuum"] | {"creep.share": 0.5, "creep.time": 2.0}
    bent = values | {"buckling.flexibility": 1000.0}
    with torch.no_grad():
        crept = build_model("continuum", values, ["creep"])(states).loads
        both = build_model("continuum", bent, ["creep", "buckling"])(states).loads
    euler = 4 * math.pi**2 / 1000.0 / states.reference_length.numpy() ** 2
    push = crept[:, 0].numpy()
    expected = np.where(push > 0, euler * (1 - np.exp(-push.clip(0) / euler)), push)
    assert (push > 0.5 * euler).any()
    np.testing.assert_allclose(both[:, 0], expected, rtol=1e-9, atol=1e-12)
