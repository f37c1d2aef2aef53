"""The page's server."""

from __future__ import annotations

import errno
import importlib
import signal
import threading
import time
from functools import partial
from pathlib import Path

import panel as pn

from freelearn.errors import UserError
from freelearn.workbench.job import warm_up
from freelearn.workbench.own import load_named_code
from freelearn.workbench.page import Page
from freelearn.workbench.session import MEGABYTE
from freelearn.workbench.sessions import Sessions

ADDRESS = "127.0.0.1"
TITLE = "freelearn workbench"


def _prepare() -> None:
    """Imports what the first results will need, here and in the process that jobs are forked from."""
    warm_up()
    threading.Thread(target=importlib.import_module, args=("freelearn.workbench.results",), daemon=True).start()


def _name_in_address(name: str) -> None:
    if pn.state.location is not None:
        pn.state.location.search = f"?session={name}"


def serve(port: int, folder: Path, sweeps: Path, open_browser: bool) -> None:
    """Serves until interrupted, to this machine only. Raises UserError when the port is taken."""
    started = time.perf_counter()
    pn.extension("filedropper")
    load_named_code()
    sessions = Sessions(folder)

    def page() -> pn.viewable.Viewable:
        asked = (pn.state.session_args or {}).get("session", [b""])[0].decode("ascii", "replace")
        name, session = sessions.get(asked)
        if name != asked:
            # The address names the session from now on: reloading it, or opening it again, goes on with the same work.
            pn.state.onload(partial(_name_in_address, name))
        # Not before: on two cores these would keep the first page waiting.
        pn.state.onload(_prepare)
        return Page(session, sweeps).view

    try:
        server = pn.serve(
            {"/": page},
            address=ADDRESS,
            port=port,
            title=TITLE,
            show=open_browser,
            start=False,
            location=True,
            threaded=False,
            websocket_origin=[f"localhost:{port}", f"{ADDRESS}:{port}"],
            # A dropped file comes in pieces of 10 MB and may be large; what is larger still is refused with a message.
            websocket_max_message_size=32 * MEGABYTE,
            verbose=False,
        )
    except OSError as problem:
        if problem.errno != errno.EADDRINUSE:
            raise
        raise UserError(f"Port {port} is taken by another program: choose another with --port.") from None
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
