"""All sessions under one work folder."""

from __future__ import annotations

import re
import secrets
from pathlib import Path

from freelearn.workbench.session import Session

ID = re.compile(r"[0-9a-f]{16}")


class Sessions:
    """By the id in the page's address."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.open: dict[str, Session] = {}

    def known(self, asked: str) -> bool:
        """Whether there is a session of that id."""
        return bool(ID.fullmatch(asked)) and (asked in self.open or (self.folder / asked).is_dir())

    def get(self, asked: str) -> tuple[str, Session]:
        """The session of that id, or a new one where there is no such id."""
        name = asked if self.known(asked) else secrets.token_hex(8)
        if name not in self.open:
            self.open[name] = Session(self.folder / name)
        return name, self.open[name]

    def close(self) -> None:
        """Stops every running job."""
        for session in self.open.values():
            if session.job is not None:
                session.job.cancel()
