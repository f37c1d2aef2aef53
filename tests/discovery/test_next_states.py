"""What to measure next, and what no measurement would tell."""

from freelearn.discovery.search.next_states import NextState, telling


def test_states_that_tell_nothing_are_not_proposed_but_said():
    useful = NextState(3, 5.0, 120.0, 72.5, ["force_gain", "pressure_gain"], 12.3)
    useless = NextState(3, 5.0, 120.0, 0.0, ["pressure_gain", "line_loss"], 0.0)
    proposed, twins = telling([useful, useless])
    assert proposed == [useful]
    assert len(twins) == 1
    assert "pressure_gain from line_loss" in twins[0]
