"""What all sets of effects share that fit: of sets whose evidence is given."""

from types import SimpleNamespace

import pytest

from freelearn.discovery.search.answer import _with_beside, answered


class Sets:
    """Sets of effects with their χ² and their evidence."""

    def __init__(self, known):
        self.found = {
            frozenset(names): SimpleNamespace(
                effects=names, key=frozenset(names), fit=SimpleNamespace(chi2=chi2), evidence=-chi2 / 2 - 3 * len(names)
            )
            for names, chi2 in known.items()
        }
        self.odds, self.question = {}, SimpleNamespace(unshown={})

    def ordered(self):
        return sorted(self.found.values(), key=lambda each: -each.evidence)

    def reduced(self, shown, names):
        return {name: self.found[shown.key - {name}] for name in names}


# A slow cell explains nearly all, and a zero a thousandth of it.
SLOW, ZERO = "sensor_lag", "force_offset"
SETS = {(): 400e3, (SLOW,): 2300.0, (ZERO,): 399e3, (SLOW, ZERO): 1900.0}


def step(leaves):
    return lambda hypothesis: SimpleNamespace(left=SimpleNamespace(shows=hypothesis.effects in leaves))


def test_what_another_form_of_a_lag_may_be_is_no_part_of_the_answer():
    answer = answered(Sets(SETS))
    assert (answer.shown.effects, answer.imitated) == ((SLOW,), [ZERO])
    assert [list(each) for each in answer.classes] == [[SLOW]]


@pytest.mark.parametrize(
    ("leaves", "shown", "beside"),
    [([(SLOW,)], (SLOW, ZERO), [ZERO]), ([], (SLOW,), []), ([(SLOW,), (SLOW, ZERO)], (SLOW,), [])],
)
def test_it_stands_beside_where_something_is_left_without_it_and_nothing_with_it(leaves, shown, beside):
    sets = Sets(SETS)
    models = SimpleNamespace(known=SimpleNamespace(hypotheses=sets, share=0.0), step=step(leaves))
    answer = _with_beside(models, answered(sets), [])
    assert (answer.shown.effects, answer.beside) == (shown, beside)
    assert [list(each) for each in answer.classes] == [[SLOW]]


def test_what_explains_more_than_a_form_of_the_lag_is_claimed():
    answer = answered(Sets(SETS | {(SLOW,): 60e3}))
    assert sorted(next(iter(each)) for each in answer.classes) == [ZERO, SLOW]
