"""The page's socket under attack: messages, tokens, changes and files that no browser sends."""

import asyncio
import re

import pytest
from attack_page import Tab, end, message, socket_of, usable, waited
from nightly import EVERY, chosen
from small_runs import make_csv
from tornado.httpclient import HTTPClientError
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

pytestmark = pytest.mark.slow


PATCH = {"events": []}
FRAGMENTS = {
    "bytes": [b"\x00\xff"],
    "words": ["abc", "def", "ghi"],
    "half": ['{"msgid":"1",', "{}", "{}"],
    "no type": ["{}", "{}", "{}"],
    "no object": ["[]", "{}", "{}"],
    "numbers": ["1", "2", "3"],
    "unknown": message("EVIL", {}),
    "deep": ["[" * 100_000, "{}", "{}"],
    "deep content": [*message("PATCH-DOC", {})[:2], '{"events":' + "[" * 100_000],
    "buffers in words": [*message("PATCH-DOC", PATCH, num_buffers="x"), '{"id":"b"}', b"1"],
    "buffer without id": [*message("PATCH-DOC", PATCH, num_buffers=1), '{"x":1}', b"1"],
    "text for a buffer": [*message("PATCH-DOC", PATCH, num_buffers=1), '{"id":"b"}', "1"],
    "no events": message("PATCH-DOC", {}),
    "list": message("PATCH-DOC", [1, 2]),
    "strange events": message("PATCH-DOC", {"events": [1, "a", None]}),
    "unknown event": message("PATCH-DOC", {"events": [{"kind": "Evil"}]}),
    "another title": message("PATCH-DOC", {"events": [{"kind": "TitleChanged", "title": "owned"}]}),
    "another root": message("PATCH-DOC", {"events": [{"kind": "RootRemoved", "model": {"id": "p1001"}}]}),
    "another page": message("PUSH-DOC", {"doc": {"roots": [], "title": "owned", "version": "3"}}),
    "no page": message("PUSH-DOC", {"doc": 3}),
    "packed": message("PATCH-DOC", {"events": [{"kind": "MessageSent", "x": {"type": "bytes", "data": "H4sI"}}]}),
    "too large": ["x" * (33 * 2**20)],
    "too large together": ["x" * (12 * 2**20)] * 3,
}


async def closed_after(server, fragments):
    """Whether the page ends the connection once it has been sent these."""
    connection = await socket_of(server, await asyncio.to_thread(server.token))
    for _ in range(3):
        await connection.read_message()
    try:
        for fragment in fragments:
            await connection.write_message(fragment, binary=isinstance(fragment, bytes))
        while (said := await asyncio.wait_for(connection.read_message(), 20)) is not None:
            assert '"OK"' not in said
    except (WebSocketClosedError, StreamClosedError):
        return True
    finally:
        connection.close()
    return True


def test_messages_that_no_browser_sends_end_the_connection_in_a_line(server):
    names = chosen(list(FRAGMENTS), 4)
    before = server.log.count("refused what came")
    for name in names:
        assert waited(closed_after(server, FRAGMENTS[name])), name
    # Tornado itself ends what is larger than a message may be.
    assert server.log.count("refused what came") - before >= len([n for n in names if n != "too large"])


def test_no_token_opens_a_socket_but_one_that_the_page_gave_out(server):
    token = server.token()
    body, signature = token.split(".")
    wrong = [
        "",
        "abc",
        ".",
        "e30",
        "e30.e30",
        body,
        f"{body}.",
        f"{body}.{signature[::-1]}",
        f"{body[:-4]}AAAA.{signature}",
    ]
    wrong += [f"{token}.x", "A" * 10_000, "." * 500]

    async def said(token):
        connection = await socket_of(server, token)
        try:
            return await asyncio.wait_for(connection.read_message(), 20)
        finally:
            await end(connection)

    for guess in wrong:
        with pytest.raises(HTTPClientError, match="403"):
            waited(said(guess))
    assert "ACK" in waited(said(token))


EVIL = [
    None, "x" * 1000, -1, 1e308, 10**30, True, [], {}, ["a", 1], "<script>alert(1)</script>", "../../etc/passwd",
    "\x00", {"type": "number", "value": "nan"}, {"type": "map", "entries": [["a", 1]]}, {"id": "p1"},
    {"type": "symbol"}, {"type": "object", "name": "CustomJS", "id": "q1", "attributes": {"code": "alert(1)"}},
    {"type": "object", "name": "os.system", "id": "q2", "attributes": {}},
]  # fmt: skip
TOLD = (
    "value",
    "active",
    "clicks",
    "search",
    "text",
    "options",
    "selected",
    "filename",
    "title",
    "visible",
    "disabled",
)


def test_changes_of_every_kind_leave_the_page_usable(server):
    async def attacked():
        tab = await Tab.open(server)
        cases = [(m, a, v) for m in tab.models for a in TOLD for v in EVIL]
        for model, attribute, value in chosen(cases, 200):
            await tab.change(model, attribute, value)
        for name in ("button_click", "upload_event", "delete_event", "evil_event", ""):
            for model in tab.models if EVERY else list(tab.models)[::6]:
                await tab.event(name, model)
                await tab.event(name, model, ["data", {"type": "map", "entries": [["name", 3], ["chunk", "x"]]}])
        await tab.close()

    waited(attacked())
    assert waited(usable(server))


NAMES = [
    "../../evil.csv",
    "/etc/passwd",
    "a\x00b.csv",
    "x" * 10_000 + ".csv",
    "<img src=x onerror=alert(1)>.csv",
    "CON.csv",
]
NAMES += [
    "..",
    "",
    ".csv",
    "a\nb.csv",
    "\u202efdp.csv",
    "nul",
    "a/../../b.csv",
    "state.json",
    "%2e%2e%2f.csv",
    "=1+1.csv",
]


@pytest.mark.nightly
def test_a_name_has_no_say_in_where_a_file_goes(server, tmp_path):
    table = make_csv(tmp_path / "mine.csv").read_bytes()
    before = {path for path in server.folder.parent.rglob("*") if path.parent != server.folder}

    async def dropped(name):
        tab = await Tab.open(server)
        await tab.drop(tab.of("FileDropper")[0], name=name, data=table, chunk=1, total_chunks=1, type="text/csv")
        said = await tab.hear("rows", 90)
        await tab.close()
        return said

    for name in chosen(NAMES, 1):
        said = waited(dropped(name))
        assert "<img" not in said
        assert len(said) < 20_000
    new = {path for path in server.folder.parent.rglob("*") if path.is_file()} - before
    own = [path.relative_to(server.folder).parts for path in new if path.is_relative_to(server.folder)]
    assert all(re.fullmatch(r"[0-9a-f]{16}|fits|secret\.txt", first) for first, *_ in own)
    stored = re.compile(r"(measurements|raw)_[0-9a-f]{16}\.\w+|state\.json")
    kept = [parts for parts in own if len(parts) == 2 and parts[0] != "fits"]
    assert all(stored.fullmatch(name) for _, name in kept)
    assert {p.name for p in new if not p.is_relative_to(server.folder)} <= {"server.log"}


@pytest.mark.nightly
def test_a_file_that_is_larger_than_the_page_takes_is_refused_with_the_limit_and_forgotten(server):
    async def dropped():
        tab = await Tab.open(server)
        place, piece = tab.of("FileDropper")[0], b"1" * 10_000_000
        # Pieces without a beginning, twice the same, and of another file in between: no file comes of them.
        for name, chunk in (("a", 2), ("a", 1), ("a", 1), ("b", 2), ("a", -1), ("a", 10**9)):
            await tab.drop(place, name=name, data=b"sample", chunk=chunk, total_chunks=2, type="text/csv")
        before = server.memory
        for chunk in range(1, 21):
            await tab.drop(place, name="big.csv", data=piece, chunk=chunk, total_chunks=100, type="text/csv")
        said = await tab.hear("more than the page takes", 90)
        await tab.close()
        # What the socket still holds of the rest is read first, and goes.
        for _ in range(60):
            if (grown := server.memory - before) < 150:
                break
            await asyncio.sleep(0.5)
        return said, grown

    said, grown = waited(dropped())
    assert "64 MB" in said
    # Of 200 MB not even the 67 until the limit is passed, in pieces and whole.
    assert grown < 150
    assert not [p for p in server.folder.rglob("measurements_*") if p.stat().st_size > 2**20]
