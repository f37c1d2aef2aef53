"""From files of tests of rubber and their recipe to a table of specimen tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.intake.chosen_rows import meets
from freelearn.data.intake.evaluate import Evaluation
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.rubber.rubber_recipe import FURTHER, RubberTest
from freelearn.data.specimen_schema import SHEAR, stretch_of_shear
from freelearn.data.specimen_table import suspicions
from freelearn.data.specimen_tests import TIME

# A specimen begins anew where the stretch falls back by more than this share of its range.
FALLS_BACK = 0.5


@dataclass(frozen=True)
class RubberIntake:
    """table: mode, specimen, stretch, stress_mpa, of biaxial tests stretch_2, stress_2_mpa, and time_s of recordings,
    whose specimen is named after the file or sheet. lines: (file, line) of each row. warnings: sentences. records: of
    each test, what its columns were made of."""

    table: pd.DataFrame
    lines: tuple[tuple[str, int], ...]
    warnings: tuple[str, ...]
    records: tuple[Mapping[str, object], ...]


def convert_tests(tests: Sequence[RubberTest], sources: Mapping[str, bytes]) -> RubberIntake:
    """The table that a recipe makes of files, by name. Raises UserError."""
    tables, lines, warnings, records = [], [], [], []
    for test in tests:
        name = test.file or next(iter(sources))
        if name not in sources:
            raise UserError(f"The recipe names {name}, and no such file is there: correct file: of the test.")
        raw = raw_table(sources[name], name, test.reading)
        rows = Evaluation(_kept(test, raw), test.columns, {}, np.ones(0, dtype=np.int64))
        table = _quantities(test, rows)
        # What a recording was stretched by counts for what it shows later.
        needed = ["stretch", TIME if TIME in table else "stress_mpa"]
        filled = table[needed].notna().all(axis=1)
        if not filled.any():
            raise UserError(f"{name}: no row of the {test.mode} test holds both a stretch and a stress.")
        tables.append(table[filled])
        lines += [(name, rows.raw.lines[row]) for row in np.flatnonzero(filled)]
        warnings += [*raw.notes, *rows.notes]
        records.append({"file": name, "mode": test.mode, "rows": int(filled.sum()), "columns": rows.records})
    whole = pd.concat(tables, ignore_index=True)
    checked = whole.reindex(columns=[*whole, "stretch_2", "stress_2_mpa"]).loc[:, lambda t: ~t.columns.duplicated()]
    said = suspicions(checked)
    return RubberIntake(whole, tuple(lines), tuple(dict.fromkeys([*warnings, *said])), tuple(records))


def _kept(test: RubberTest, raw: RawTable) -> RawTable:
    keep = np.ones(len(raw), dtype=bool)
    for condition in test.drop:
        keep &= ~meets(condition, raw)
    return raw.rows(np.flatnonzero(keep))


def _quantities(test: RubberTest, rows: Evaluation) -> pd.DataFrame:
    """The rows of one test, NaN where a cell is blank."""
    made = {name: rows.quantity(name) for name in test.columns}
    size = test.constants
    if test.mode == SHEAR:
        stretch = stretch_of_shear(made["strain"])
    elif "strain" in made:
        stretch = 1 + made["strain"]
    elif "true_strain" in made:
        stretch = np.exp(made["true_strain"])
    elif "elongation_mm" in made:
        stretch = 1 + made["elongation_mm"] / size["length_mm"]
    else:
        stretch = made["stretch"]
    if "true_stress_mpa" in made:
        # Incompressible: the area that carries the force is the unloaded one over the stretch, in each of the modes.
        stress = made["true_stress_mpa"] / stretch
    elif "force_n" in made:
        stress = made["force_n"] / (size["width_mm"] * size["thickness_mm"])
    else:
        stress = made["stress_mpa"]
    specimen = recordings(made[TIME]) if TIME in made else specimens(stretch)
    if not test.whole:
        after = _after_the_largest(stress, specimen)
        stress = np.where(after, np.nan, stress)
    further = {name: made[name] for name in FURTHER if name in made}
    named = test.reading.sheet or Path(rows.raw.name).stem if TIME in made else ""
    labels = [f"{named} {number + 1}".strip() if specimen.max() else named for number in specimen]
    table = pd.DataFrame({"mode": test.mode, "specimen": labels, "stretch": stretch, "stress_mpa": stress})
    return table.assign(**further)


def specimens(stretch: np.ndarray) -> np.ndarray:
    """The specimen of each row, (N,) int64 from 0 up: tests that follow each other in one file begin at rest again.

    >>> specimens(np.array([1, 2, 3, 1, 2, 3.1])).tolist()
    [0, 0, 0, 1, 1, 1]
    """
    filled = stretch[~np.isnan(stretch)]
    falls = np.diff(stretch, prepend=stretch[:1]) < -FALLS_BACK * float(np.ptp(filled)) if len(filled) else stretch < 0
    return np.asarray(np.cumsum(falls), dtype=np.int64)


def recordings(time: np.ndarray) -> np.ndarray:
    """As specimens, of tests over time: another one begins where the clock falls back.

    >>> recordings(np.array([0, 1, 2, 0, 1])).tolist()
    [0, 0, 0, 1, 1]
    """
    falls = np.zeros(len(time), dtype=bool)
    falls[1:] = np.diff(time) < 0
    return np.asarray(np.cumsum(falls), dtype=np.int64)


def _after_the_largest(stress: np.ndarray, specimen: np.ndarray) -> np.ndarray:
    """Rows of each specimen that follow its largest stress, (N,) bool."""
    after = np.zeros(len(stress), dtype=bool)
    for number in np.unique(specimen):
        rows = np.flatnonzero(specimen == number)
        if np.isfinite(stress[rows]).any():
            after[rows[int(np.nanargmax(stress[rows])) + 1 :]] = True
    return after
