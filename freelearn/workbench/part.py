"""A part of the page: it shows the session, and hands on what the user chooses in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from freelearn.workbench.session import Session


class Part:
    """What the page itself sets is no choice of the user's."""

    def __init__(self, session: Session) -> None:
        self.session, self.refreshing = session, False

    @contextmanager
    def shown(self) -> Iterator[None]:
        """While the page sets its widgets."""
        self.refreshing = True
        try:
            yield
        finally:
            self.refreshing = False

    def chosen(self, name: str, value: Any) -> None:
        """Hands on what the user chose."""
        if not self.refreshing and value is not None:
            self.session.choose(**{name: value})
