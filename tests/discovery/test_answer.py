"""What all sets of effects share that fit: of sets whose evidence is given."""

from types import SimpleNamespace

import pytest

from freelearn.discovery.search.answer import _with_beside, answered


def labeled(names, parameters):
    return SimpleNamespace(labels=lambda: ["C1", *(f"{n}.size[{k}]" for n in names for k in range(parameters))])


class Sets:
    """Sets of effects with their χ² and their evidence, each effect with so many parameters. known beforehand: how much
    less probable the values of some sets are than those of others."""

    def __init__(self, known, unusual=None, parameters=1):
        self.found = {
            frozenset(names): SimpleNamespace(
                effects=names,
                key=frozenset(names),
                fit=SimpleNamespace(chi2=chi2, model=labeled(names, parameters)),
                evidence=-chi2 / 2 - 3 * len(names) - (unusual or {}).get(names, 0.0),
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


# Four actuators' gains are large, and half of that with walls of other thicknesses would be more usual.
GAIN, WALLS = "pressure_gain", "wall_thickness"


@pytest.mark.parametrize(
    ("parameters", "gained", "both"), [(1, 5.0, False), (1, 7.0, True), (4, 9.0, False), (4, 10.0, True)]
)
def test_what_only_unusual_values_ask_for_is_not_claimed(parameters, gained, both):
    """By chance four parameters take nine and a half off χ² in one of twenty, and two six."""
    sets = Sets({(): 900.0, (GAIN,): 100.0 + gained, (WALLS,): 400.0, (GAIN, WALLS): 100.0}, {(GAIN,): 9.0}, parameters)
    answer = answered(sets)
    assert answer.close[0][0].key == {GAIN, WALLS}
    assert set(answer.shown.effects) == ({GAIN, WALLS} if both else {GAIN})
    assert [next(iter(each)) for each in answer.classes] == list(answer.shown.effects)
    assert answer.imitated == []


def test_one_effect_alone_that_the_model_as_it_is_would_need_unusual_values_for_is_claimed():
    answer = answered(Sets({(): 103.0, (WALLS,): 100.0}, {(): 9.0}))
    assert answer.shown.effects == (WALLS,)
