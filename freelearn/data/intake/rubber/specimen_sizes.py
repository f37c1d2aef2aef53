"""Sizes of a specimen that stand above its table: "Specimen Width (mm); 6"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from freelearn.common.errors import UserError
from freelearn.data.intake.headings import split_heading
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.readers.cells import Row, Style
from freelearn.data.intake.readers.told_elsewhere import pairs_of
from freelearn.data.intake.words_abroad import plain

WORDS = {
    "thickness_mm": ("thickness", "dicke", "staerke", "starke", "epaisseur", "spessore", "espesor", "厚"),
    "width_mm": ("width", "breite", "largeur", "larghezza", "ancho", "幅"),
    "length_mm": ("length", "lange", "laenge", "longueur", "lunghezza", "longitud", "標点", "長"),
}


@dataclass(frozen=True)
class Size:
    """value: in mm. words: where it stands, and how."""

    name: str
    value: float
    words: str


def sizes_in(rows: Sequence[Row], style: Style, where: str) -> tuple[Size, ...]:
    """Sizes in rows of names and numbers.

    >>> sizes_in([(2, ["Specimen Width (mm)", "6"])], Style(), "a.csv")
    (Size(name='width_mm', value=6.0, words='a.csv, line 2: Specimen Width (mm) 6'),)
    """
    found: dict[str, Size] = {}
    for line, cells in rows:
        for name, value, unit in pairs_of(cells):
            size = next((key for key, words in WORDS.items() if any(word in plain(name) for word in words)), None)
            number = style.number(value)
            written = split_heading(name)[1] or unit
            if size is None or number is None or not number > 0 or not written:
                continue
            try:
                factor = conversion(written.strip("[]()"), "mm").factor
            except UserError:
                continue
            made = Size(size, float(f"{factor * number:.12g}"), f"{where}, line {line}: {name} {value}")
            found.setdefault(size, made)
    return tuple(found.values())
