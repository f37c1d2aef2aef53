"""Tubes with one or two families of fibers at given states, and the textbook's answer for each."""

import math

import numpy as np
import torch

from freelearn.data.beds import DEG, KINEMATIC, KPA, MM, Bed
from freelearn.data.states import States
from freelearn.testing.reference import textbook

# L, R_i, R_o [mm] of the paper's third sample.
LENGTH, INNER, OUTER = 98.42, 4.77, 6.74
COLUMNS = ("fiber_angle", "reference_length", "inner_radius", "outer_radius", "length", "twist", "pressure")


def tensor(values) -> torch.Tensor:
    return torch.as_tensor(np.atleast_1d(np.asarray(values, dtype=np.float64)))


def tubes(gamma, second, elongation, twist, pressure, bed: Bed = KINEMATIC, **more) -> States:
    """States of tubes with the third sample's sizes: angles and twist [deg], NaN for no second family, elongation [mm],
    pressure [kPa]; each a number or (N,)."""
    gamma, second, elongation, twist, pressure = np.broadcast_arrays(
        *np.atleast_1d(gamma, second, elongation, twist, pressure)
    )
    size = len(gamma)
    some = np.isfinite(second.astype(float))

    def all_of(value: float) -> torch.Tensor:
        return torch.full((size,), value, dtype=torch.float64)

    return States(
        fiber_angle=tensor(gamma * DEG),
        reference_length=all_of(LENGTH * MM),
        inner_radius=all_of(INNER * MM),
        outer_radius=all_of(OUTER * MM),
        length=tensor((LENGTH + elongation) * MM),
        twist=tensor(twist * DEG),
        pressure=tensor(pressure * KPA),
        sample=torch.ones(size, dtype=torch.int64),
        direction=all_of(0.0),
        second_angle=tensor(np.where(some, second, 0.0) * DEG) if some.any() else None,
        second_share=tensor(some) if some.any() else None,
        bed=bed,
        **more,
    )


def random_tubes(count: int, seed: int, blank: float = 0.0) -> States:
    """At random angles and states; a share of them has no second family."""
    generator = np.random.default_rng(seed)
    first, second = generator.uniform(15, 75, (2, count)) * generator.choice([-1, 1], (2, count))
    second = np.where(generator.random(count) < blank, np.nan, second)
    draw = generator.uniform
    return tubes(first, second, draw(-5, 5, count), draw(-100, 100, count), draw(0, 70, count))


def textbook_rows(states: States, **material) -> np.ndarray:
    """Force, moment and inner radius of every row by the textbook, (N, 3); NaN without an equilibrium."""
    answers = []
    for i in range(len(states)):
        row = [float(getattr(states, name)[i]) for name in COLUMNS]
        has = states.second_angle is not None and float(states.second_share[i]) > 0
        second = float(states.second_angle[i]) if has else None
        answers.append(textbook.continuum_row(*row, **material, second=second) or (math.nan,) * 3)
    return np.array(answers)
