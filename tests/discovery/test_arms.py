"""Creep of more than one time is found arm by arm, on logs by small steps of integration."""

import pytest
from relaxing_logs import relaxing_log

import freelearn as fl

ACCURACY = fl.Accuracy(force_n=0.1, moment_nmm=1.0, pressure_kpa=0.01, elongation_mm=0.01, twist_deg=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arms", "effects"), [({0.5: 0.15, 8.0: 0.25}, ["creep", "second_creep"]), ({3.0: 0.2}, ["creep"])]
)
def test_a_search_names_as_many_arms_as_there_are(arms, effects):
    """One arm alone is no class of the three: a further one is tried only beside it."""
    table = relaxing_log(arms, 1, recordings=5, rate=5.0, seconds=20.0, noise=(0.1, 1.0))
    found = fl.discover(table, accuracy=ACCURACY, progress=False)
    assert (found.verdict, sorted(found.effects)) == ("named", effects)
