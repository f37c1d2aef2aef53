"""Reading a file of text that the user named, or saying in one sentence why it cannot be read."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from freelearn.errors import UserError


def missing_file(path: str | Path) -> str | None:
    """What to tell the user where there is no regular file of that name; None where there is."""
    file = Path(path)
    try:
        if file.is_dir():
            return f"{path} is a folder: name the CSV file in it."
        if not file.exists():
            return f"There is no file {path}{_near_files(file)}."
        if not file.is_file():  # Reading a device or a pipe might never end.
            return f"{path} is not a regular file: save the table as a CSV file first."
    except PermissionError:
        return f"{path} may not be read by this user: change its permissions."
    except (OSError, ValueError) as error:
        return f"{path} cannot be read: {getattr(error, 'strerror', None) or error}."
    return None


def read_text(path: str | Path) -> str:
    """The file's text. Raises UserError, in one sentence, when there is none to read."""
    if problem := missing_file(path):
        raise UserError(problem)
    try:
        content = Path(path).read_bytes()
    except PermissionError as error:
        raise UserError(f"{path} may not be read by this user: change its permissions.") from error
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UserError(f"{path} is not UTF-8 text (line {line}): save it as CSV in UTF-8.") from error
    if "\0" in text:
        raise UserError(f"{path} is a binary file, not UTF-8 text: save the table as CSV in UTF-8.")
    if not text.strip():
        raise UserError(f"{path} is empty: it needs a header and rows.")
    return text


def _near_files(file: Path) -> str:
    """What to suggest for a missing file, from the names in its folder; the start of a clause, or nothing."""
    if not file.parent.is_dir():
        return f": its folder {file.parent} does not exist either"
    names = sorted(f.name for f in file.parent.iterdir() if f.is_file())
    near = get_close_matches(file.name, names, n=3) or [n for n in names if n.lower().endswith(".csv")][:5]
    return f": {file.parent} holds {', '.join(near)}" if near else f", nor any CSV file in {file.parent}"
