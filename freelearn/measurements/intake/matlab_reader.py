"""Reads a MATLAB file from the standard input and writes its arrays to the standard output, as a process of its own.

SciPy's reader trusts the sizes that a file states: a damaged one can end the process that reads it, and must not end
ours. Variables become arrays of an .npz: numeric ones under `array:NAME`, fields under `field:NAME:FIELD`;
of others what they are in words, as `other:NAME`. Ends with status 3 for a file of version 7.3, 4 for one that cannot
be read.
"""

import sys

if __name__ == "__main__":
    # Started by its path: the modules beside it must not be taken for others of their names.
    sys.path.pop(0)

import io
import warnings
from typing import Any

import numpy as np

VERSION_73, UNREADABLE = 3, 4
# Sizes that a damaged file states are not believed beyond this [bytes].
MEMORY = 8_000_000_000


def main() -> None:
    """Reads, and ends with a status."""
    from scipy.io import loadmat

    _limit_memory()
    content = sys.stdin.buffer.read()
    warnings.simplefilter("ignore")
    try:
        loaded = loadmat(io.BytesIO(content))
    except NotImplementedError:
        sys.exit(VERSION_73)
    except BaseException as problem:  # A damaged file may fail anywhere in the reader.
        print(problem, file=sys.stderr)
        sys.exit(UNREADABLE)
    arrays: dict[str, Any] = {}
    for name, value in loaded.items():
        if not name.startswith("__"):
            arrays |= _plain(name, value)
    np.savez(sys.stdout.buffer, **arrays)


def _plain(name: str, value: Any) -> dict[str, np.ndarray]:
    """A variable as arrays that need no pickle."""
    if _numeric(value):
        return {f"array:{name}": value}
    if isinstance(value, np.ndarray) and value.dtype.names is not None and value.size == 1:
        fields = {field: value.ravel()[0][field] for field in value.dtype.names}
        return {f"other:{name}": _what(value)} | {f"field:{name}:{f}": x for f, x in fields.items() if _numeric(x)}
    return {f"other:{name}": _what(value)}


def _what(value: Any) -> np.ndarray:
    """What a variable is that holds no numbers, in words."""
    if not isinstance(value, np.ndarray):
        return np.array("a sparse matrix: save full(…)" if hasattr(value, "toarray") else "no array")
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
