"""The page's server."""

from __future__ import annotations

import errno
import importlib
import signal
import threading
import time
from pathlib import Path

import panel as pn
from bokeh.util.token import generate_secret_key

from freelearn.errors import UserError
from freelearn.workbench.gate import ADDRESS, LARGEST_MESSAGE, LIMITS, NAMES, guard
from freelearn.workbench.job import warm_up
from freelearn.workbench.log import log_in_lines
from freelearn.workbench.own import load_named_code
from freelearn.workbench.page import Page
from freelearn.workbench.sessions import Sessions
from freelearn.workbench.spoken import name_parts

TITLE = "freelearn workbench"
GONE = "The workbench has ended or cannot be reached. Start it again in the same folder and reload: your work is kept."
# Charts, widgets and words alike; hues keep their meaning.
DARK = "@media (prefers-color-scheme: dark) { html { background: #fff; filter: invert(0.92) hue-rotate(180deg); } }"


def _prepare() -> None:
    """Imports what the first results will need, here and in the process that jobs are forked from."""
    warm_up()
    threading.Thread(target=importlib.import_module, args=("freelearn.workbench.results",), daemon=True).start()


def serve(port: int, folder: Path, sweeps: Path, open_browser: bool) -> None:
    """Serves until interrupted, to this machine only. Raises UserError when the port is taken."""
    started = time.perf_counter()
    pn.extension("filedropper", disconnect_notification=GONE, notifications=True, raw_css=[DARK])
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
