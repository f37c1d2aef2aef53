"""The page's server, what it says in the terminal, and names of parts of the page for a screen reader."""

from __future__ import annotations

import errno
import importlib
import logging
import signal
import threading
import time
from pathlib import Path
from types import TracebackType

import panel as pn
from bokeh.models import CustomJS
from bokeh.util.logconfig import basicConfig
from bokeh.util.token import generate_secret_key
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

from freelearn.common.errors import UserError
from freelearn.workbench.gate import ADDRESS, LARGEST_MESSAGE, LIMITS, NAMES, guard
from freelearn.workbench.panels.page import Page
from freelearn.workbench.state.job import warm_up
from freelearn.workbench.state.own_code import load_named_code
from freelearn.workbench.state.session import Sessions

# What a keyboard and a screen reader need of Bokeh's own widgets and do not find: names, and tabs that are some.

# What is drawn later has to be named too, within the frame in which it is drawn: looking through the page takes a
# millisecond. An observer does not see into the shadow of a widget, so each shadow has itself observed; one that is
# attached to what stands already is seen within a second.
_CODE = """
const named = {".bk-spin-btn-up": "more", ".bk-spin-btn-down": "less"};
let waiting = false;
const observer = new MutationObserver(() => {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; name(document.body); });
});
const observed = new WeakSet();
function name(root) {
  if (!observed.has(root)) {
    observed.add(root);
    observer.observe(root, {childList: true, subtree: true, attributes: true, attributeFilter: ["class"]});
  }
  for (const element of root.querySelectorAll("*")) {
    for (const [selector, label] of Object.entries(named))
      if (element.matches(selector) && !element.hasAttribute("aria-label")) element.setAttribute("aria-label", label);
    if (element.matches(".noUi-handle") && !element.hasAttribute("aria-label")) {
      // As the slider's title begins, before what it shows.
      const title = root.querySelector(".bk-slider-title")?.textContent ?? "", end = handleEnd(element);
      element.setAttribute("aria-label", (title.split(/[(:[]/)[0].trim() || "slider") + end);
    }
    if (element.matches(".bk-tab")) turnable(element);
    if (element.shadowRoot) name(element.shadowRoot);
  }
}
function handleEnd(handle) {
  if (handle.parentElement.parentElement.querySelectorAll(".noUi-handle").length < 2) return "";
  return handle.matches(".noUi-handle-lower") ? ", from" : ", to";
}
function turnable(tab) {
  tab.setAttribute("aria-selected", String(tab.classList.contains("bk-active")));
  if (tab.getAttribute("role") === "tab") return;
  tab.setAttribute("role", "tab");
  tab.parentElement.setAttribute("role", "tablist");
  tab.addEventListener("keydown", event => {
    const all = [...tab.parentElement.querySelectorAll(".bk-tab")];
    const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (step) all[(all.indexOf(tab) + step + all.length) % all.length].focus();
    else if (event.key === "Enter" || event.key === " ") tab.click();
    else return;
    event.preventDefault();
  });
}
const main = document.body.querySelector("div");
if (main) main.setAttribute("role", "main");
setInterval(() => name(document.body), 1000);
name(document.body);
"""


def name_parts() -> None:
    """Has the page that is being made name its parts, in the browser."""
    if pn.state.curdoc is not None:
        pn.state.curdoc.js_on_event("document_ready", CustomJS(code=_CODE))


# What the page's server says in the terminal: a line for each thing, and how our own mistakes came about.

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


# As Bokeh says of a tab that was closed, or loaded anew, before it had all that it asked for.
CLOSED = "Failed sending message as connection was closed"


def of_interest(record: logging.LogRecord) -> bool:
    """Whether a record says more than that a tab was closed while something was on its way to it."""
    problem = record.exc_info[1] if record.exc_info else None
    closed = isinstance(problem, StreamClosedError | WebSocketClosedError)
    return not closed and not record.getMessage().startswith(CLOSED)


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


# The page's server.

TITLE = "freelearn workbench"
GONE = "The workbench has ended or cannot be reached. Start it again in the same folder and reload: your work is kept."
# Charts, widgets and words alike; hues keep their meaning.
DARK = "@media (prefers-color-scheme: dark) { html { background: #fff; filter: invert(0.92) hue-rotate(180deg); } }"
# Charts keep the width that they have on the screen: a sheet has room for that of a large one. Colors are printed, too.
PRINTED = "@page { size: A4 landscape; margin: 8mm; } @media print { html { zoom: 0.55; print-color-adjust: exact; } }"


def _prepare() -> None:
    """Imports what the first results will need, here and in the process that jobs are forked from."""
    warm_up()
    threading.Thread(target=importlib.import_module, args=("freelearn.workbench.panels.results",), daemon=True).start()


def serve(port: int, folder: Path, sweeps: Path, open_browser: bool) -> None:
    """Serves until interrupted, to this machine only. Raises UserError when the port is taken."""
    started = time.perf_counter()
    pn.extension("filedropper", disconnect_notification=GONE, notifications=True, raw_css=[DARK, PRINTED])
    log_in_lines()
    load_named_code()
    sessions = Sessions(folder)

    def page() -> pn.viewable.Viewable:
        asked = (pn.state.session_args or {}).get("session", [b""])[0].decode("ascii", "replace")
        # Not before: on two cores these would keep the first page waiting.
        pn.state.onload(_prepare)
        name_parts()
        return Page(sessions.get(asked)[1], sweeps).view

    try:
        server = pn.serve(
            {"/": page},
            address=ADDRESS,
            port=port,
            title=TITLE,
            show=open_browser,
            start=False,
            threaded=False,
            websocket_origin=[f"{name}:{port}" for name in NAMES],
            websocket_max_message_size=LARGEST_MESSAGE,
            http_server_kwargs=dict(LIMITS),
            # A tab's id of Bokeh's is signed: nobody makes one up.
            sign_sessions=True,
            secret_key=generate_secret_key().encode(),
            verbose=False,
        )
    except OSError as problem:
        if problem.errno != errno.EADDRINUSE:
            raise
        raise UserError(f"Port {port} is taken by another program: choose another with --port.") from None
    application = server._tornado
    guard(application, port, sessions, application_context=application.applications["/"], bokeh_websocket_path="/ws")
    print(f"freelearn workbench: http://localhost:{port} ({time.perf_counter() - started:.1f} s); Ctrl-C ends it")
    server.start()
    loop = server.io_loop
    signal.signal(signal.SIGTERM, lambda *_: loop.add_callback_from_signal(loop.stop))
    try:
        loop.start()
    except KeyboardInterrupt:
        print("ended; the page's address finds your work again")
    finally:
        sessions.close()
