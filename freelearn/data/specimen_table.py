"""Reading tables of specimen tests (CSV), with every fault of all files in one report."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes
from freelearn.data.specimen_schema import (
    COLUMNS,
    MODES,
    OPTIONAL,
    SHEAR,
    Stresses,
    find_faults,
    mode_name,
    stretch_of_shear,
)
from freelearn.data.specimen_tests import TIME, check_recordings, thinned, timed
from freelearn.data.table.faults import Fault, TableError
from freelearn.data.table.records import columns_of, numbers_of, read_records, refuse_other_formats

# Numbers of a specimen table that look wrong.

# No rubber carries this much nominal stress [MPa]; soft silicones in kPa do exceed it.
LARGEST_MPA = 100.0
# Rubber tears before it is ten times its length.
LARGEST_STRETCH = 12.0
# Stresses beyond this share of the largest have a sign that noise does not turn.
CLEAR = 0.1
# Stretches that differ by less than this share are alike, and clear stresses that differ by more than this are not.
ALIKE = 0.01
UNLIKE = 0.1


def suspicions(table: pd.DataFrame) -> list[str]:
    """A sentence for each mode of a table whose numbers suggest another unit or sign; nothing is converted."""
    sentences = []
    for mode, rows in table.groupby("mode", sort=False):
        held = Stresses.from_table(rows)
        if not len(held.stress_mpa):
            continue
        largest = np.abs(held.stress_mpa).max()
        if largest > LARGEST_MPA:
            unit, factor = ("Pa", 1e-6) if largest > 1e4 else ("kPa", 1e-3)
            sentences.append(
                f"stress_mpa of mode {mode} looks like {unit} (largest {largest:.4g}, more than rubber carries): "
                f"in MPa it would be {factor * largest:.4g}."
            )
        longest = max(held.along.max(), held.across.max())
        if longest > LARGEST_STRETCH:
            sentences.append(f"stretch of mode {mode} looks like percent (largest {longest:.4g}): at rest it is 1.")
        # A direction pulls where it is longer than the free one (the inequalities of Baker & Ericksen 1954), unless it
        # has just come back from where it was longer still.
        held = Stresses.from_table(rows[~timed(rows)])
        pulls = np.sign(held.along - 1 / (held.along * held.across))
        wrong = (pulls * held.stress_mpa < -CLEAR * largest).sum()
        if wrong:
            sentences.append(
                f"{wrong} stresses of mode {mode} pull where the specimen is stretched less than through its thickness "
                "or push where it is more: look whether stretch holds strains, or the stress has the other sign."
            )
        sentences += _uneven(rows, CLEAR * largest)
    return sentences


def _uneven(rows: pd.DataFrame, clear: float) -> list[str]:
    """A sentence if rows of one mode, stretched alike in both directions, carry stresses that are not."""
    one, two = rows["stress_mpa"].abs(), rows["stress_2_mpa"].abs()
    least, most = np.minimum(one, two), np.maximum(one, two)
    alike = (rows["stretch"] / rows["stretch_2"] - 1).abs() < ALIKE
    uneven = alike & (most > clear) & (most - least > UNLIKE * most)
    if not uneven.any():
        return []
    difference = 100 * (1 - least / most)[uneven].max()
    return [
        f"{uneven.sum()} rows of mode {rows['mode'].iloc[0]} are stretched alike in both directions, but their "
        f"stresses differ by up to {difference:.0f} %: look whether a column or a series is another's."
    ]


# Headings of tables in the literature, and ours.
ALIASES = {"lambda": "stretch", "P_MPa": "stress_mpa"}


@dataclass(frozen=True)
class Specimens:
    """table: the files' rows in their order. files: {path, sha256} of each.

    Columns: mode, specimen, stretch and stretch_2 along and across the sheet (what its mode imposes where the file does
    not say), nominal stress_mpa and stress_2_mpa in these two directions, NaN where it was not measured; in simple
    shear stress_mpa is the shear stress. time_s where a test is a recording, whose specimen is named after its file
    where the file does not name it.
    """

    table: pd.DataFrame
    files: list[dict[str, str]]
    warnings: list[str]

    @property
    def modes(self) -> list[str]:
        """The modes that the table holds, in their usual order."""
        return [mode for mode in MODES if (self.table["mode"] == mode).any()]


def read_specimens(sources: Sequence[str]) -> Specimens:
    """Reads tables, each given as FILE with a column `mode`, or as MODE=FILE.

    Columns: mode (uniaxial, equibiaxial, pure_shear, biaxial, or UT, ET, PS, BT), stretch λ (or lambda), nominal stress
    stress_mpa (or P_MPa), and optionally specimen, stress_2_mpa across the stretch, and stretch_2, which a biaxial test
    must tell, and time_s of a recording; others are ignored. In simple shear (SS) a column shear, the amount of shear,
    may stand for the stretch. A row with both stresses may leave one blank, and a recording's any stress. Recordings
    are thinned. Raises UserError with all faults of all files.
    """
    tables: list[pd.DataFrame] = []
    files: list[dict[str, str]] = []
    mistakes: list[UserError] = []
    for source in sources:
        mode, path = _split(source)
        if any(file["path"] == path for file in files):
            raise UserError(f"{path} is named twice: name each file once.")
        files.append({"path": path, "sha256": ""})
        try:
            tables.append(_read(path, mode))
            files[-1]["sha256"] = hashlib.sha256(read_bytes(path)).hexdigest()
        except UserError as mistake:
            mistakes.append(mistake)
    if len(mistakes) == 1:
        raise mistakes[0]
    if mistakes:
        raise UserError("\n".join(map(str, mistakes)))
    table = pd.concat(tables, ignore_index=True)
    for name, rows in table.groupby("mode", sort=False):
        if not Stresses.from_table(rows).stress_mpa.any():
            raise UserError(f"Every stress in mode {name} is zero, so its error has no scale: leave its rows out.")
    check_recordings(table)
    table, notes = thinned(table)
    return Specimens(table, files, [*notes, *suspicions(table)])


def _split(source: str) -> tuple[str | None, str]:
    """Mode and path of MODE=FILE, or None and the path of FILE."""
    short, equals, path = source.partition("=")
    if not equals or _there(source):
        return None, source
    mode = mode_name(short)
    if mode is None:
        known = ", ".join(f"{mode.short} ({name})" for name, mode in MODES.items())
        raise UserError(f"Unknown mode {short!r} in {source!r}: write MODE=FILE with one of {known}.")
    return mode, path


def _there(path: str) -> bool:
    try:
        return Path(path).exists()
    except OSError:
        return False  # no file can have such a name


def _read(path: str, mode: str | None) -> pd.DataFrame:
    """One file's rows. mode: that of all its rows, None to read the column."""
    records = read_records(path)
    original = [name.strip() for name in records.header]
    sheared = "shear" in original and "stretch" not in original
    header = ["stretch" if sheared and name == "shear" else ALIASES.get(name, name) for name in original]
    required = [name for name in COLUMNS if name not in OPTIONAL]
    refuse_other_formats(path, header, {*COLUMNS, *ALIASES}, required)
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header. Add the measurements below it.")
    text, lines, faults = columns_of(records, header)
    # Only a file that has no column of modes is given one: what the file says is checked against the command.
    frame = pd.DataFrame(index=pd.Index(lines, dtype=np.int64))
    for name in COLUMNS:
        if name in text:
            frame[name] = [mode_name(cell) for cell in text[name]] if name == "mode" else numbers_of(text[name])
        elif name == "mode" and mode is not None:
            frame[name] = mode
    frame["specimen"] = [cell.strip() for cell in text["specimen"]] if "specimen" in text else ""
    if sheared:
        frame["stretch"] = stretch_of_shear(frame["stretch"].to_numpy())
        if "mode" in frame:
            other = frame["mode"].notna() & (frame["mode"] != SHEAR)
            problem = f"is given an amount of shear: only {SHEAR} has one, others a stretch"
            faults += [Fault(line, "mode", str(frame["mode"][line]), problem) for line in frame.index[other]]
    faults += find_faults(frame, text, records.header_line, mode)
    if faults:
        named = dict(zip(reversed(header), reversed(original), strict=True))
        faults = [replace(fault, column=named.get(fault.column, fault.column)) for fault in faults]
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))
    frame = _complete(frame)
    frame.loc[timed(frame) & (frame["specimen"] == "").to_numpy(), "specimen"] = Path(path).stem
    return frame


def _complete(frame: pd.DataFrame) -> pd.DataFrame:
    """All columns of a faultless file: what its modes impose across, and no stress across where nothing pulls."""
    recorded = [TIME] if timed(frame).any() else []
    frame = frame.reindex(columns=["mode", "specimen", "stretch", "stretch_2", "stress_mpa", "stress_2_mpa", *recorded])
    for mode in MODES.values():
        if mode.power is not None:
            own = frame["mode"] == mode.name
            frame.loc[own, "stretch_2"] = mode.across(frame.loc[own, "stretch"].to_numpy())
    frame.loc[frame["mode"].isin(["uniaxial", SHEAR]), "stress_2_mpa"] = np.nan
    return frame
