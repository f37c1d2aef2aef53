"""Files: those that a user names, read or refused in one sentence; and those that are written, whole or absent."""

from __future__ import annotations

import codecs
import hashlib
import math
import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from pathlib import Path
from typing import BinaryIO

from freelearn.common.errors import UserError, cannot_write

# Names of files that are being written, or try whether a folder can be written to: with the number of their process.
UNFINISHED = re.compile(
    r"\.writable\.(?P<tried>\d+)|\..+\.(?P<written>\d+)\.(part|part\.csv|members\.csv|provenance\.json)"
)


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Calls `write` on a name beside `path`, then renames: readers see all of the file or none. Raises UserError where
    the system refuses, and leaves what was there."""
    # The process number keeps two runs that write the same file out of each other's unfinished ones.
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(beside)
        os.replace(beside, path)
    except OSError as problem:
        raise cannot_write(
            path, problem, "choose another folder, and leave it until the command has ended"
        ) from problem
    finally:
        # What could not be written may not be removable either.
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8 text, whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Writes bytes, whole or not at all."""

    def write(beside: Path) -> None:
        beside.write_bytes(content)

    write_whole(path, write)


def remove_unfinished(folder: Path) -> None:
    """Removes what killed commands had begun to write in a folder, for a command that begins to write there."""
    for path in folder.glob(".*"):
        began = UNFINISHED.fullmatch(path.name)
        if began and not _lives(int(began["tried"] or began["written"])):
            with suppress(OSError):
                path.unlink()


def _lives(process: int) -> bool:
    """Whether another process of this number runs; on Windows, where that cannot be asked, always."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # another user's
    return process != os.getpid()


def remove_empty(folder: Path) -> None:
    """Removes a command's folder and those made for it under outputs/, as far as there is nothing in them."""
    outputs = Path.cwd() / "outputs"
    made = [path for path in folder.parents if path == outputs or outputs in path.parents]
    for empty in (folder, *(made or [folder.parent])):
        # Not empty, gone, or not ours to remove.
        with suppress(OSError):
            empty.rmdir()


# Reading a file that the user named, or saying in one sentence why it cannot be read.

# Larger files are not read [GB]: ten million rows take one. The environment variable raises it.
LARGEST_GB, LARGER = 2.0, "FREELEARN_LARGEST_FILE_GB"
CHUNK = 1 << 24
BYTE_ORDER_MARK = "\ufeff"
# What spreadsheets call Unicode text; UTF-32 begins like UTF-16, and comes first.
OTHER_UNICODE = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}


def missing_file(path: str | Path) -> str | None:
    """What to tell the user where there is no regular file of that name, or too large a one; None where there is."""
    file = Path(path)
    shown = repr(str(path))[1:-1]  # A name may hold what a terminal obeys.
    try:
        if file.is_dir():
            return f"{shown} is a folder: name the file in it."
        if not file.exists():
            return f"There is no file {shown}{_near_files(file)}."
        if not file.is_file():  # Reading a device or a pipe might never end.
            return f"{shown} is not a regular file but a device, pipe or socket: save what it gives as a file first."
        return _too_large(path, file.stat().st_size)
    except PermissionError:
        return f"{shown} may not be read by this user: change its permissions."
    except (OSError, ValueError) as error:
        return f"{shown} cannot be read: {getattr(error, 'strerror', None) or error}."


def check_there(*paths: str | Path | None) -> None:
    """Raises UserError for the first that is neither a folder nor a file that is read; None counts for nothing."""
    for path in paths:
        if path is not None and not os.path.isdir(path) and (problem := missing_file(path)):
            raise UserError(problem)


@contextmanager
def opened(path: str | Path) -> Iterator[BinaryIO]:
    """The file, open for reading its bytes. Raises UserError, in one sentence, where there is no regular file of a size
    that is read, and where reading it fails."""
    if problem := missing_file(path):
        raise UserError(problem)
    try:
        # A pipe put in the file's place since must not make us wait for its other end.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise UserError(
                    f"{path} is not a regular file but a device, pipe or socket: save what it gives as a file first."
                )
            yield file
    except PermissionError as error:
        raise UserError(f"{path} may not be read by this user: change its permissions.") from error
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror or error}.") from error


def file_size(file: BinaryIO) -> int:
    """Of an open file, in bytes."""
    return os.fstat(file.fileno()).st_size


def read_bytes(path: str | Path) -> bytes:
    """The file's bytes. Raises UserError, in one sentence, where there is no regular file of a size that is read."""
    with opened(path) as file:
        content = file.read(file_size(file) + 1)
        # Files that a system makes as they are read state no size.
        while not _too_large(path, len(content)) and (more := file.read(CHUNK)):
            content += more
    if problem := _too_large(path, len(content)):
        raise UserError(problem)
    return content


def add_to_digest(digest: hashlib._Hash, path: str | Path) -> None:
    """Adds the file's bytes to a digest, without holding them. Raises UserError as `read_bytes` does."""
    size = 0
    with opened(path) as file:
        while piece := file.read(CHUNK):
            digest.update(piece)
            size += len(piece)
            if problem := _too_large(path, size):
                raise UserError(problem)


def read_text(path: str | Path) -> str:
    """The file's text without marks of byte order before it. Raises UserError, in one sentence, when there is none."""
    content = read_bytes(path)
    for mark, name in OTHER_UNICODE.items():
        if content.startswith(mark):
            raise UserError(f"{path} is not UTF-8 text but {name}: save it as CSV in UTF-8, or take it in with intake.")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UserError(f"{path} is not UTF-8 text (line {line}): save it as CSV in UTF-8.") from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise UserError(f"{path} is a binary file, not UTF-8 text (line {line} holds a NUL): save it as CSV in UTF-8.")
    # Programs that do not see a mark put another one before it.
    text = text.lstrip(BYTE_ORDER_MARK)
    if not text or text.isspace():
        raise UserError(f"{path} is empty: it needs a header and rows.")
    return text


def _largest_gb() -> float:
    told = os.environ.get(LARGER, "")
    try:
        size = float(told) if told else LARGEST_GB
    except ValueError:
        size = math.nan
    if not 0 < size < 1e6:
        raise UserError(f"{LARGER}={told!r} is no size: give the largest file to be read in GB, such as 8.")
    return size


def _too_large(path: str | Path, size: int) -> str | None:
    largest = _largest_gb()
    if size <= 1e9 * largest:
        return None
    return (
        f"{path} is larger than is read ({size / 1e9:.3g} GB of at most {largest:.3g}): leave out what is not needed, "
        f"or raise the limit with {LARGER}=…"
    )


def _near_files(file: Path) -> str:
    """What to suggest for a missing file, from the names in its folder; the start of a clause, or nothing."""
    if not file.parent.is_dir():
        return f": its folder {file.parent} does not exist either"
    names = sorted(f.name for f in file.parent.iterdir() if f.is_file())
    kind = file.suffix.lower() or ".csv"
    near = get_close_matches(file.name, names, n=3) or [n for n in names if n.lower().endswith(kind)][:5]
    where = "this folder" if file.parent == Path() else file.parent
    return f": {where} holds {', '.join(near)}" if near else f", nor any other {kind} file in {where}"
