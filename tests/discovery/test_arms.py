"""Creep of more than one time is found arm by arm, on logs by small steps of integration."""

import pytest

import freelearn as fl
from freelearn.testing.reference.simulated_logs import UNIT, log

TWO = {"creep": {"share": 0.15, "time": 0.5}, "second_creep": {"share": 0.25, "time": 8.0}}


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("arms", [TWO, {"creep": UNIT["creep"]}], ids=["two", "one"])
def test_a_search_names_as_many_arms_as_there_are(arms):
    """One arm alone is no class of the three: a further one is tried only beside it."""
    # Bands of the curves ask for fits without a part of the recordings, a third of the whole.
    found = fl.discover(log(arms, 1, recordings=8, seconds=20.0), bands=False, progress=False)
    assert (found.verdict, sorted(found.effects)) == ("named", list(arms))
