"""progress.json: the fits of a search that has not ended, from which it is taken up again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from freelearn.files import write_text
from freelearn.inference.journal import Entry, Journal


class Progress:
    """The file in a search's folder. key: digest of all that the search's results depend on."""

    def __init__(self, folder: Path, key: str) -> None:
        self.path, self.key = folder / "progress.json", key

    def journal(self) -> Journal:
        """What an interrupted search of the same question left, and whatever is added to it kept in the file.

        A file that is damaged, or of another question, holds nothing."""
        return Journal(self._read(), self._keep)

    def end(self) -> None:
        """The search has ended: nothing is to be taken up."""
        self.path.unlink(missing_ok=True)

    def _read(self) -> list[Entry]:
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            entries: list[Entry] = content["fits"]
            return entries if content["digest"] == self._digest(entries) else []
        except (OSError, ValueError, KeyError, TypeError):
            return []

    def _keep(self, entries: Sequence[Entry]) -> None:
        write_text(self.path, json.dumps({"digest": self._digest(entries), "fits": entries}) + "\n")

    def _digest(self, entries: Sequence[Entry]) -> str:
        """Of the question and the fits: a number that was changed on the disk would lead elsewhere."""
        return hashlib.sha256((self.key + json.dumps(entries)).encode()).hexdigest()
