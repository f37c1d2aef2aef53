"""The same tubes again and again: what was asked before changes nothing."""

import math

import pytest
import torch

from freelearn.physics.mechanics.same_tubes import SameTubes


@pytest.mark.parametrize("far", [(1e6, math.inf), (1e6, 1e14), (1e6, 1e25), (math.nan, 1e6), (0.0, 0.0), (1e-3, 1e-3)])
def test_moduli_that_a_search_tried_too_far_out_leave_no_trace(random_states, far):
    moduli = torch.tensor([1e6, 2e7], dtype=torch.float64)
    states = random_states(200)
    tubes = SameTubes(states)
    tubes.loads(torch.tensor(far, dtype=torch.float64))
    fresh = SameTubes(states)
    torch.testing.assert_close(tubes.loads(moduli), fresh.loads(moduli), rtol=1e-9, atol=1e-12)
    torch.testing.assert_close(tubes.rates(moduli), fresh.rates(moduli), rtol=1e-6, atol=1e-9)
