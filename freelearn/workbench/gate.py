"""What reaches the page: requests of a browser on this machine for what the page consists of; whole, known messages."""

from __future__ import annotations

import logging
import re
from typing import Any

from bokeh.protocol.exceptions import ProtocolError, ValidationError
from bokeh.util.token import check_token_signature
from panel.io.server import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import Application, RequestHandler

from freelearn.workbench.state.session import Sessions

log = logging.getLogger(__name__)

ADDRESS = "127.0.0.1"
NAMES = ("localhost", ADDRESS)
# The page itself, its socket, its icon and the scripts of Bokeh and Panel. Panel would also import any module that a
# path under /components names, and Bokeh give a session to any site that asks for /autoload.js.
PATHS = re.compile(r"/|/ws|/favicon\.ico|/static/(?:(?!%00)[\x21-\x7e])+")
# Who names a session of Bokeh's chooses one that another may know.
FIXED = ("bokeh-session-id", "bokeh-token")
# A browser's client sends these; PUSH-DOC would put another page in the place of this one.
KINDS = ("PATCH-DOC", "PULL-DOC-REQ", "SERVER-INFO-REQ")
EVENTS = ("ModelChanged", "MessageSent")
# Nothing is posted, and headers are those of a browser; seconds until a request has to be whole.
LIMITS = {"max_body_size": 2**16, "max_header_size": 2**16, "idle_connection_timeout": 60, "body_timeout": 20}
# A dropped file comes in pieces of 10 MB.
LARGEST_MESSAGE = 32 * 2**20
# The code of a close frame.
REFUSED = 1008


def guard(application: Application, port: int, sessions: Sessions, **socket: Any) -> None:
    """Puts the gate before everything that the server has. A page without a session is sent on to the address of a new
    one, so that going back, forward and reloading find it again. socket: what Bokeh's own socket handler is given."""
    stranger = Rule(_ForeignRequest(port), _Refused, {"port": port})
    nameless = Rule(_NoSession(sessions), _Begin, {"sessions": sessions})
    application.add_handlers(".*", [stranger, nameless, ("/ws", _Socket, socket)])


class _ForeignRequest(Matcher):
    """Requests that are refused. Any site can have its own name lead to this machine: the name counts."""

    def __init__(self, port: int) -> None:
        self.hosts = {f"{name}:{port}" for name in NAMES} | (set(NAMES) if port == 80 else set())
        self.origins = {f"http://{host}" for host in self.hosts}

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        return None if self._welcome(request) else {}

    def _welcome(self, request: HTTPServerRequest) -> bool:
        headers = request.headers
        named = any(name in request.arguments for name in FIXED) or FIXED[0] in headers
        if request.host.lower() not in self.hosts or not PATHS.fullmatch(request.path) or named:
            return False
        if headers.get("Origin", f"http://{request.host}").lower() not in self.origins:
            return False
        # What other sites have a browser fetch or frame; a link that one follows is no harm.
        opened = (headers.get("Sec-Fetch-Mode"), headers.get("Sec-Fetch-Dest")) == ("navigate", "document")
        return opened or headers.get("Sec-Fetch-Site", "none") in ("none", "same-origin")


class _Refused(RequestHandler):
    def initialize(self, port: int) -> None:
        self.port = port

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"This is not served here: open http://{NAMES[0]}:{self.port}/ itself.\n")


class _NoSession(Matcher):
    """Requests for the page of no session."""

    def __init__(self, sessions: Sessions) -> None:
        self.sessions = sessions

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        asked = request.query_arguments.get("session", [b""])[0].decode("ascii", "replace")
        return {} if request.path == "/" and not self.sessions.known(asked) else None


class _Begin(RequestHandler):
    def initialize(self, sessions: Sessions) -> None:
        self.sessions = sessions

    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.redirect(f"/?session={self.sessions.get('')[0]}")


class _Socket(WSHandler):
    """Bokeh's socket; a message that is not as its client sends it ends the connection, with one line in the log."""

    size, refused = 0, False

    async def prepare(self) -> None:
        """Refuses before there is a socket where the token is none that the page gave out."""
        await super().prepare()  # type: ignore[no-untyped-call]
        kind, _, token = self.request.headers.get("Sec-WebSocket-Protocol", "").partition(",")
        if kind.strip() != "bokeh" or not self._signed(token.strip()):
            self.set_status(403)
            self.finish()

    def _signed(self, token: str) -> bool:
        try:
            return bool(check_token_signature(token, secret_key=self.application.secret_key, signed=True))
        except (ValueError, TypeError, KeyError, RecursionError):
            # Not even what a token looks like.
            return False

    def open(self, *args: Any, **kwargs: Any) -> None:
        """Refuses a token that has expired."""
        # Bokeh writes a message in three pieces or more: the second would wait until the browser has acknowledged the
        # first, for 40 ms.
        self.set_nodelay(True)
        try:
            super().open(*args, **kwargs)  # type: ignore[no-untyped-call]
        except ProtocolError as problem:
            self._refuse(str(problem))

    async def _receive(self, fragment: str | bytes) -> Any:
        if self.refused:
            # The other end has not yet heard of it.
            return None
        if self.receiver is None or self.connection is None:
            self._refuse("a message before the page was ready")
            return None
        self.size += len(fragment)
        if self.size > LARGEST_MESSAGE:
            self._refuse(f"a message of more than {LARGEST_MESSAGE // 2**20} MB")
            return None
        try:
            message = await self.receiver.consume(fragment)
            if message:
                self.size = 0
                _check(message)
            return message
        except Exception as problem:
            self._refuse(f"{type(problem).__name__}: {problem}")
            return None

    def _refuse(self, why: str) -> None:
        self.refused = True
        log.warning("refused what came to the page's socket: %s", why)
        self.close(REFUSED, "not a message of this page")


def _check(message: Any) -> None:
    """Raises ValidationError or any other where no client of the page would have sent the message."""
    if message.msgtype not in KINDS:
        raise ValidationError(f"{message.msgtype!r} is no message of this page")
    if message.msgtype == "PATCH-DOC":
        events = message.content["events"]
        if not all(event["kind"] in EVENTS for event in events):
            raise ValidationError("a change that no client makes")
        if _packed(message.content):
            # A browser's bytes come in frames of their own; these may unfold to any size.
            raise ValidationError("packed bytes inside of a message")


def _packed(part: Any) -> bool:
    """Whether compressed bytes stand anywhere in it."""
    if isinstance(part, dict):
        return (part.get("type") == "bytes" and isinstance(part.get("data"), str)) or any(map(_packed, part.values()))
    return isinstance(part, list) and any(map(_packed, part))
