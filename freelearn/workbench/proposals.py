"""What the search wrote itself, where no effect of the library explains what is missing."""

from __future__ import annotations

from typing import Any

import panel as pn

from freelearn.workbench.proposal_block import ProposalBlock
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading

WRITTEN, HINTED = "What the search wrote", "A hint at what remains"


class Proposals:
    """A block for each proposal, or one for a hint. Hidden where there is neither."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.shown: Any = None
        self.blocks: list[ProposalBlock] = []
        self.view = pn.Column(visible=False)

    def refresh(self) -> None:
        """Shows the session as it is."""
        search = self.session.discovery() or {}
        # A search of former times knows neither.
        entries, hint = search.get("proposals", []), search.get("hint")
        shown = (self.session.search or {}).get("folder"), entries, hint
        if shown != self.shown:
            self.shown = shown
            self._draw(entries, hint)
        for block in self.blocks:
            block.refresh()

    def _draw(self, entries: list[dict[str, Any]], hint: dict[str, Any] | None) -> None:
        self.blocks = []
        if self.session.search is not None:
            folder = self.session.folder / self.session.search["folder"]
            self.blocks = [ProposalBlock(self.session, folder, entry) for entry in entries]
            if hint and not entries:
                self.blocks = [ProposalBlock(self.session, folder, hint, hint=True)]
        self.view.objects = [heading(WRITTEN if entries else HINTED), *(block.view for block in self.blocks)]
        self.view.visible = bool(self.blocks)
