"""Several files that were dropped together, or in an archive: kept in a folder of their own, under names of the page's
choosing."""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from freelearn.common.errors import UserError
from freelearn.common.files import write_bytes
from freelearn.data.intake.readers.raw_files import ENDINGS, is_matlab

# More files are no recordings of one test; names of files and folders are no longer.
MOST_FILES, LONGEST_PART = 300, 80
# What archives hold besides: of macOS, and hidden.
BESIDES = ("__MACOSX", ".")
# What other files are that are archives inside: workbooks, documents.
OF_OTHERS = ("[Content_Types].xml", "mimetype", "content.xml", "xl/workbook.xml")


def unpacked(content: bytes, most: int) -> dict[str, bytes]:
    """The tables in an archive, name → bytes, where it is one of files; {} where it is none, but a workbook, say. most:
    bytes that all of them may have. Raises UserError where it cannot be unpacked, holds no tables, or too much."""
    if not content.startswith(b"PK\x03\x04") or is_matlab(content, ""):
        return {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if set(archive.namelist()) & set(OF_OTHERS):
                return {}
            inside = [entry for entry in archive.infolist() if _is_table(entry.filename)]
            if len(inside) > MOST_FILES or sum(entry.file_size for entry in inside) > most:
                raise UserError(f"The archive holds more than {MOST_FILES} tables, or {most >> 20} MB: drop fewer.")
            files = {entry.filename: archive.read(entry) for entry in inside}
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError) as problem:
        raise UserError(f"The archive cannot be unpacked ({problem}): unpack it, and drop its files.") from None
    if not files:
        raise UserError(f"The archive holds no tables ({', '.join(ENDINGS)}): drop the files themselves.")
    return files


def _is_table(name: str) -> bool:
    return name.lower().endswith(ENDINGS) and not any(part.startswith(BESIDES) for part in name.split("/"))


def kept_in_folder(files: Mapping[str, bytes], folder: Path) -> Path:
    """Where the files lie now: in a folder inside `folder`, and in folders of it as their names say, one deep."""
    digest = hashlib.sha256()
    for name, content in files.items():
        digest.update(name.encode("utf-8", "replace") + b"\0" + hashlib.sha256(content).digest())
    made = folder / f"dropped_{digest.hexdigest()[:16]}"
    deep = min(len(PurePosixPath(name).parts) for name in files) > 1
    for name, content in files.items():
        # Of the folders above only the last tells recordings apart.
        parts = [_plain(part) for part in PurePosixPath(name).parts[-2 if deep else -1 :]]
        path = made.joinpath(*parts)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
    return made.resolve()


def _plain(part: str) -> str:
    """A part of a name without what leads elsewhere or turns a line."""
    return re.sub(r"[^\w .,()\[\]+=-]", "_", part)[-LONGEST_PART:].lstrip(".") or "_"
