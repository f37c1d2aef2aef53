"""The page under attack: requests, other origins, other sessions, many tabs at once."""

import asyncio
import random

import pytest
from attack_page import SECRET, Tab, end, serving, socket_of, usable, waited
from nightly import EVERY, chosen
from tornado.httpclient import HTTPClientError

from freelearn.workbench.state.session import Sessions

pytestmark = pytest.mark.slow


UP = ("..", "%2e%2e", "..%2f..", "%252e%252e", "..%5c..", ".%00.", "....//")
ROOTS = ("/", "/static/", "/static/extensions/", "/static/extensions/panel/", "/static/js/")
TRAVERSALS = [
    f"{root}{'/'.join([up] * 9)}/{goal}" for root in ROOTS for up in UP for goal in ("etc/passwd", "secret.txt")
]
UNKNOWN = [
    "/secret.txt", "/sessions/secret.txt", "/admin", "/rest/session_info", "/metadata", "/autoload.js",
    "/autoload.js?bokeh-autoload-element=x&bokeh-absolute-url=http://[", "/liveness", "/static/%00",
    "/static/extensions/panel/%00", "/static/js", "/static/extensions/", "/static/extensions/x/y", "//evil.example/",
    "/components/antigravity/fly/css/x", "/components/.../path/css/x", "/components/os/path/__doc__/x",
    "/" + "a" * 5000, "/static/" + "a" * 5000, "/?bokeh-session-id=mine", "/?bokeh-session-id=",
    "/?bokeh-token=abc", "/?bokeh-token=",
    "/static/\xff\xfe", "/;/", "/%", "/static/%",
]  # fmt: skip
# In the order of how little they look like HTTP.
RAW = [
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", b"\x00\xff\r\n\r\n", b"\r\n\r\n\r\n", b"GET\r\n\r\n",
    b"GET / HTTP/9.9\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: %H\r\nX-\xff: \xfe\r\n\r\n", b"GET / HTTP/1.1\r\nHost: %H\r\nX: a\x00b\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: %H\r\n no name\r\n\r\n", b"GET /\x1b[31m HTTP/1.1\r\nHost: %H\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: %H\r\nX: " + b"a" * 200_000 + b"\r\n\r\n",
    b"GET /" + b"a" * 200_000 + b" HTTP/1.1\r\n\r\n",
    b"POST / HTTP/1.1\r\nHost: %H\r\nContent-Length: -5\r\n\r\nabcde",
    b"POST / HTTP/1.1\r\nHost: %H\r\nContent-Length: 5000000000\r\n\r\nabcde",
    b"POST / HTTP/1.1\r\nHost: %H\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\nabcde",
    b"POST / HTTP/1.1\r\nHost: %H\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\nabcde",
    b"POST / HTTP/1.1\r\nHost: %H\r\nContent-Length: 5\r\n\r\nabcde", b"EVIL / HTTP/1.1\r\nHost: %H\r\n\r\n",
    b"GET /ws HTTP/1.1\r\nHost: %H\r\n\r\n",
    b"GET /ws HTTP/1.1\r\nHost: %H\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 99\r\n\r\n",
    b"GET /ws HTTP/1.1\r\nHost: %H\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\r\n",
]  # fmt: skip


def test_paths_that_are_no_part_of_the_page_are_refused(server):
    cases = chosen([*TRAVERSALS, *UNKNOWN], 50)
    for path in cases:
        status, body = server.get(path)
        assert status in (400, 403, 404), path
        assert SECRET not in body, path
        assert "root:" not in body, path


def test_malformed_requests_are_refused(server):
    host = f"localhost:{server.port}".encode()
    generator = random.Random(0)
    noise = [generator.randbytes(200) + b"\r\n\r\n" for _ in range(500 if EVERY else 10)]
    for data in [*RAW, *noise]:
        answer = server.raw(data.replace(b"%H", host))
        assert answer[:12] in (b"", b"HTTP/1.1 400", b"HTTP/1.1 403", b"HTTP/1.1 405", b"HTTP/1.1 426"), data[:80]
    assert server.get(f"/?session={server.begun()}")[0] == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{}", "localhost", "localhost:1", "127.0.0.1.evil.example:{}"]
)
def test_a_site_whose_name_leads_to_this_machine_gets_nothing(server, host):
    host = host.format(server.port)
    status, body = server.get("/", host=host)
    assert (status, "token" in body) == (403, False)
    # As such a site's own page would ask: its origin is then the same as the host.
    token = server.token()
    with pytest.raises(HTTPClientError, match="403"):
        waited(socket_of(server, token, origin=f"http://{host}", host=host))


ORIGINS = [
    "http://evil.example",
    "null",
    "http://evil.example:{}",
    "http://localhost:1",
    "http://localhost:{}.evil.example",
]
ORIGINS += ["https://localhost:{}", "http://[", "file://", "http://localhost:{}@evil.example", "http://127.0.0.2:{}"]


def test_a_socket_is_opened_from_the_pages_own_origin_alone(server):
    token = server.token()

    async def opened(origin):
        connection = await socket_of(server, token, origin)
        said = await connection.read_message()
        await end(connection)
        return "ACK" in said

    for name in ("localhost", "127.0.0.1"):
        assert waited(opened(f"http://{name}:{server.port}"))
    for origin in ORIGINS:
        with pytest.raises(HTTPClientError, match="403"):
            waited(opened(origin.format(server.port)))


def test_other_sites_cannot_frame_the_page_or_have_it_fetched_but_a_link_opens_it(server):
    for mode, dest in (("navigate", "iframe"), ("no-cors", "image"), ("cors", "empty"), ("no-cors", "script")):
        fetch = [f"Sec-Fetch-Mode: {mode}", f"Sec-Fetch-Dest: {dest}"]
        for site in ("cross-site", "same-site"):
            assert server.get("/", f"Sec-Fetch-Site: {site}", *fetch)[0] == 403
    assert (
        server.get("/", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: document")[0] == 302
    )
    assert server.get("/", "Sec-Fetch-Site: none", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: document")[0] == 302


def test_ids_cannot_be_guessed_and_lead_nowhere_else(server, tmp_path):
    sessions = Sessions(tmp_path / "work")
    names = [sessions.get("")[0] for _ in range(200)]
    assert len(set(names)) == 200
    # Each of 64 bits is as often set as not: 5 standard deviations of 200 draws are 35.
    bits = [f"{int(name, 16):064b}" for name in names]
    assert all(65 <= sum(b[place] == "1" for b in bits) <= 135 for place in range(64))
    known = server.folder / "0123456789abcdef"
    known.mkdir()
    for asked in (
        "../sessions",
        "..",
        "0123456789abcde",
        "0123456789abcdef/",
        "0123456789ABCDEF",
        "%2e%2e",
        "\xff",
        "a" * 16,
    ):
        name, session = Sessions(server.folder).get(asked)
        assert name != asked
        assert session.folder.parent == server.folder


def test_two_tabs_of_other_sessions_neither_see_nor_reach_each_other(server):
    async def tried():
        one, other = await Tab.open(server), await Tab.open(server)
        # Each model of one tab, asked of the other: none is known there.
        assert not set(one.models) & set(other.models)
        await other.change(one.find(title="data"), "value", "dmsp20")
        said = await other.hear('"ERROR"') and await other.hear("text")
        await one.close()
        await other.close()
        return said

    assert "resolve reference" in waited(tried())


TABS = 30


@pytest.mark.nightly
def test_thirty_tabs_are_usable_at_once_in_bounded_memory(tmp_path):
    async def opened(server):
        tabs = [await Tab.open(server) for _ in range(TABS)]
        for tab in tabs:
            await tab.change(tab.find(title="data"), "value", "hidden")
        for tab in tabs:
            assert await tab.hear('"visible"')
        memory = server.memory
        for tab in tabs:
            await tab.close()
        return memory

    with serving(tmp_path) as server:
        waited(usable(server))
        first = server.memory
        peaks = [waited(opened(server))]
        assert peaks[0] - first < 6 * TABS
        if EVERY:
            for _ in range(3):
                # Bokeh looks for tabs that are gone every 17 s, and waits 15 s for them to come back.
                waited(asyncio.sleep(40))
                peaks.append(waited(opened(server)))
            assert peaks[-1] - peaks[0] < 2 * TABS
        assert "Traceback" not in server.log
