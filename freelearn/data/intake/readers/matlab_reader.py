"""Reads a MATLAB file from the standard input and writes its arrays to the standard output, as a process of its own.

SciPy's reader trusts the sizes that a file states: a damaged one can end the process that reads it, and must not end
ours. Variables become arrays of an .npz: numeric ones under `array:NAME`, fields under `field:NAME:FIELD`;
of others what they are in words, as `other:NAME`. An array of structures whose fields hold a number each is one
structure of columns; of one whose fields hold columns each is a structure, NAME(1), NAME(2). NumPy's .npy and .npz
are read alike. Ends with status 3 where h5py is needed and absent, 4 for one that
cannot be read. MATLAB's files of version 7.3 are HDF5, which h5py reads.
"""

import sys

if __name__ == "__main__":
    # Started by its path: the modules beside it must not be taken for others of their names.
    sys.path.pop(0)

import io
import warnings
from typing import Any

import numpy as np

NO_H5PY, UNREADABLE = 3, 4
# What MATLAB calls numbers in HDF5, "" for files that it did not write.
NUMBERS = ("", "double", "single", "logical", *(f"{sign}int{size}" for sign in ("", "u") for size in (8, 16, 32, 64)))
HDF = b"\x89HDF\r\n\x1a\n"
NUMPY = b"\x93NUMPY"
# More structures in an array are not taken for recordings.
MOST_STRUCTURES = 500
# Objects of MATLAB's own, whose formats nobody but MATLAB reads, and what to save in their place.
OBJECTS = {
    "table": "a MATLAB table: save S = table2struct(T, 'ToScalar', true)",
    "timetable": "a MATLAB timetable: save S = table2struct(timetable2table(T), 'ToScalar', true)",
    "cell": "a cell array",
}
# Sizes that a damaged file states are not believed beyond this [bytes].
MEMORY = 8_000_000_000


def main() -> None:
    """Reads, and ends with a status."""
    from scipy.io import loadmat

    _limit_memory()
    content = sys.stdin.buffer.read()
    warnings.simplefilter("ignore")
    try:
        if content.startswith((NUMPY, b"PK")):
            loaded = _numpy(content)
        else:
            loaded = _hdf5(content) if content.startswith((HDF, b"MATLAB 7.3")) else loadmat(io.BytesIO(content))
    except ImportError:
        sys.exit(NO_H5PY)
    except BaseException as problem:  # A damaged file may fail anywhere in the reader.
        print(problem, file=sys.stderr)
        sys.exit(UNREADABLE)
    arrays: dict[str, Any] = {}
    for name, value in loaded.items():
        if not name.startswith("__"):
            arrays |= _plain(name, value)
    np.savez(sys.stdout.buffer, **arrays)


def _hdf5(content: bytes) -> dict[str, Any]:
    """The datasets of a file, those in a group as a structure's fields. Links to other files are not followed."""
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        names = [name for name in file if not name.startswith("#")]
        return {_headed(file, name): value for name in names if (value := _item(file, name)) is not None}


def _numpy(content: bytes) -> dict[str, Any]:
    """The arrays of a file of NumPy's; records as a structure's fields. Objects, which could run code, are refused."""
    loaded = np.load(io.BytesIO(content), allow_pickle=False)
    arrays = {"data": loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
    return {name: _of_numpy(value) for name, value in arrays.items()}


def _of_numpy(value: np.ndarray) -> Any:
    names = value.dtype.names
    if names is None:
        return value.reshape(-1, 1) if value.ndim < 2 else value
    structure = np.empty((1, 1), dtype=[(key, object) for key in names])
    for key in names:
        structure[0, 0][key] = np.asarray(value[key]).reshape(-1, 1)
    return structure


def _headed(group: Any, name: str) -> str:
    """The name as a column's heading, with the unit that a dataset's attribute says: NetCDF's and others' habit."""
    attributes = getattr(_own(group, name), "attrs", {})
    unit = attributes.get("units", attributes.get("unit", b""))
    unit = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else unit
    return f"{name} [{unit.strip()}]" if isinstance(unit, str) and unit.strip() and "[" not in name else name


def _own(group: Any, name: str) -> Any:
    """What lies in the file itself by this name; None for a link to elsewhere."""
    import h5py

    return group[name] if isinstance(group.get(name, getlink=True), h5py.HardLink) else None


def _item(group: Any, name: str, depth: int = 0) -> Any:
    """A dataset as an array, a group as a structure of one; None for what lies in another file."""
    import h5py

    item = _own(group, name)
    if isinstance(item, h5py.Group):
        inside = {_headed(item, key): _item(item, key, depth + 1) for key in item} if not depth else {}
        structure = np.empty((1, 1), dtype=[(key, object) for key, x in inside.items() if x is not None])
        for key in structure.dtype.names or ():
            structure[0, 0][key] = inside[key]
        return structure if structure.dtype.names else np.array("no array")
    if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
        return None
    kind = bytes(item.attrs.get("MATLAB_class", b"")).decode("ascii", "replace")
    if kind not in NUMBERS:
        return np.array(OBJECTS.get(kind, "a text" if kind == "char" else f"no array ({kind})"))
    value = np.asarray(item[()])
    if value.dtype.names is not None:
        columns = {key: np.asarray(value[key]).reshape(-1, 1) for key in value.dtype.names if value[key].ndim == 1}
        structure = np.empty((1, 1), dtype=[(key, object) for key in columns])
        for key, column in columns.items():
            structure[0, 0][key] = column
        return structure
    # MATLAB writes by columns, HDF5 by rows.
    value = value.T if kind else value
    return value.reshape(-1, 1) if value.ndim < 2 else value


def _plain(name: str, value: Any) -> dict[str, np.ndarray]:
    """A variable as arrays that need no pickle."""
    if _numeric(value):
        return {f"array:{name}": value}
    if isinstance(value, np.ndarray) and value.dtype.names is not None and not _is_object(value):
        if 1 < value.size <= MOST_STRUCTURES and not _single(value):
            columns = {
                f"field:{name}({place}):{field}": one[field]
                for place, one in enumerate(value.ravel(), start=1)
                for field in value.dtype.names or ()
                if _numeric(one[field])
            }
            return {f"other:{name}": _what(value)} | columns
        fields = {field: _field(value, field) for field in value.dtype.names}
        return {f"other:{name}": _what(value)} | {f"field:{name}:{f}": x for f, x in fields.items() if _numeric(x)}
    return {f"other:{name}": _what(value)}


def _field(structure: np.ndarray, name: str) -> Any:
    """A field of a structure; of an array of structures a column of it, where it holds a number in each."""
    values = [one[name] for one in structure.ravel()]
    if len(values) == 1:
        return values[0]
    single = all(_numeric(value) and value.size == 1 for value in values)
    return np.array([value.item() for value in values]).reshape(-1, 1) if single else None


def _single(structures: np.ndarray) -> bool:
    """Whether all numbers of an array of structures are single."""
    return all(one[f].size < 2 for one in structures.ravel() for f in structures.dtype.names or () if _numeric(one[f]))


def _is_object(value: np.ndarray) -> bool:
    """Whether SciPy's reader gives the parts of an object of MATLAB's, which are no fields."""
    return type(value).__name__ in ("MatlabOpaque", "MatlabFunction", "MatlabObject")


def _what(value: Any) -> np.ndarray:
    """What a variable is that holds no numbers, in words."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "U" and not value.ndim:
        return value  # Words already.
    if not isinstance(value, np.ndarray):
        return np.array("a sparse matrix: save full(…)" if hasattr(value, "toarray") else "no array")
    if _is_object(value):
        told = str(value.tolist())
        return np.array(next((says for kind, says in OBJECTS.items() if f"'{kind}'" in told), "an object of MATLAB's"))
    if value.dtype.names is not None:
        inside = ", ".join(value.dtype.names[:6])
        several = "an array of structures" if value.size > 1 else "a structure"
        return np.array(f"{several} of {inside}")
    if value.dtype == object:
        return np.array("a cell array")
    return np.array("a text" if value.dtype.kind in "US" else "no array")


def _numeric(value: Any) -> bool:
    return isinstance(value, np.ndarray) and (np.issubdtype(value.dtype, np.number) or value.dtype == bool)


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:
        return  # Not on Windows.
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


if __name__ == "__main__":
    main()
