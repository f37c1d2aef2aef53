"""Series springs against a root finder and against the mechanics of springs in series."""

import numpy as np
import pytest
import torch
from scipy.optimize import fsolve

from freelearn.data.states import States
from freelearn.discovery.noise.noise import sensitivities
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

SPRINGS = ["length_compliance", "twist_compliance"]
SOFT = {"length_compliance.compliance": 5e-5, "twist_compliance.compliance": 1.0}


def model(family: str, values: dict[str, float] = SOFT):
    return build_model(family, TRUTH[family] | values, SPRINGS)


@pytest.mark.parametrize("family", ["continuum", "linear"])
def test_the_loads_are_those_at_the_state_that_a_root_finder_settles_on(family):
    states = States.from_table(visits(count=2))
    bare = build_model(family, TRUTH[family])
    loads = model(family)(states).loads.detach().numpy()
    for i in range(len(states)):
        row = states[slice(i, i + 1)]

        def rigid(q, row=row):
            place = {n: torch.tensor([v], dtype=torch.float64) for n, v in zip(("length", "twist"), q, strict=True)}
            return bare(row.replace(**place)).loads.detach().numpy()[0]

        read = np.array([float(row.length), float(row.twist)])
        found = fsolve(lambda q, read=read, rigid=rigid: q - read - [5e-5, 1.0] * rigid(q), read, xtol=1e-12)
        np.testing.assert_allclose(loads[i], rigid(found), rtol=1e-8, atol=1e-9)


def test_compliances_add_up_as_those_of_springs_in_series():
    """Without pressure the linear model is a stiffness K, and with springs S⁻¹ = diag(c) it is (K⁻¹ + S⁻¹)⁻¹."""
    states = States.from_table(visits(count=3))
    states = states.replace(pressure=torch.zeros(len(states), dtype=torch.float64))
    k = TRUTH["linear"]
    stiffness = np.array([[k["ka"], k["kc"]], [k["kc"], k["kb"]]])
    series = np.linalg.inv(np.linalg.inv(stiffness) + np.diag(list(SOFT.values())))
    q = np.stack([states.length - states.reference_length, states.twist], axis=1)
    np.testing.assert_allclose(model("linear")(states).loads.detach().numpy(), -q @ series, rtol=1e-10)


def test_an_actuator_that_pushes_outward_lengthens_and_pushes_less():
    states = States.from_table(visits())
    before = build_model("linear", TRUTH["linear"])(states).loads
    after = build_model("linear", TRUTH["linear"] | {"length_compliance.compliance": 1e-5}, SPRINGS[:1])(states).loads
    assert (after[:, 0].abs() < before[:, 0].abs()).all()
    assert (after[:, 0].sign() == before[:, 0].sign()).all()


@pytest.mark.parametrize("family", ["continuum", "linear"])
def test_both_springs_together_keep_reciprocity(family):
    slopes = sensitivities(model(family), States.from_table(visits()))
    torch.testing.assert_close(slopes[:, 0, 1], slopes[:, 1, 0], rtol=1e-7, atol=1e-9)


def test_a_mount_that_snaps_through_has_no_equilibrium_and_finite_loads():
    """Pressure makes ∂M/∂φ > 0; with a wall this weak a soft mount gives way the further the more it is twisted."""
    states = States.from_table(visits(samples=(3,)))
    states = states.replace(pressure=5 * states.pressure)
    weak = {"ka": 1e3, "kb": 1e-4, "kc": 0.0}
    soft = build_model("linear", weak | {"twist_compliance.compliance": 20.0}, ["twist_compliance"])
    loads, status = soft(states)
    slope = sensitivities(build_model("linear", weak), states)[:, 1, 1]
    firm, unloaded = slope * 20 < 0.5, states.pressure == 0
    assert (status[~unloaded & ~firm] == Status.NO_EQUILIBRIUM).all()
    assert (~unloaded & ~firm).any()
    assert (status[unloaded] == Status.OK).all()
    assert loads.isfinite().all()
