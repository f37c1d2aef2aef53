"""Written effects of every place, inputs and form, and what their closed forms say, by hand in NumPy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np
import torch

from freelearn.data.states import States
from freelearn.physics.effects.registry import lent
from freelearn.physics.models.build import build_model
from freelearn.physics.written.forms import ENERGIES, ONE, TWO, Form, amount
from freelearn.physics.written.places import PLACES, Input, Place
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import Written, scaled
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

Inputs = tuple[Input, ...]
Array = np.ndarray[Any, Any]
# What each input counts in, SI: about the largest that the paper's bed has.
SCALES = {
    **{"elongation": 5e-3, "twist": 2.0, "pressure": 7e4, "force": 40.0, "moment": 0.2, "time": 2e4, "severity": 0.4},
    **{"i1": 0.2, "i2": 0.2, "i4": 0.1},
}
# What a function may add to each place, SI, so that it shows and the actuator keeps its equilibrium.
AMOUNTS = {
    **{"boundary length": 3e-4, "boundary twist": 0.02, "boundary pressure": 1e3, "geometry fiber_angle": 0.01},
    **{"geometry outer_radius": 1e-4, "geometry reference_length": 3e-4, "geometry active_length": -3e-4},
    **{"energy i1": 2e4, "energy i2": 2e4, "energy i4": 2e4, "parallel axial": 0.5, "parallel torsional": 5e-3},
    **{"parallel both": 2e-3, "dissipation force": 0.3, "dissipation moment": 4e-3, "dissipation wall": -0.05},
    **{"measurement force": 0.4, "measurement moment": 5e-3},
}
PLACE = {place.name: place for place in PLACES}
FORM = {form.word: form for form in ONE}
ENERGY = {form.word: form for form in ENERGIES}


def inputs_at(place: Place) -> Iterator[Inputs]:
    """All that a function at the place may depend on: one input, or two."""
    if place.energy:
        yield place.inputs
        return
    if not place.potential:
        yield from ((i,) for i in place.inputs)
    yield from combinations(place.inputs, 2)


def forms_at(place: Place, inputs: Inputs) -> tuple[Form, ...]:
    return ENERGIES if place.energy else ONE if len(inputs) == 1 else TWO


def everything() -> Iterator[tuple[Place, Inputs, Form]]:
    """Every place with every input or two and every form."""
    for place in PLACES:
        for inputs in inputs_at(place):
            yield from ((place, inputs, form) for form in forms_at(place, inputs))


def middle(form: Form) -> dict[str, float]:
    """A value from the middle of what is tried for each shape."""
    return {shape.name: shape.grid[len(shape.grid) // 2] for shape in form.shapes}


def amounts(place: Place, form: Form) -> dict[str, float]:
    """Of each term: the first as AMOUNTS says, each other half and opposite to the one before."""
    return {amount(i): AMOUNTS[place.name] * (-0.5) ** i for i in range(len(form.terms))}


def wrote(place: Place, inputs: Inputs, form: Form, values: Mapping[str, float] | None = None, **more: Any) -> Written:
    """values: of the amounts, SI, and of the shapes in units of their inputs' scales."""
    values = amounts(place, form) | middle(form) | dict(values or {})
    scales = tuple(SCALES[i.name] for i in inputs)
    starts = {name: value for name, value in values.items() if name.startswith(("amount", "second"))}
    for shape in form.shapes:
        starts[shape.name] = values[shape.name] * scaled(shape, scales[shape.place])
    return Written(place, inputs, scales, form, starts, **more)


def named(place: str, inputs: str, form: str) -> Written:
    """By the names of the place, of the inputs (split by blanks) and of the form."""
    here = PLACE[place]
    known = {i.name: i for i in here.inputs}
    own = tuple(known[name] for name in inputs.split())
    return wrote(here, own, next(f for f in forms_at(here, own) if f.word == form))


def states_of(count: int = 3) -> States:
    """Four pressures at each of so many kinematic states of two samples, in the order of a clock."""
    return States.from_table(visits(count))


def model_with(written: Written, on: bool = True, family: str = "continuum"):
    """The model with the effect at its starts, or at no amount."""
    kind = effect_class(written)
    with lent([kind]):
        model = build_model(family, TRUTH[family], [kind.name])
    model.set_values({f"{kind.name}.{c.name}": c.start if on or not c.amount else 0.0 for c in written.constants()})
    return model


def loads(model, states: States) -> Array:
    """Force and moment, (N, 2), of states that all have an equilibrium."""
    with torch.no_grad():
        shown, status = model(states)
    assert (status == 0).all()
    return shown.numpy()


# --- the closed forms by hand -----------------------------------------------------------------------------------------

Terms = Callable[[Array, Mapping[str, float]], tuple[Array, ...]]


def over(x: Array, edge: float) -> Array:
    return np.where(x > edge, x - edge, 0.0)


# Each term of every form of one input, in its units.
BY_HAND: dict[str, Terms] = {
    "linear": lambda x, p: (x,),
    "square": lambda x, p: (x * x,),
    "cube": lambda x, p: (x * x * x,),
    "linear_and_square": lambda x, p: (x, x * x),
    "linear_and_cube": lambda x, p: (x, x**3),
    "square_and_cube": lambda x, p: (x**2, x**3),
    "modulus": lambda x, p: (np.where(x < 0, -x, x),),
    "vee": lambda x, p: (np.abs(x - p["knee"]),),
    "sign": lambda x, p: (np.where(x > 0, 1.0, np.where(x < 0, -1.0, 0.0)),),
    "odd_square": lambda x, p: (np.sign(x) * x**2,),
    "power": lambda x, p: (np.abs(x) ** p["exponent"],),
    "odd_power": lambda x, p: (np.sign(x) * np.abs(x) ** p["exponent"],),
    "hinge": lambda x, p: (over(x, p["knee"]),),
    "falling_hinge": lambda x, p: (over(-x, -p["knee"]),),
    "square_hinge": lambda x, p: (over(x, p["knee"]) ** 2,),
    "dead_band": lambda x, p: (over(x, p["knee"]) - over(-x, p["knee"]),),
    "sine": lambda x, p: (np.sin(p["rate"] * x),),
    "wave": lambda x, p: (np.sin(p["rate"] * x), np.cos(p["rate"] * x)),
    "exponential": lambda x, p: (np.exp(p["growth"] * x) - 1,),
    "saturation": lambda x, p: (np.tanh(p["steepness"] * x),),
    "step": lambda x, p: (1 / (1 + np.exp(np.clip((p["jump"] - x) / 0.004, -500, 500))),),
    "bump": lambda x, p: (np.exp(-((p["steepness"] * (x - p["center"])) ** 2)),),
}
ENERGIES_BY_HAND: dict[str, Terms] = {
    "square": lambda x, p: (x**2,),
    "cube": lambda x, p: (x**3,),
    "fourth_power": lambda x, p: (x**4,),
    "power": lambda x, p: (np.abs(x) ** p["exponent"],),
    "tension": lambda x, p: (over(x, 0.0) ** 2,),
    "square_hinge": lambda x, p: (over(x, p["knee"]) ** 2,),
    "falling_square_hinge": lambda x, p: (over(-x, -p["knee"]) ** 2,),
    "exponential": lambda x, p: (np.exp(p["growth"] * x) - 1,),
    "exponential_of_square": lambda x, p: (np.exp(p["growth"] * x**2) - 1,),
    "logarithm": lambda x, p: (np.log(1 + p["steepness"] * np.abs(x)),),
    "saturation": lambda x, p: (1 - np.exp(-p["steepness"] * x**2),),
}


def terms_by_hand(form: Form, inputs: list[Array], shapes: Mapping[str, float], energy: bool = False) -> list[Array]:
    """The terms of a form at inputs in units of their scales. A product's word says its factors, x's before y's;
    turned, y's before x's."""
    if len(inputs) == 1:
        return list((ENERGIES_BY_HAND if energy else BY_HAND)[form.word](inputs[0], shapes))
    first, second = form.word.split("_times_")
    x, y = reversed(inputs) if form.turned else inputs
    (factor,) = BY_HAND[second](y, {})
    return [term * factor for term in BY_HAND[first](x, shapes)]
