"""Random smooth functions of place and pressure: a misfit that nobody had in mind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from freelearn.testing.reference.total_energy import Extra

Array = np.ndarray[Any, Any]
Function = Callable[[Array], Array]
WORD = "smooth"
# Elongation as a share of the length, twist [rad] and pressure [Pa] that are one; pressures count from there.
SPANS = 0.05, 2.0, 36e3
# Force [N], moment [N·m] and share of the loads of one unit.
FORCE, MOMENT, SHARE = 0.05, 1e-3, 0.02
WHERE = ("both", "force", "moment", "times")


def smooth(name: str) -> Callable[[float], Extra]:
    """Amount → what happens to the loads: the function of `smooth NUMBER` is added to both loads, to one, or they are
    multiplied by one and it."""
    generator = np.random.default_rng([int(name.removeprefix(WORD)), 5])
    where = str(generator.choice(WHERE))
    on_force, on_moment = _sum(generator), _sum(generator)

    def at(amount: float) -> Extra:
        def extra(s: dict[str, Array], loads: Array) -> Array:
            stretched = (s["length"] - s["reference"]) / s["reference"]
            inputs = np.stack([stretched / SPANS[0], s["twist"] / SPANS[1], s["pressure"] / SPANS[2] - 1], axis=-1)
            if where == "times":
                return np.asarray(loads * (1 + SHARE * amount * on_force(inputs))[:, None])
            added = np.stack([FORCE * on_force(inputs), MOMENT * on_moment(inputs)], axis=1)
            return np.asarray(loads + amount * added * [where != "moment", where != "force"])

        return extra

    return at


def _sum(generator: np.random.Generator) -> Function:
    """Of one to three terms."""
    terms = [(generator.normal(), _term(generator)) for _ in range(int(generator.integers(1, 4)))]
    return lambda x: np.asarray(sum(size * term(x) for size, term in terms))


def _term(generator: np.random.Generator) -> Function:
    """A step, a bump, a wave or a product of powers of one to three of the inputs."""
    used = np.isin(range(3), generator.choice(3, int(generator.integers(1, 4)), replace=False))
    kind = str(generator.choice(["step", "bump", "wave", "power"]))
    along, shift = generator.normal(size=3) * used, generator.normal()
    along /= np.linalg.norm(along)
    middle, width = generator.uniform(-0.7, 0.7, 3), generator.uniform(0.4, 1)
    powers = generator.integers(1, 4, 3) * used
    return {
        "step": lambda x: np.tanh(2.5 * x @ along + shift),
        "bump": lambda x: np.exp(-((x - middle) ** 2 * used).sum(-1) / width**2),
        "wave": lambda x: np.sin(3.5 * x @ along + shift),
        "power": lambda x: np.prod(x**powers, axis=-1),
    }[kind]
