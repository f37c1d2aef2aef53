"""An amplifier filters both of its channels alike, as often as not: where nothing but the pressure moves, that looks
like a pressure that comes late."""

import pytest

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import log


def searched(hidden, seed):
    """What a search finds of four recordings at held lengths and twists."""
    table = log(hidden, seed, recordings=4, moves=False)
    rows = Rows.from_table(table)
    return search(
        question_of_rows(lambda names: build_model("continuum", {}, names, [4]), table.columns, rows, PAPER, 0)
    )


@pytest.mark.parametrize("hidden", [{"sensor_lag": {"force": 0.3, "moment": 0.3}}, {"supply_lag": {"time": 0.3}}])
def test_a_slow_amplifier_and_a_narrow_line_are_told_as_either(hidden):
    """Two numbers that happen to be the same were held for less probable than one, and the line was named for them."""
    found = searched(hidden, 5)
    assert found.verdict == "class"
    assert {"sensor_lag", "supply_lag"} <= set(found.classes[0])


def test_channels_that_are_filtered_apart_are_named():
    found = searched({"sensor_lag": {"force": 0.35, "moment": 0.15}}, 6)
    assert (found.verdict, found.effects) == ("named", ["sensor_lag"])
