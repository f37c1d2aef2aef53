"""Closed forms that an unknown function of one or two inputs may have: short ones, with few constants."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import torch
from torch import Tensor


def amount(number: int) -> str:
    """Name of the factor of a form's term: amount, second, amount_2, …

    >>> amount(0), amount(1), amount(2)
    ('amount', 'second', 'amount_2')
    """
    return ("amount", "second")[number] if number < 2 else f"amount_{number}"


# Largest product of a shape with the distance of two levels of its input that these can still tell: half of Nyquist's
# rate, for at that a wave may be zero at every level.
QUICKEST = {"rate": math.pi / 2, "steepness": 1.0}


@dataclass(frozen=True)
class Shape:
    """A constant inside a form. name: as in a template; symbol: in formulas; of: "x" where it is a value of the input,
    "1/x" where it multiplies it, "" for a plain number. grid: values tried first, lower and upper: its bounds, all for
    an input in units of its largest value."""

    name: str
    symbol: str
    of: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    # Which of the inputs: 0 or 1.
    place: int = 0

    def told_by(self, levels: Sequence[float]) -> Shape:
        """The same for an input that was measured at these levels, in units of its largest value."""
        if self.name == "knee":
            return self._within(levels)
        if self.name not in QUICKEST or len(levels) < 2:
            return self
        spacing = (levels[-1] - levels[0]) / (len(levels) - 1)
        most = max(min(self.upper, QUICKEST[self.name] / max(spacing, 1e-9)), 2 * self.lower)
        grid = tuple(value for value in self.grid if value <= most) or (most,)
        return replace(self, grid=grid, upper=most)

    def _within(self, levels: Sequence[float]) -> Shape:
        """A bend with two levels on either side: a slope on a single one would only follow its readings' errors."""
        if len(levels) < 4:
            return self
        low, high = max(self.lower, levels[1]), min(self.upper, levels[-2])
        grid = tuple(value for value in self.grid if low < value < high) or ((low + high) / 2,)
        return replace(self, grid=grid, lower=low, upper=high)


@dataclass(frozen=True)
class Form:
    """A function of one or two inputs, linear in its amounts.

    word: its name; family: its kind. terms: one template for each amount, in Python, with {x}, {y} for the inputs in
    units of their largest values and {name} for each shape. formula: the same for readers, with {a}, {b} for the
    amounts, {x}, {y} for the inputs and shapes by name. signed: whether it differs from simpler ones only for inputs of
    both signs.
    """

    word: str
    family: str
    terms: tuple[str, ...]
    formula: str
    shapes: tuple[Shape, ...] = ()
    signed: bool = False
    inputs: int = 1
    turned: bool = False

    @property
    def count(self) -> int:
        """How many constants it has."""
        return len(self.terms) + len(self.shapes)

    def told_by(self, levels: Sequence[Sequence[float]]) -> Form:
        """The same for inputs that were measured at these levels, in units of their largest values: what is quicker
        could be anything between them, and what passes through them all could still follow their readings' errors."""
        return replace(self, shapes=tuple(shape.told_by(levels[shape.place]) for shape in self.shapes))

    @property
    def has_room(self) -> bool:
        """Whether each shape has values to choose among: a bend in a wrong place between few levels has none."""
        return all(shape.lower < shape.upper for shape in self.shapes)

    def grid(self) -> Iterator[dict[str, float]]:
        """Values of the shapes to try."""
        for values in product(*(shape.grid for shape in self.shapes)):
            yield dict(zip((s.name for s in self.shapes), values, strict=True))

    def values(self, inputs: list[Tensor], shapes: Mapping[str, float]) -> list[Tensor]:
        """Each term at inputs in units of their largest values, each (…), for one choice of the shapes."""
        names = {"x": "inputs.x", "y": "inputs.y"} | {s.name: f"shapes.{s.name}" for s in self.shapes}
        here = SimpleNamespace(**dict(zip("xy", inputs, strict=False)))
        own = SimpleNamespace(**shapes)
        return [_compiled(term.format(**names))(here, own) for term in self.terms]


@cache
def _compiled(expression: str) -> Callable[[SimpleNamespace, SimpleNamespace], Tensor]:
    """An expression of this module as a function. Templates are constants here: nothing from outside is evaluated."""
    function: Callable[[SimpleNamespace, SimpleNamespace], Tensor] = eval(
        f"lambda inputs, shapes: {expression}", {"torch": torch}
    )
    return function


def _even(first: float, last: float, count: int) -> tuple[float, ...]:
    return tuple(torch.linspace(first, last, count, dtype=torch.float64).tolist())


RATES = _even(1.0, 32.0, 40)
KNEE = Shape("knee", "{x}₀", "x", (-0.75, -0.5, -0.25, 0.0, 0.15, 0.3, 0.45, 0.6, 0.75), -1.0, 1.0)
CENTER = Shape("center", "{x}₀", "x", (*_even(-0.9, 0.9, 10), 0.0, 0.5), -1.2, 1.2)
STEEP = Shape("steepness", "k", "1/x", (2.0, 4.0, 8.0, 16.0), 0.5, 60.0)
RATE = Shape("rate", "k", "1/x", RATES, 0.2, 60.0)
GROWTH = Shape("growth", "k", "1/x", (-6.0, -4.0, -2.5, -1.5, 1.5, 2.5, 4.0, 6.0), -12.0, 12.0)
EXPONENT = Shape("exponent", "n", "", (0.5, 1.5, 2.5, 4.0), 0.2, 8.0)
JUMP = Shape("jump", "{x}₀", "x", _even(-0.95, 0.95, 39), -1.0, 1.0)
# Below this share of the largest value a power is that of it: its derivative by the exponent has no limit at zero.
SMALL = "1e-6"

POLYNOMIALS = (
    Form("linear", "linear", ("{x}",), "{a} {x}"),
    Form("square", "polynomial", ("{x}**2",), "{a} {x}²"),
    Form("cube", "polynomial", ("{x}**3",), "{a} {x}³"),
    Form("linear_and_square", "polynomial", ("{x}", "{x}**2"), "{a} {x} + {b} {x}²"),
    Form("linear_and_cube", "polynomial", ("{x}", "{x}**3"), "{a} {x} + {b} {x}³"),
    Form("square_and_cube", "polynomial", ("{x}**2", "{x}**3"), "{a} {x}² + {b} {x}³"),
)
SHAPED = (
    Form("modulus", "modulus", ("torch.abs({x})",), "{a} |{x}|", signed=True),
    Form("vee", "modulus", ("torch.abs({x} - {knee})",), "{a} |{x} − {x}₀|", (KNEE,), signed=True),
    Form("sign", "sign", ("torch.sign({x})",), "{a} sgn {x}", signed=True),
    Form("odd_square", "power", ("{x} * torch.abs({x})",), "{a} {x} |{x}|", signed=True),
    Form("power", "power", (f"torch.abs({{x}}).clamp_min({SMALL}) ** {{exponent}}",), "{a} |{x}|ⁿ", (EXPONENT,)),
    Form(
        "odd_power",
        "power",
        (f"torch.sign({{x}}) * torch.abs({{x}}).clamp_min({SMALL}) ** {{exponent}}",),
        "{a} sgn({x}) |{x}|ⁿ",
        (EXPONENT,),
        signed=True,
    ),
    Form("hinge", "hinge", ("torch.relu({x} - {knee})",), "{a} max({x} − {x}₀, 0)", (KNEE,)),
    Form("falling_hinge", "hinge", ("torch.relu({knee} - {x})",), "{a} max({x}₀ − {x}, 0)", (KNEE,)),
    Form("square_hinge", "hinge", ("torch.relu({x} - {knee}) ** 2",), "{a} max({x} − {x}₀, 0)²", (KNEE,)),
    Form(
        "dead_band",
        "hinge",
        ("torch.sign({x}) * torch.relu(torch.abs({x}) - {knee})",),
        "{a} sgn({x}) max(|{x}| − {x}₀, 0)",
        (Shape("knee", "{x}₀", "x", (0.15, 0.3, 0.45, 0.6, 0.75), 0.0, 1.0),),
        signed=True,
    ),
    Form("sine", "sine", ("torch.sin({rate} * {x})",), "{a} sin(k {x})", (RATE,)),
    Form(
        "wave",
        "sine",
        ("torch.sin({rate} * {x})", "torch.cos({rate} * {x})"),
        "{a} sin(k {x}) + {b} cos(k {x})",
        (RATE,),
    ),
    Form("exponential", "exponential", ("torch.expm1({growth} * {x})",), "{a} (exp(k {x}) − 1)", (GROWTH,)),
    Form("saturation", "saturation", ("torch.tanh({steepness} * {x})",), "{a} tanh(k {x})", (STEEP,)),
    Form("step", "step", ("torch.sigmoid(({x} - {jump}) / 0.004)",), "{a} ({x} > {x}₀)", (JUMP,)),
    Form(
        "bump",
        "bump",
        ("torch.exp(-((({x} - {center}) * {steepness}) ** 2))",),
        "{a} exp(−k² ({x} − {x}₀)²)",
        (CENTER, STEEP),
    ),
)
ONE = POLYNOMIALS + SHAPED

# Of an energy: the symbol of its input has an index already.
EDGE = replace(KNEE, symbol="x₀")
# |x|, whose second derivative torch takes without loading a compiler, as it would for torch.abs.
MODULUS = "torch.maximum({x}, -({x}))"
# Strain energies: their slopes have no jumps, and a term in proportion to I₁ − 3 is the wall's own.
ENERGIES = (
    Form("square", "polynomial", ("{x}**2",), "{a} ({x})²"),
    Form("cube", "polynomial", ("{x}**3",), "{a} ({x})³"),
    Form("fourth_power", "polynomial", ("{x}**4",), "{a} ({x})⁴"),
    Form(
        "power",
        "power",
        (f"{MODULUS}.clamp_min({SMALL}) ** {{exponent}}",),
        "{a} |{x}|ⁿ",
        (Shape("exponent", "n", "", (1.3, 1.7, 2.5, 3.5, 5.0), 1.05, 9.0),),
    ),
    Form("tension", "hinge", ("torch.relu({x}) ** 2",), "{a} max({x}, 0)²", signed=True),
    Form("square_hinge", "hinge", ("torch.relu({x} - {knee}) ** 2",), "{a} max({x} − x₀, 0)²", (EDGE,)),
    Form("falling_square_hinge", "hinge", ("torch.relu({knee} - {x}) ** 2",), "{a} max(x₀ − {x}, 0)²", (EDGE,)),
    Form("exponential", "exponential", ("torch.expm1({growth} * {x})",), "{a} (exp(k ({x})) − 1)", (GROWTH,)),
    Form(
        "exponential_of_square",
        "exponential",
        ("torch.expm1({growth} * {x}**2)",),
        "{a} (exp(k ({x})²) − 1)",
        (Shape("growth", "k", "", (1.5, 3.0, 5.0), 0.1, 12.0),),
    ),
    Form(
        "logarithm",
        "saturation",
        (f"torch.log1p({{steepness}} * {MODULUS})",),
        "{a} ln(1 + k |{x}|)",
        (Shape("steepness", "k", "1/x", (1.0, 3.0, 10.0, 30.0), 0.1, 300.0),),
    ),
    Form(
        "saturation",
        "saturation",
        ("1 - torch.exp(-{steepness} * {x}**2)",),
        "{a} (1 − exp(−k ({x})²))",
        (Shape("steepness", "k", "", (1.0, 3.0, 10.0, 30.0), 0.1, 300.0),),
    ),
)


def _few(shape: Shape, count: int, place: int) -> Shape:
    """The shape of a factor among two, tried at fewer values."""
    step = max(1, len(shape.grid) // count)
    symbol = shape.symbol if place == 0 else shape.symbol.replace("{x}", "{y}")
    return Shape(shape.name, symbol, shape.of, shape.grid[::step], shape.lower, shape.upper, place)


def _products() -> Iterator[Form]:
    """Products of a function of x and one of y."""
    plain = (
        ("linear", "{x}", "{x}", False),
        ("square", "{x}**2", "{x}²", False),
        ("modulus", "torch.abs({x})", "|{x}|", True),
    )
    for (one, f, shown_f, first), (other, g, shown_g, second) in product(plain, plain):
        term, formula = f"{f} * {g.replace('{x}', '{y}')}", f"{{a}} {shown_f} {shown_g.replace('{x}', '{y}')}"
        yield Form(f"{one}_times_{other}", "product", (term,), formula, signed=first or second, inputs=2)
    shaped = [form for form in SHAPED if form.family in ("hinge", "sine", "exponential", "saturation", "power", "bump")]
    for form, (other, g, shown_g, _) in product(shaped, plain[:2]):
        if len(form.shapes) > 1 and g != "{x}":
            continue
        terms = tuple(f"({term}) * {g.replace('{x}', '{y}')}" for term in form.terms)
        whole = f"({form.formula})" if len(terms) > 1 else form.formula
        formula = f"{whole} {shown_g.replace('{x}', '{y}')}"
        shapes = tuple(_few(shape, 12 if shape.of == "1/x" else 5, 0) for shape in form.shapes)
        yield (both := Form(f"{form.word}_times_{other}", "product", terms, formula, shapes, form.signed, 2))
        yield swapped(both)


def swapped(form: Form) -> Form:
    """A form of two inputs with their places exchanged."""

    def other(text: str) -> str:
        return text.replace("{x}", "{z}").replace("{y}", "{x}").replace("{z}", "{y}")

    shapes = tuple(
        Shape(s.name, other(s.symbol), s.of, s.grid, s.lower, s.upper, 1 - s.place) for s in form.shapes
    )  # fmt: skip
    return Form(
        form.word,
        form.family,
        tuple(map(other, form.terms)),
        other(form.formula),
        shapes,
        form.signed,
        2,
        not form.turned,
    )


TWO = tuple(_products())
