"""Marking rows of a user's table as left out, in a copy that is otherwise the user's own text."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection

from freelearn.measurements.records import separator_line
from freelearn.measurements.text_file import BYTE_ORDER_MARK
from freelearn.measurements.usable import LEFT_OUT


def mark_left_out(content: bytes, lines: Collection[int]) -> bytes:
    r"""A table's file with left_out = 1 in the rows that begin at these lines, and everything else as it stood.

    content: UTF-8 text of a table that `read_table` accepts. Rows keep their lines, cells their text; a column
    left_out is added where there is none, blank in the other rows.

    >>> mark_left_out(b"sample,note\r\n3,a\r\n3,b\r\n", [3])
    b'sample,note,left_out\r\n3,a,\r\n3,b,1\r\n'
    """
    text = content.decode("utf-8")
    bare = text.lstrip(BYTE_ORDER_MARK)
    mark, text = text[: len(text) - len(bare)], bare
    raw = list(io.StringIO(text, newline=""))
    reader = csv.reader(raw, strict=True)
    parts: list[str] = []
    start, place, new, begun = 0, -1, False, False
    for row in reader:
        piece, line, start = "".join(raw[start : reader.line_num]), start + 1, reader.line_num
        if not begun and separator_line(row):
            begun = True
        elif row and place < 0:
            header = [name.strip() for name in row]
            new = LEFT_OUT not in header
            place = len(header) if new else header.index(LEFT_OUT)
            piece = _appended(piece, LEFT_OUT) if new else piece
        elif row and new:
            piece = _appended(piece, "1" if line in lines else "")
        elif row and line in lines:
            piece = _exchanged(piece, row, place)
        parts.append(piece)
    return (mark + "".join(parts)).encode()


def _appended(piece: str, cell: str) -> str:
    """A row's text with one more cell before its line end."""
    body = piece.rstrip("\r\n")
    return f"{body},{cell}{piece[len(body) :]}"


def _exchanged(piece: str, row: list[str], place: int) -> str:
    """A row's text with 1 in one of its cells."""
    ending = piece[len(piece.rstrip("\r\n")) :]
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=ending).writerow([*row[:place], "1", *row[place + 1 :]])
    return text.getvalue()
