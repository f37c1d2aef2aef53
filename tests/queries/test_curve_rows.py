"""Rows of an end block that make up a curve: one actuator moves, the others hold as real ones do."""

import numpy as np
import pandas as pd
import pytest

from freelearn.queries.curves.curve_rows import curves_of, levels, sweep, sweep_text


def pressures(rows) -> pd.DataFrame:
    rows = np.asarray(rows, dtype=float)
    return pd.DataFrame({f"pressure_{i}_kpa": column for i, column in enumerate(rows.T, 1)})


def test_a_curve_of_an_end_block_has_one_actuator_moving():
    table = pressures([(p1, p2, 20.0 + 0.5 * (p1 > 0)) for p2 in (0.0, 30.0, 60.0) for p1 in (0.0, 30.0, 60.0, 90.0)])
    assert list(curves_of(table, np.zeros(12, dtype=int))) == [0] * 4 + [1] * 4 + [2] * 4
    # All at once are one curve, and so are those of a single actuator.
    together = pressures([(p, p) for p in (0.0, 30.0, 60.0)])
    assert list(curves_of(together, np.zeros(3, dtype=int))) == [0, 0, 0]
    alone = pd.DataFrame({"pressure_kpa": [0.0, 30.0, 0.0, 30.0]})
    assert list(curves_of(alone, np.array([0, 0, 1, 1]))) == [0, 0, 1, 1]


@pytest.mark.parametrize("jitter", [0.0, 0.5, 3.0])
def test_levels_are_found_through_the_jitter_of_a_real_bed(jitter):
    commanded = np.stack(np.meshgrid(*[np.array([10.0, 30, 57, 81, 109])] * 3, indexing="ij"), -1).reshape(-1, 3)
    read = commanded + np.random.default_rng(1).uniform(-jitter, jitter, commanded.shape)
    table = pd.concat([pressures(read)] * 2, ignore_index=True)
    curve = curves_of(table, np.repeat([0, 1], len(read)))
    # The last one changes from row to row: a curve for each pair of levels of the others, in each of both states.
    _, expected = np.unique(commanded[:, :2], axis=0, return_inverse=True)
    assert curve.tolist() == [*expected, *(expected + 25)]
    rows = table[curve == 7]
    assert sweep(rows).over.symbol == "P3"
    assert [q.symbol for q in sweep(rows).held] == ["P1", "P2"]
    assert sweep_text(rows).startswith("P3, P1 at ")


def test_levels_nearer_than_others_and_none_at_all():
    generator = np.random.default_rng(2)
    wide = np.repeat(np.arange(9) * 8.6, 40)
    found = levels(wide + generator.uniform(-2.6, 2.6, len(wide)))
    assert found.tolist() == np.repeat(np.arange(9), 40).tolist()
    assert levels(np.array([0.0, 5.0, 100.0, 5.0])).tolist() == [0, 1, 2, 1]
    # Held, as far as a bed can: what others go through tells.
    assert (levels(20 + generator.normal(size=50), widest=100.0) == 0).all()
    # A pressure that takes any value has no levels.
    assert len(np.unique(levels(np.linspace(0, 100, 300)))) == 21


def test_one_after_the_other_and_some_together():
    up = [0.0, 30.0, 60.0, 90.0]
    turns = [(p, 0.0, 0.0) for p in up] + [(0.0, p, 0.0) for p in up[1:]] + [(p, p, p) for p in up[1:]]
    curve = curves_of(pressures(turns), np.zeros(len(turns), dtype=int))
    assert curve.tolist() == [0] * 4 + [1] * 3 + [2] * 3
    # Two rise together, one twice as far, at two levels of the third.
    pair = pressures([(p, 2 * p + 7, held) for held in (0.0, 50.0) for p in up])
    curve = curves_of(pair, np.zeros(8, dtype=int))
    assert curve.tolist() == [0] * 4 + [1] * 4
    assert sweep_text(pair[curve == 1]) == "P1 + P2, P3 at 50 kPa"
    assert sweep(pair[curve == 1]).over.symbol == "P2"


def test_a_single_row_is_called_by_its_pressures():
    assert sweep_text(pressures([(10.0, 0.0, 30.0)])) == "P1 at 10 kPa, P3 at 30 kPa"
    assert curves_of(pressures([(10.0, 0.0, 30.0)]), np.array([0])).tolist() == [0]


def test_an_actuator_that_is_never_inflated_is_no_lead():
    one = pressures([(0.0, p, 0.0) for p in (0.0, 20.0, 40.0, 60.0, 40.0, 20.0)])
    assert curves_of(one, np.zeros(6, dtype=int)).tolist() == [0] * 6
    assert sweep_text(one) == "P2"
