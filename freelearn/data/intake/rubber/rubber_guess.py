"""The best guess at files that may hold tests of rubber alone: which sheets, which columns, which way of loading,
and which sizes of a specimen stand above its table."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.guess import column_guess
from freelearn.data.intake.guesses.guessed import ColumnGuess, Guess, with_nan
from freelearn.data.intake.headings import heading, split_heading
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.readers.cells import POINTS, Row, Style
from freelearn.data.intake.readers.raw_files import raw_table, sheet_grid, sheet_names
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.told_elsewhere import pairs_of
from freelearn.data.intake.recipes.recipe import Reading
from freelearn.data.intake.rubber.rubber_convert import specimens
from freelearn.data.intake.rubber.rubber_recipe import ALONG, STRESSES, kind_of, mode_in
from freelearn.data.intake.words_abroad import plain
from freelearn.data.specimen_tests import MOVES, TIME

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


# A specimen that tore carries less than this share of its largest stress at the end.
TORN = 0.7
# A specimen that snaps back as it tears does so in fewer than this share of the rows.
BACK = 0.2


@dataclass(frozen=True)
class RubberGuess:
    """One test. file: "" of the only one. sheet: "" of a file without. mode: "" where nothing names it. along, stress:
    names of the columns, "" where none is likely. columns: of numbers. torn: whether the stress falls at the end.
    time: name of a column of times, "" without one. held: whether the specimen is held or brought back by then.
    sizes: of the specimen, where the file tells some."""

    file: str
    sheet: str
    mode: str
    along: str
    stress: str
    rows: int
    columns: tuple[ColumnGuess, ...]
    torn: bool = False
    time: str = ""
    held: bool = False
    sizes: tuple[Size, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """What the test is called."""
        return " ".join(filter(None, [self.file, f"sheet {self.sheet!r}" if self.sheet else ""])) or "the file"

    def column(self, name: str) -> ColumnGuess:
        """The column of a name."""
        return next(c for c in self.columns if c.name == name)


def plain_tests(tests: Sequence[RubberGuess]) -> list[Any]:
    """For JSON."""
    plain: list[Any] = json.loads(TypeAdapter(list[RubberGuess]).dump_json(list(tests)))
    return plain


def tests_of(content: list[Any]) -> list[RubberGuess]:
    """The tests in plain values. Raises ValueError."""
    return TypeAdapter(list[RubberGuess]).validate_python(with_nan(content))


def looks_like_rubber(found: Guess) -> bool | None:
    """Whether a file holds a test of rubber alone: True where a column is a stress, None where it may be."""
    kinds = {kind_of(c.name, c.unit)[0] for c in found.columns if c.numeric}
    chosen = {c.column for c in found.columns if c.chosen}
    if any(c.quantity == "stress" for c in found.columns) and kinds & set(ALONG):
        return True
    if chosen & {"twist_deg", "moment_nmm", "outer_diameter_mm"} or found.pressures:
        return False
    ratio = bool(kinds & {"stretch", "strain", "true_strain"})
    alone = "pressure_kpa" not in chosen and "force_n" in chosen and "elongation_mm" in chosen
    return None if (ratio and "force_n" not in chosen and "pressure_kpa" in chosen) or alone else False


def guess_tests(sources: Mapping[str, bytes]) -> list[RubberGuess]:
    """The tests in files, by name. Raises UserError where none of them holds a table."""
    tests: list[RubberGuess] = []
    for name, content in sources.items():
        sheets = sheet_names(content, name)
        file = name if len(sources) > 1 else ""
        about = [row for sheet in sheets for row in _rows(content, name, sheet)] if len(sheets) > 1 else []
        sizes = sizes_in(about, POINTS, name)
        if len(sheets) < 2:
            tests += _tests(raw_table(content, name), file, "", sizes)
            continue
        for sheet in sheets:
            with suppress(UserError):
                tests += _tests(raw_table(content, name, Reading(sheet=sheet)), file, sheet, sizes)
    if not tests:
        raise UserError(
            f"{', '.join(sources)} holds no columns of a stretch and a stress: look whether it is the right file."
        )
    return tests


def _rows(content: bytes, name: str, sheet: str) -> list[tuple[int, list[str]]]:
    with suppress(UserError):
        return sheet_grid(content, name, sheet).rows
    return []


def _tests(raw: RawTable, file: str, sheet: str, sizes: tuple[Size, ...]) -> Iterator[RubberGuess]:
    """The test of a table, or several side by side."""
    columns = tuple(c for c in (column_guess(raw, name) for name in raw.columns) if c.numeric)
    pairs = _pairs(columns)
    time = next((c.name for c in columns if heading(c.name, c.unit).quantity == TIME), "")
    told = mode_in(sheet) or mode_in(raw.name)
    own = {size.name: size for size in (*sizes, *sizes_in(raw.head, raw.style, raw.name))}
    for along, stress in pairs:
        mode = mode_in(f"{along} {stress}") or (told if len(pairs) == 1 else "")
        torn, held = _torn(raw, along, stress), bool(time) and _held(raw, along)
        sized = tuple(own.values())
        yield RubberGuess(file, sheet, mode, along, stress, len(raw), columns, torn, time, held, sized, raw.notes)


def _pairs(columns: tuple[ColumnGuess, ...]) -> list[tuple[str, str]]:
    """Stretch and stress of each test: of several side by side the columns take turns; of one, the surest of each."""
    kinds = {c.name: kind_of(c.name, c.unit) for c in columns}
    turns = [c.name for c in columns if kinds[c.name][0] in {**ALONG, **STRESSES}]
    pairs = list(zip(turns[::2], turns[1::2], strict=False))
    apart = all((kinds[a][0] in ALONG) != (kinds[b][0] in ALONG) for a, b in pairs) and 2 * len(pairs) == len(turns)
    modes = [mode_in(f"{a} {b}") for a, b in pairs]
    alike = len({(kinds[a][0], kinds[b][0]) for a, b in pairs}) == 1
    if len(pairs) > 1 and apart and (len(set(modes) - {""}) == len(pairs) or alike):
        return [(a, b) if kinds[a][0] in ALONG else (b, a) for a, b in pairs]
    along = [c.name for c in columns if kinds[c.name][0] in ALONG]
    stress = [c.name for c in columns if kinds[c.name][0] in STRESSES]
    if not along and not stress:
        return []
    order = {name: place for place, name in enumerate((*ALONG, *STRESSES))}
    # A true strain beside an engineering one is the same once more.
    along.sort(key=lambda name: order[kinds[name][0]] + 10 * (kinds[name][0] == "true_strain"))
    stress.sort(key=lambda name: (kinds[name][0] != "stress_mpa", not kinds[name][1], order[kinds[name][0]]))
    return [((along or [""])[0], (stress or [""])[0])]


def _held(raw: RawTable, along: str) -> bool:
    """Whether a specimen stands still for most of its rows, or comes half the way back for many."""
    x = raw.maybe_numbers(along) if along else None
    there = x[~np.isnan(x)] if x is not None else np.zeros(0)
    moved = np.abs(np.diff(there))
    if len(moved) < 3 or not moved.any():
        return False
    far, top = there - there[0], int(np.argmax(np.abs(there - there[0])))
    back = len(far) - top > BACK * len(far) and abs(far[-1]) < abs(far[top]) / 2
    return back or float(np.median(moved)) < MOVES * float(moved.max())


def _torn(raw: RawTable, along: str, stress: str) -> bool:
    """Whether a specimen's stress falls at the end."""
    if not along or not stress:
        return False
    x, y = raw.maybe_numbers(along), raw.maybe_numbers(stress)
    if x is None or y is None:
        return False
    number = specimens(x)
    for one in np.unique(number):
        there = y[(number == one) & ~np.isnan(y)]
        if len(there) > 2 and there[-1] < TORN * there.max() and there.argmax() < len(there) - 1:
            return True
    return False
