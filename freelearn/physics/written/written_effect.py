"""An effect that is written down by the program: where it enters, what it depends on, its form and its constants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from freelearn.physics.written.forms import Form, Shape, amount
from freelearn.physics.written.places import Input, Place, same_as


@dataclass(frozen=True)
class Written:
    """place, inputs and form; scales: what each input counts in, SI; starts: amounts and shapes by name, SI; lines: of
    the evidence, for readers of the file; each: whether every actuator on an end block has amounts of its own."""

    place: Place
    inputs: tuple[Input, ...]
    scales: tuple[float, ...]
    form: Form
    starts: Mapping[str, float]
    lines: tuple[str, ...] = field(default=())
    each: bool = False

    @property
    def name(self) -> str:
        """A word of letters, digits and underscores: what it changes, in which form, by what."""
        if self.place.energy:
            return f"{self.place.short}_{self.form.word}"
        inputs = reversed(self.inputs) if self.form.turned else self.inputs
        return f"{self.place.short}_{self.form.word}_of_{'_and_'.join(i.name for i in inputs)}"

    @property
    def inputs_named(self) -> list[str]:
        """What it depends on, the direction of the pressure change too."""
        return [*(["direction"] if self.place.rubs else []), *(i.name for i in self.inputs)]

    @property
    def same_as(self) -> str:
        """The other place at which it would change the loads alike, "" where there is none."""
        return same_as(self.place, self.inputs)

    @property
    def formula(self) -> str:
        """For readers: ΔF = a Δl² with letters for its constants."""
        symbols = dict(zip("xy", (i.symbol for i in self.inputs), strict=False))
        letters = dict(zip("ab", self.amount_symbols, strict=False))
        text = self.form.formula
        for i, symbol in symbols.items():
            # Of several words: I₁ − 3.
            text = text.replace(f"({{{i}}})", f"({symbol})").replace(
                f"{{{i}}}", f"({symbol})" if " " in symbol else symbol
            )
        body = text.format(**letters)
        if self.place.rubs:
            return f"Δ{self.place.symbol} = −sgn(ΔP) · {f'({body})' if len(self.form.terms) > 1 else body}"
        return f"Δ{self.place.symbol} = {body}"

    @property
    def amount_symbols(self) -> list[str]:
        """Symbols of the amounts."""
        count = len(self.form.terms)
        return list("ab"[:count]) if count <= 2 else [f"a{i}" for i in range(count)]

    def constants(self) -> list[Constant]:
        """All of them: the amounts, then the shapes."""
        place = self.place
        amounts = [
            Constant(amount(i), symbol, place.unit, place.shown, place.factor, self.starts.get(amount(i), 0.0), True)
            for i, symbol in enumerate(self.amount_symbols)
        ]
        return amounts + [self._shape(shape) for shape in self.form.shapes]

    def _shape(self, shape: Shape) -> Constant:
        of, scale = self.inputs[shape.place], self.scales[shape.place]
        symbol = shape.symbol.format(x=self.inputs[0].symbol, y=self.inputs[-1].symbol).replace(" − 3", "").replace(
            " − 1", ""
        )  # fmt: skip
        size = scaled(shape, scale)
        unit, shown, factor = {
            "x": (of.unit, of.shown, of.factor),
            "1/x": (f"1/{of.unit}" if of.unit != "1" else "1", f"1/{of.shown}" if of.shown else "", 1 / of.factor),
            "": ("1", "", 1.0),
        }[shape.of]
        ends = shape.lower * size, shape.upper * size
        return Constant(shape.name, symbol, unit, shown, factor, self.starts[shape.name], False, *ends)

    def started(self, starts: Mapping[str, float]) -> Written:
        """The same with other values of its constants, SI."""
        return replace(self, starts=dict(starts))


def scaled(shape: Shape, scale: float) -> float:
    """Factor from a shape in units of the input's scale to SI."""
    return {"x": scale, "1/x": 1 / scale, "": 1.0}[shape.of]


@dataclass(frozen=True)
class Constant:
    """A constant of a written effect: its names and units, as in Input; start, lower and upper in SI."""

    name: str
    symbol: str
    unit: str
    shown: str
    factor: float
    start: float
    amount: bool
    lower: float = float("-inf")
    upper: float = float("inf")
