"""A table as it is shown, in whatever it is shown, and the colors of every picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from freelearn.common.formats import number

# Okabe & Ito's colors, told apart by color-blind readers; line styles and markers differ as well.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Residuals: diverging, and light in the middle (ColorBrewer's PuOr, orange to purple): the sign survives color
# blindness, the size survives grayscale.
DIVERGING = (
    "#7f3b08", "#b35806", "#e08214", "#fdb863", "#fee0b6", "#f7f7f7", "#d8daeb", "#b2abd2", "#8073ac", "#542788",
    "#2d004b",
)  # fmt: skip


# A table as it is shown, in whatever it is shown: page, terminal or text.


@dataclass(frozen=True)
class Column:
    """words: text, which stands on the left and may take several lines; numbers stand on the right, never cut."""

    heading: str
    words: bool = False


@dataclass(frozen=True)
class DisplayTable:
    """Finished cells, row by row; as many in each as there are columns. title above, caption below; "" for none.

    >>> table = DisplayTable.from_rows(["test set"], ["E %"], [["all", "1.25"]], title="errors")
    >>> print(table.text())
    test set   E %
    all       1.25
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    caption: str = ""

    def __post_init__(self) -> None:
        """Raises ValueError for a row of another length."""
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"{len(self.columns)} columns, but a row of {len(row)} cells: {row}")

    @classmethod
    def from_rows(
        cls,
        words: Sequence[str],
        numbers: Sequence[str],
        rows: Sequence[Sequence[str]],
        title: str = "",
        caption: str = "",
        last: Sequence[str] = (),
    ) -> DisplayTable:
        """A table whose first columns hold words, the next numbers, and the `last` ones words again."""
        columns = [*(Column(n, True) for n in words), *(Column(n) for n in numbers), *(Column(n, True) for n in last)]
        return cls(tuple(columns), tuple(tuple(row) for row in rows), title, caption)

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, title: str = "", caption: str = "") -> DisplayTable:
        """The frame's columns under their names: floats with four digits, anything else as it is."""
        columns = tuple(
            Column(str(name).replace("_", " "), not pd.api.types.is_numeric_dtype(frame[name])) for name in frame
        )
        rows = tuple(
            tuple(number(cell, 4) if isinstance(cell, float) else str(cell) for cell in row)
            for row in frame.itertuples(index=False)
        )
        return cls(columns, rows, title, caption)

    def text(self, indent: str = "") -> str:
        """Headings and rows in columns of equal width, a line each."""
        lines = [tuple(column.heading for column in self.columns), *self.rows]
        widths = [max(map(len, cells)) for cells in zip(*lines, strict=True)]
        return "\n".join(
            indent
            + "  ".join(
                cell.ljust(width) if column.words else cell.rjust(width)
                for cell, width, column in zip(line, widths, self.columns, strict=True)
            ).rstrip()
            for line in lines
        )
