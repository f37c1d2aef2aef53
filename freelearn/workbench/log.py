"""What the page's server says in the terminal: a line for each thing, and how our own mistakes came about."""

from __future__ import annotations

import logging
from types import TracebackType

from bokeh.util.logconfig import basicConfig
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

OWN = __name__.split(".")[0]
# Messages hold what came from outside, of any length.
LONGEST = 300


class Lines(logging.Formatter):
    """One line, whatever is in the message. A traceback only where code of this package is part of it: what Bokeh or
    Tornado stumbled over was sent to it."""

    def format(self, record: logging.LogRecord) -> str:
        """The text of one record."""
        text, problem = record.getMessage(), record.exc_info
        if problem and problem[1]:
            text = f"{type(problem[1]).__name__}: {problem[1]}: {text}"
        # Blanks instead of line ends, and nothing that a terminal obeys.
        text = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
        line = f"{record.levelname.lower()}: {text[:LONGEST]}{'…' if len(text) > LONGEST else ''}"
        if problem and _ours(problem[2]):
            line = f"{line}\n{self.formatException(problem)}"
        return line


def of_interest(record: logging.LogRecord) -> bool:
    """Whether a record says more than that a tab was closed while something was on its way to it."""
    problem = record.exc_info[1] if record.exc_info else None
    return not isinstance(problem, StreamClosedError | WebSocketClosedError)


def _ours(trace: TracebackType | None) -> bool:
    while trace is not None:
        if str(trace.tb_frame.f_globals.get("__name__")).split(".")[0] == OWN:
            return True
        trace = trace.tb_next
    return False


def log_in_lines() -> None:
    """Has everything that is logged in this process written so."""
    handler = logging.StreamHandler()
    handler.setFormatter(Lines())
    handler.addFilter(of_interest)
    # Bokeh's wrapper also takes away what Bokeh has set up itself.
    basicConfig(handlers=[handler], level=logging.WARNING, force=True)
    panel = logging.getLogger("panel")
    panel.handlers.clear()
    panel.setLevel(logging.WARNING)
    panel.propagate = True
