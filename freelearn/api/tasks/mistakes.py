"""A user's mistakes, gathered so that all are told at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from freelearn.api.settings.parse import mistakes_error
from freelearn.errors import UserError

Result = TypeVar("Result")


class Mistakes:
    """Runs checks that do not depend on each other, and raises one UserError for all that failed."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def check(self, call: Callable[[], Result]) -> Result | None:
        """What the call gives; None where it raised a UserError, which is kept."""
        try:
            return call()
        except UserError as mistake:
            self.sentences.append(str(mistake))
            return None

    def tell(self) -> None:
        """Raises UserError where there were mistakes."""
        if self.sentences:
            raise mistakes_error(self.sentences)
