"""Files about suspected readings: a list of them, and the user's table with their rows marked."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from freelearn.csv_text import csv_text
from freelearn.files import write_bytes, write_text
from freelearn.measurements.mark import mark_left_out
from freelearn.results.origin import Provenance
from freelearn.results.suspects import SuspectedReading, suspected_lines, suspects_frame

SUSPECTS, MARKED = "suspects.csv", "marked.csv"


def write_suspects(readings: Sequence[SuspectedReading], provenance: Provenance, folder: Path) -> None:
    """Writes suspects.csv and, where there are any in a user's file, marked.csv: that file with left_out = 1 there."""
    write_text(folder / SUSPECTS, csv_text(suspects_frame(readings)))
    marked = folder / MARKED
    if provenance.path and Path(provenance.path).resolve() == marked.resolve():
        return  # the user's own by now: what is searched is never written to
    content = _original(provenance) if readings else None
    if content is None:
        marked.unlink(missing_ok=True)
    else:
        write_bytes(marked, mark_left_out(content, suspected_lines(readings)))


def _original(provenance: Provenance) -> bytes | None:
    """The file that was searched; None where there is none, or another one by now: its lines would be others."""
    try:
        content = Path(provenance.path).read_bytes() if provenance.path else None
    except OSError:
        return None
    return content if content is not None and hashlib.sha256(content).hexdigest() == provenance.sha256 else None
