"""What to measure next, and what no measurement would tell."""

from freelearn.discovery.search.next_states import NextState, telling


def test_states_that_tell_nothing_are_not_proposed_but_said():
    useful = NextState(3, 5.0, 120.0, 72.5, ["force_gain", "pressure_gain"], 12.3)
    useless = NextState(3, 5.0, 120.0, 0.0, ["pressure_gain", "line_loss"], 0.0)
    proposed, twins = telling([useful, useless])
    assert proposed == [useful]
    assert len(twins) == 1
    assert "pressure_gain from line_loss" in twins[0]


def test_effects_that_no_state_would_split_are_told_together():
    """Of A, B and C no two, and D neither from A nor from E; D would be told from B."""
    names = [("a", "b", 0.2), ("a", "c", 0.7), ("b", "c", 0.1), ("a", "d", 0.4), ("b", "d", 5.0), ("e", "d", 0.9)]
    proposed = [NextState(1, 0.0, 0.0, 50.0, [one, other], z) for one, other, z in names]
    useful, twins = telling(proposed)
    assert [p.separates for p in useful] == [["b", "d"]]
    assert twins == [
        "no state within the bed's reach would tell a, b and c from each other (by 0.7 σ at most)",
        "no state within the bed's reach would tell d from e (by 0.9 σ at most)",
        "no state within the bed's reach would tell a from d (by 0.4 σ at most)",
    ]
