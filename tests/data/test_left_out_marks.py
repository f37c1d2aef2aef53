"""Rows that are marked as left out: by Python's own reader one cell of theirs changes, and nothing else."""

import csv
import io

import pytest

from freelearn.data.table.records import mark_left_out


def rows(content: bytes) -> list[list[str]]:
    return list(csv.reader(io.StringIO(content.decode("utf-8-sig"), newline="")))


BESIDE = b'sample,left_out,note\r\n3,,"a, b"\r\n3,0,"two\r\nlines"\r\n3,,c\r\n'
BEHIND = b'sample,note\n3,"a, b"\n3,"two\nlines"\n3,c\n'


@pytest.mark.parametrize("content", [BESIDE, BEHIND, b"\xef\xbb\xbf" + BEHIND], ids=["beside", "behind", "marked"])
@pytest.mark.parametrize(("line", "place"), [(2, 1), (3, 2), (5, 3)])
def test_one_cell_changes(content, line, place):
    """Lines are those of the file: a record of two lines is marked by its first."""
    before, after = rows(content), rows(mark_left_out(content, [line]))
    column = after[0].index("left_out")
    marks = [row[column] if "left_out" in before[0] else "" for row in before[1:]]
    marks[place - 1] = "1"
    assert [row[column] for row in after[1:]] == marks
    others = [[*row[:column], *row[column + 1 :]] for row in after]
    assert others == [[cell for cell, name in zip(row, before[0], strict=True) if name != "left_out"] for row in before]


@pytest.mark.parametrize("ending", [b"\n", b"\r\n"])
def test_what_stands_elsewhere_stays_to_the_byte(ending):
    """The mark of the byte order, a line that names the separator, endings of lines, none behind the last row."""
    content = b"\xef\xbb\xbf" + ending.join([b"sep=,", b"sample,left_out", b'"3",', b"4, 0", b"5,"])
    marked = mark_left_out(content, [4])
    assert marked == content.replace(b"4, 0", b"4,1")
    assert mark_left_out(content, []) == content
