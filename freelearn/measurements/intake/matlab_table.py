"""Columns of a MATLAB file up to version 7 (.mat). Its objects and functions are not loaded."""

from __future__ import annotations

import io
import warnings
from typing import Any

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.reading import Reading


def matlab_table(content: bytes, name: str, reading: Reading) -> RawTable:
    """Vectors of one length, the columns of a matrix, or the fields of a structure of vectors. Raises UserError."""
    found = _variables(content, name)
    if reading.variables:
        lacking = [v for v in reading.variables if v not in found]
        if lacking:
            raise UserError(f"{name} has no variable {lacking[0]!r}: it has {', '.join(map(repr, found))}.")
        found = {v: found[v] for v in reading.variables}
    numeric: dict[str, np.ndarray] = {}
    passed = []
    structures = {v: _fields(value) for v, value in found.items() if _is_structure(value)}
    if structures and (reading.variables or len(found) == len(structures) == 1):
        found = {k: x for fields in structures.values() for k, x in fields.items()}
    for variable, value in found.items():
        if _is_numeric(value) and value.size > 1:
            numeric[variable] = value
        else:
            passed.append(variable)
    columns = _columns(numeric, name, structures)
    notes = [f"{name}: variables that are no columns were passed over: {', '.join(passed)}."] if passed else []
    size = len(next(iter(columns.values())))
    if reading.names:
        if len(reading.names) != len(columns):
            raise UserError(f"{name}: read.names has {len(reading.names)} names for {len(columns)} columns.")
        columns = dict(zip(reading.names, columns.values(), strict=True))
    cells = {k: ["" if np.isnan(v) else repr(float(v)) for v in column] for k, column in columns.items()}
    return RawTable(name, cells, list(range(1, size + 1)), notes=tuple(notes))


def _variables(content: bytes, name: str) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = loadmat(io.BytesIO(content))
    except NotImplementedError:
        raise UserError(version_73(name)) from None
    except Exception as problem:  # A damaged file may fail anywhere in the reader.
        raise UserError(f"{name} cannot be read as a MATLAB file ({problem}): save it again with save -v7.") from None
    return {k: v for k, v in loaded.items() if not k.startswith("__")}


def version_73(name: str) -> str:
    """What to do about a file in MATLAB's newest format."""
    return f"{name} is a MATLAB file of version 7.3: save it again with save('{name}', '-v7')."


def _columns(numeric: dict[str, np.ndarray], name: str, structures: dict[str, Any]) -> dict[str, np.ndarray]:
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
    lengths = {k: len(v) for k, v in columns.items()}
    if not columns:
        inside = f" (its structures are {', '.join(map(repr, structures))})" if structures else ""
        raise UserError(f"{name} holds no numeric arrays{inside}: name what to read with read: {{variables: […]}}.")
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{k} {n}" for k, n in lengths.items())
        raise UserError(
            f"{name}: arrays differ in length ({shown}): choose those of one with read: {{variables: […]}}."
        )
    return columns


def _is_structure(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.names is not None and value.size == 1


def _fields(value: np.ndarray) -> dict[str, Any]:
    return {field: value.ravel()[0][field] for field in value.dtype.names or ()}


def _is_numeric(value: Any) -> bool:
    return isinstance(value, np.ndarray) and (np.issubdtype(value.dtype, np.number) or value.dtype == bool)
