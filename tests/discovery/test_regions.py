"""Regions against scikit-learn's regression tree."""

import numpy as np
import pytest
from sklearn.tree import DecisionTreeRegressor

from freelearn.discovery.residuals.regions import regions


@pytest.mark.parametrize("seed", range(5))
def test_the_leaves_are_those_of_scikit_learns_tree(seed):
    generator = np.random.default_rng(seed)
    # Multiples of an eighth: scikit-learn keeps inputs in single precision, where these are exact.
    inputs = {name: generator.integers(-80, 80, 700) / 8 for name in ("a", "b", "c")}
    inputs["d"] = generator.integers(0, 3, 700).astype(float)
    target = generator.normal(size=(700, 2)) + np.stack([inputs["a"] > 2, 2.0 * (inputs["b"] < -3)], axis=1)
    target[inputs["d"] == 1] += 0.7
    least = 0.02 * target.var(0).mean()
    ours = regions(inputs, target, 3, 21, least)
    tree = DecisionTreeRegressor(max_depth=3, min_samples_leaf=21, min_impurity_decrease=least, random_state=0)
    leaf = tree.fit(np.stack(list(inputs.values()), axis=1), target).apply(np.stack(list(inputs.values()), axis=1))
    theirs = {tuple(np.flatnonzero(leaf == node)) for node in np.unique(leaf)}
    assert {tuple(np.flatnonzero(region.inside)) for region in ours} == theirs
    assert len(ours) >= 3
    for region in ours:
        bounded = np.ones(700, dtype=bool)
        for name, limit in region.low.items():
            bounded &= inputs[name] > limit
        for name, limit in region.high.items():
            bounded &= inputs[name] <= limit
        np.testing.assert_array_equal(bounded, region.inside)


def test_a_quantity_that_is_the_same_everywhere_has_one_region():
    (whole,) = regions({"a": np.arange(50.0)}, np.ones((50, 2)), 3, 10, 1e-3)
    assert whole.inside.all()
    assert not whole.low
    assert not whole.high
