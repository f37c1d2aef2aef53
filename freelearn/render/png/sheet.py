"""Fields in rows and columns with color bars, placed by hand: matplotlib's placing takes room from the fields."""

from __future__ import annotations

from dataclasses import dataclass

Place = tuple[float, float, float, float]

LEFT, BAR = 0.8, 0.15


@dataclass(frozen=True)
class Sheet:
    """Everything in inches. across, down: numbers of fields; wide, high: a field; apart, below: the room between two;
    right: beside the last one; top: over the highest; foot: under the lowest."""

    across: int
    down: int
    wide: float
    high: float
    apart: float
    below: float
    right: float
    top: float
    foot: float

    @property
    def width(self) -> float:
        """Of the figure."""
        return LEFT + self.across * self.wide + (self.across - 1) * self.apart + self.right

    @property
    def height(self) -> float:
        """Of the figure."""
        return self.top + self.down * self.high + (self.down - 1) * self.below + self.foot

    def field(self, column: int, row: int) -> Place:
        """Left, bottom, width and height of a field, as shares of the figure."""
        x, y = LEFT + column * (self.wide + self.apart), self.foot + (self.down - 1 - row) * (self.high + self.below)
        return x / self.width, y / self.height, self.wide / self.width, self.high / self.height

    def bar(self, column: int, row: int) -> Place:
        """The same of a color bar beside a field."""
        x, y, wide, high = self.field(column, row)
        return x + wide + 0.12 / self.width, y, BAR / self.width, high
