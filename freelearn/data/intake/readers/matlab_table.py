"""Columns of a MATLAB file (.mat), or of an HDF5 file. Its objects and functions are not loaded."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from freelearn.common.errors import UserError
from freelearn.data.intake.headings import INNER_DIAMETER, heading
from freelearn.data.intake.readers import matlab_reader
from freelearn.data.intake.readers.cells import POINTS
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.told_elsewhere import OUTER_DIAMETER, Told, one_told, with_the_wall
from freelearn.data.intake.recipes.recipe import Reading

# Reading a gigabyte takes no longer [s].
LONGEST = 120
# A matrix of channels has no more columns, and no fewer rows.
MOST_CHANNELS, LEAST_SAMPLES = 12, 20
# What the arrays are called that are in no structure.
VARIABLES = "variables"


@dataclass(frozen=True)
class _Variables:
    """arrays: numeric variables. structures: name → numeric fields. others: name → what it is instead."""

    arrays: dict[str, np.ndarray]
    structures: dict[str, dict[str, np.ndarray]]
    others: dict[str, str]


def matlab_table(content: bytes, name: str, reading: Reading) -> RawTable:
    """Vectors of one length, the columns of a matrix, or the fields of a structure of vectors, which `reading.sheet`
    names where there are several. Raises UserError."""
    found = _read(content, name)
    numeric, passed = _chosen(found, name, reading)
    columns, others = _of_one_length(_columns(numeric, name, found), name)
    passed += others
    firsts = {f"{key} 1" for key, array in numeric.items() if is_clocked(array)} & set(columns)
    if reading.names:
        if len(reading.names) != len(columns):
            raise UserError(f"{name}: read.names has {len(reading.names)} names for {len(columns)} columns.")
        firsts = {given for given, own in zip(reading.names, columns, strict=True) if own in firsts}
        columns = dict(zip(reading.names, columns.values(), strict=True))
    about = tuple(_about(found, columns, name))
    # Of what somebody has chosen the rest is known.
    passed = [] if reading.variables else passed
    proposed = [one for one in passed if any(f"{name}: {one}(" in told.words for told in about)]
    of_all = [one for one in passed if any(f"{name}: {one} is" in told.words for told in about)]
    passed = [one for one in passed if one not in (*proposed, *of_all)]
    notes = [f"{name}: variables that are no columns were passed over: {', '.join(passed)}."] if passed else []
    if proposed:
        notes.append(f"{name}: {', '.join(proposed)} will be proposed where each of several actuators is asked about.")
    cells = {k: ["" if np.isnan(v) else repr(float(v)) for v in column] for k, column in columns.items()}
    size = len(next(iter(columns.values())))
    lines = list(range(1, size + 1))
    return RawTable(name, cells, lines, notes=tuple(notes), about=about, firsts=frozenset(firsts))


def no_h5py(name: str) -> str:
    """What to do about a file that only h5py reads."""
    mat = name.lower().endswith(".mat")
    what, instead = (
        ("a MATLAB file of version 7.3", f"save it again with save('{name}', '-v7')")
        if mat
        else ("an HDF5 file", "export the table as CSV")
    )
    return f"{name} is {what}: reading it needs h5py: pip install 'freelearn[raw]', or {instead}."


@lru_cache(maxsize=1)
def _read(content: bytes, name: str) -> _Variables:
    """The file's variables, read by another process, and once for all that is asked of one file."""
    again = f"{name} cannot be read as a MATLAB file ({{}}): save it again with save -v7."
    if content.startswith(matlab_reader.HDF) and not name.lower().endswith(".mat"):
        again = f"{name} cannot be read as HDF5 ({{}}): export the table as CSV."
    if content.startswith((matlab_reader.NUMPY, b"PK")):
        again = f"{name} cannot be read as NumPy's arrays ({{}}): save numbers, without objects, with numpy.save again."
    command = [sys.executable, matlab_reader.__file__]
    try:
        done = subprocess.run(command, input=content, capture_output=True, timeout=LONGEST, check=False)
        if done.returncode == matlab_reader.NO_H5PY:
            raise UserError(no_h5py(name))
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().splitlines()
            told = said[-1][:100] if said and done.returncode == matlab_reader.UNREADABLE else "it is damaged"
            raise UserError(again.format(told))
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as loaded:
            arrays = dict(loaded)
    except subprocess.TimeoutExpired:
        raise UserError(again.format("it takes too long")) from None
    except (ValueError, OSError, zipfile.BadZipFile) as problem:
        raise UserError(again.format(str(problem)[:100])) from None
    found = _Variables({}, {}, {})
    for key, value in arrays.items():
        kind, _, variable = key.partition(":")
        if kind == "array":
            found.arrays[variable] = value
        elif kind == "field":
            structure, _, field = variable.partition(":")
            found.structures.setdefault(structure, {})[field] = value
        else:
            found.others[variable] = str(value)
    return found


def structures_of(content: bytes, name: str) -> list[str]:
    """Where columns may stand: the names of structures that have some, VARIABLES where there are arrays beside them;
    none where there is but one such place. Raises UserError."""
    places = _places(_read(content, name))
    return list(places) if len(places) > 1 else []


def lengths_of(content: bytes, name: str) -> list[Reading]:
    """Where arrays of several lengths stand in one place, how the columns of each length are read, and those of the
    other places; [] where there is no such place. Raises UserError."""
    places = _places(_read(content, name))
    readings, several = [], False
    for place, arrays in places.items():
        lengths: dict[int, list[str]] = {}
        for key, array in arrays.items():
            length = array.size if 1 in array.shape else array.shape[0]
            if length > MOST_MEMBERS:
                lengths.setdefault(length, []).append(key)
        columned = [tuple(keys) for keys in lengths.values() if len(keys) > 1 or is_clocked(arrays[keys[0]])]
        sheet = None if list(places) == [VARIABLES] else place
        several |= len(columned) > 1
        readings += [Reading(sheet=sheet, variables=keys if len(columned) > 1 else ()) for keys in columned]
    return readings if several else []


def is_clocked(array: np.ndarray) -> bool:
    """Whether an array is a matrix of a time and what goes by it, [t F]: its first column alone rises evenly."""
    if (
        array.ndim != 2
        or not 2 <= array.shape[1] <= MOST_CHANNELS
        or len(array) < LEAST_SAMPLES
        or np.iscomplexobj(array)
    ):
        return False
    steps = np.diff(array.astype(np.float64), axis=0)
    even = [bool(one.min() > 0 and one.max() < 3 * np.median(one)) for one in steps.T]
    return even[0] and not all(even)


def matrices_of(content: bytes, name: str) -> dict[str, tuple[int, str]]:
    """The matrices of a time and its channels that stand in no structure, variable → how many columns each has, and
    which quantity its name says. Raises UserError."""
    arrays = _places(_read(content, name)).get(VARIABLES, {})
    said = {key: heading(re.sub(r"[_\d]+$", "", key)).quantity or "" for key in arrays}
    return {key: (array.shape[1], said[key]) for key, array in arrays.items() if is_clocked(array)}


def _places(found: _Variables) -> dict[str, dict[str, np.ndarray]]:
    """The arrays of more than one number, by the structure that they are in."""
    groups = {VARIABLES: found.arrays, **found.structures}
    several = {place: {k: x for k, x in group.items() if x.size > 1} for place, group in groups.items()}
    return {place: group for place, group in several.items() if group}


def _chosen(found: _Variables, name: str, reading: Reading) -> tuple[dict[str, np.ndarray], list[str]]:
    """The arrays that are columns, and the names of what is passed over."""
    names = [*found.arrays, *found.others]
    places = _places(found)
    known = names if reading.sheet is None or reading.sheet not in places else list(places[reading.sheet])
    if lacking := [variable for variable in reading.variables if variable not in known]:
        raise UserError(f"{name} has no variable {lacking[0]!r}: it has {', '.join(map(repr, known))}.")
    if reading.sheet is not None and reading.sheet not in places:
        raise UserError(f"{name} has no structure {reading.sheet!r} of arrays: it has {', '.join(map(repr, places))}.")
    if reading.variables and reading.sheet is not None:
        return {k: x for k, x in places[reading.sheet].items() if k in reading.variables}, []
    if reading.variables:
        chosen = {k: x for place in places for k, x in places[place].items() if {k, place} & set(reading.variables)}
        used = set(reading.variables)
    else:
        # Of a structure beside lone arrays somebody has to say that it is meant.
        place = reading.sheet or (VARIABLES if VARIABLES in places else next(iter(places), VARIABLES))
        if reading.sheet is None and place != VARIABLES and len(places) > 1:
            raise UserError(
                f"{name} has structures {', '.join(map(repr, places))}: say which with read: {{sheet: {place}}}."
            )
        chosen, used = places.get(place, {}), {place} if reading.sheet is None else set(places)
    return chosen, [one for one in names if one not in chosen and one not in used]


def _of_one_length(columns: dict[str, np.ndarray], name: str) -> tuple[dict[str, np.ndarray], list[str]]:
    """The columns that most others are as long as, and the names of the rest. Raises UserError where none are most."""
    lengths = Counter(map(len, columns.values()))
    (length, most), *others = lengths.most_common()
    if others and others[0][1] == most:
        shown = ", ".join(f"{k} {len(v)}" for k, v in list(columns.items())[:6])
        raise UserError(f"{name}: arrays differ in length ({shown}): choose with read: {{variables: […]}}.")
    return {k: v for k, v in columns.items() if len(v) == length}, [k for k, v in columns.items() if len(v) != length]


# No block has more actuators; of so many numbers a vector says each one's.
MOST_MEMBERS = 8
# Numbers of a design whose unit nothing says are of these sizes in the first unit, or in the second.
RADII = {"mm": (1.0, 200.0), "m": (1e-4, 0.2)}
LIKELY = {"gamma_deg": {"deg": (5.0, 90.0)}, "length_mm": {"mm": (10.0, 3000.0), "m": (0.01, 3.0)}} | dict.fromkeys(
    ("inner_radius_mm", "outer_radius_mm", INNER_DIAMETER, OUTER_DIAMETER), RADII
)


def _about(found: _Variables, columns: Mapping[str, np.ndarray], name: str) -> list[Told]:
    """Parts of the design among the single numbers, L0_mm = 150, and among vectors with a number for each of several
    actuators, Gamma = [40 -40 62]."""
    told: dict[int, dict[str, Told]] = {}
    for fields in (found.arrays, *found.structures.values()):
        for key, value in fields.items():
            numbers = value.ravel()
            if key in columns or np.iscomplexobj(value) or not 1 <= len(numbers) <= MOST_MEMBERS:
                continue
            members = {0: numbers[0]} if len(set(numbers.tolist())) == 1 else {}
            members |= dict(enumerate(numbers, start=1)) if len(numbers) > 1 else {}
            for member, one in members.items():
                if part := _part(key, member, float(one), name):
                    told.setdefault(member, {}).setdefault(part.name, part)
    return [one for parts in told.values() for one in with_the_wall(parts)]


def _part(key: str, member: int, value: float, name: str) -> Told | None:
    """A part of the design of one member, or of all; where no unit is said, in the table's if its size is likely."""
    heard = heading(key)
    sizes = {} if heard.unit else LIKELY.get(heard.quantity or "", {})
    unit = next((unit for unit, (low, high) in sizes.items() if low <= abs(value) <= high), "")
    told = one_told(key, f"{value:.12g}", unit, POINTS, name)
    if told is None:
        return None
    shown = f"{key}({member})" if member else key
    words = f"{name}: {shown} is {value:.12g}" + (f", which unit is not said: {unit}?" if unit else "")
    return replace(told, words=words, member=member, unit_said=not unit)


def _columns(numeric: dict[str, np.ndarray], name: str, found: _Variables) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {}
    for variable, value in numeric.items():
        if np.iscomplexobj(value):
            raise UserError(f"{name}: variable {variable!r} is complex: save its real part.")
        if value.ndim != 2:
            raise UserError(f"{name}: variable {variable!r} has {value.ndim} dimensions: save columns or a matrix.")
        if 1 in value.shape:
            columns[variable] = value.ravel().astype(np.float64)
        else:
            columns |= {f"{variable} {i + 1}": value[:, i].astype(np.float64) for i in range(value.shape[1])}
    if not columns:
        raise UserError(f"{name} holds no numeric arrays{_instead(found)}.")
    return columns


def _instead(found: _Variables) -> str:
    """What there is in their place, and what to do."""
    if not found.others:
        return ": save the columns as vectors of numbers"
    told = ", ".join(f"{variable!r} is {what}" for variable, what in list(found.others.items())[:4])
    return f" ({told}): save the columns themselves as vectors of numbers, or one structure of them"
