"""Tubes that are pushed together: stiff fibers have to bulge out, and the stable radius lies beyond a minimum of what
the wall carries. The textbook, followed from the reference length, says where."""

import numpy as np
import pytest
import torch
from braids import INNER, LENGTH, OUTER, tensor, tubes
from scipy.optimize import brentq

from freelearn.data.beds import DEG, KPA, MM
from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.equilibrium import _solve
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.textbook import Row

C1 = 8e5
STEPS = 30


def followed(gamma, kappa, ratio, shortened, pressure):
    """Force [N] and inner radius [m] of a tube as it is shortened by a share of its length in small steps."""
    c2 = ratio * C1

    def strain(i1, i4):
        return kappa * (i1 - 3) + (1 - 3 * kappa) * (i4 - 1)

    radius = INNER * MM
    for share in np.linspace(0, shortened, STEPS + 1):
        row = Row(
            gamma * DEG, LENGTH * MM, INNER * MM, OUTER * MM, (1 - share) * LENGTH * MM, 0.0,
            lambda i1, i2, i4: C1 / 2 + c2 * kappa * strain(i1, i4),
            lambda i1, i2, i4: 0.0,
            lambda i1, i2, i4: c2 * (1 - 3 * kappa) * strain(i1, i4),
        )  # fmt: skip
        # In small steps the radius of equilibrium, where the pressure rises with it, is the next one outward.
        below = radius if share == 0 else 0.995 * radius
        radius = brentq(lambda r, row=row: row.pressure(r) - pressure * KPA, below, 1.12 * radius, xtol=1e-12)
    return row.loads(radius, pressure * KPA)[0], radius


@pytest.mark.parametrize(
    ("gamma", "kappa", "ratio", "shortened", "pressure"),
    [(16, 0.087, 184, 0.12, 39), (18, 0.05, 150, 0.15, 120), (20, 0.03, 300, 0.1, 20), (25, 0.08, 100, 0.2, 250)],
)
def test_the_radius_is_the_one_that_shortening_leads_to(gamma, kappa, ratio, shortened, pressure):
    """Also where the wall carries less than nothing at every radius up to there."""
    model = build_model(
        "continuum", {"C1": C1, "C2": ratio * C1, "fiber_dispersion.kappa": kappa}, ["fiber_dispersion"]
    )
    states = tubes(gamma, np.nan, -shortened * LENGTH, 0.0, pressure)
    with torch.no_grad():
        found = model(states, model.physical(model.vector()))
    force, radius = followed(gamma, kappa, ratio, shortened, pressure)
    assert radius > 1.05 * INNER * MM
    assert int(found.status[0]) == Status.OK
    assert float(found.loads[0, 0]) == pytest.approx(force, rel=1e-6)


def test_a_tube_that_balloons_is_told_from_one_that_bulges():
    """A rubber wall without fibers to speak of carries 20 kPa and less at every radius: no equilibrium under 300."""
    model = build_model("continuum", {"C1": 2e4, "C2": 1e2, "fiber_dispersion.kappa": 0.05}, ["fiber_dispersion"])
    with torch.no_grad():
        found = model(tubes(30, np.nan, -5.0, 0.0, 300), model.physical(model.vector()))
    assert int(found.status[0]) == Status.NO_EQUILIBRIUM


def test_from_beyond_a_limit_point_the_search_ends_as_from_rest():
    """A balloon whose chains lock: under more than it carries at its first maximum it has left that branch for good,
    also where a fit's last radius lies on the falling one, with the locked branch ahead."""
    reference = tensor([INNER * MM]) ** 2

    class Balloon:
        """P(u) with a maximum of 1.0 at u = 1.5 reference, a minimum after it, and a second rise."""

        stiffens = False

        def detach(self):
            return self

        def some(self, rows, count):
            return self

        def carried(self, u):
            x = u / reference
            value = 1.0 - (x - 1.5) ** 2 + 0.35 * (x - 1.5).clamp_min(0) ** 3
            return value, (-2 * (x - 1.5) + 1.05 * (x - 1.5).clamp_min(0) ** 2) / reference

    pressure = tensor([1.05])
    cold = _solve(Balloon(), reference, reference, pressure, None)
    assert not bool(cold[1])
    for beyond in (1.6, 2.0, 2.6):
        assert not bool(_solve(Balloon(), reference, reference, pressure, beyond * reference)[1])
