"""The page's server in a process of its own, raw requests to it, and a tab without a browser."""

import asyncio
import json
import os
import re
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

SECRET = "kept by the page alone"
ROOT = Path(__file__).parents[2]
BYTES = {"type": "bytes", "data": {"id": "b0"}}


class Server:
    """The running page. folder: of its sessions. log: everything that it has printed."""

    def __init__(self, process, port, folder, log):
        self.process, self.port, self.folder, self.log_file = process, port, folder, log

    @property
    def log(self):
        return self.log_file.read_text(errors="replace")

    @property
    def memory(self):
        """Resident memory [MB] of the page's own process; its jobs have theirs."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024

    def raw(self, data, wait=20.0, until=b"\r\n\r\n"):
        """What comes back for these bytes, up to the end of the head; "" where the connection is closed or reset."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=wait) as connection:
            answer = b""
            try:
                connection.sendall(data)
                while until not in answer and (part := connection.recv(65536)):
                    answer += part
            except ConnectionError:
                pass
            return answer

    def get(self, path, *headers, method="GET", host=None):
        """Status and body of a request."""
        head, body = self._exchanged(path, *headers, method=method, host=host)
        return int(head.split()[1]), body

    def begun(self):
        """The id of a new session, as the page's bare address leads to it."""
        head, _ = self._exchanged("/")
        assert head.startswith("HTTP/1.1 302"), head
        return re.search(r"(?mi)^location: /\?session=([0-9a-f]{16})\r?$", head).group(1)

    def _exchanged(self, path, *headers, method="GET", host=None):
        """Head and body of the answer."""
        host = host or f"localhost:{self.port}"
        lines = [f"{method} {path} HTTP/1.1", f"Host: {host}", *headers, "Connection: close"]
        with socket.create_connection(("127.0.0.1", self.port), timeout=30) as connection:
            connection.sendall("\r\n".join([*lines, "", ""]).encode("latin-1"))
            parts = []
            while part := connection.recv(65536):
                parts.append(part)
        head, _, body = b"".join(parts).partition(b"\r\n\r\n")
        return head.decode("latin-1"), body.decode(errors="replace")

    def token(self, session=""):
        """What a tab needs to open its socket."""
        _, body = self.get(f"/?session={session or self.begun()}")
        return re.search(r'"token":"([^"]+)"', body).group(1)


@contextmanager
def serving(folder):
    """The page on a free port, with its sessions under `folder`/sessions."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "freelearn.workbench", "--no-browser", "--port", str(port)]
    command += ["--folder", str(folder / "sessions"), "--sweeps", str(folder)]
    log = folder / "server.log"
    with open(log, "w") as out:
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=out, stderr=subprocess.STDOUT, env=os.environ | {"OMP_NUM_THREADS": "1"}
        )
        try:
            for _ in range(1200):
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except OSError:
                    assert process.poll() is None, log.read_text()
                    time.sleep(0.1)
            yield Server(process, port, folder / "sessions", log)
        finally:
            process.terminate()
            process.wait(60)


class Tab:
    """One tab: what Bokeh's client would know and send."""

    def __init__(self, connection):
        self.connection, self.models, self.heard = connection, {}, []

    @classmethod
    async def open(cls, server, session=""):
        tab = cls(await socket_of(server, await asyncio.to_thread(server.token, session)))
        await tab.hear('"ACK"')
        await tab.send("PULL-DOC-REQ", {})
        document = await tab.hear('"roots"')
        tab._learn(json.loads(document))
        return tab

    def _learn(self, part):
        """Every model in a part of the document, by its id."""
        if isinstance(part, dict):
            if "id" in part and "attributes" in part:
                self.models[part["id"]] = part
            for value in part.values():
                self._learn(value)
        elif isinstance(part, list):
            for value in part:
                self._learn(value)

    async def send(self, kind, content, *buffers):
        """buffers: bytes that the content names by "b0", "b1", …"""
        more = [part for n, data in enumerate(buffers) for part in (json.dumps({"id": f"b{n}"}), data)]
        for fragment in [*message(kind, content, num_buffers=len(buffers)), *more]:
            await self.connection.write_message(fragment, binary=isinstance(fragment, bytes))

    async def hear(self, text, seconds=60):
        """The first message from now on in which a text stands."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                part = await asyncio.wait_for(self.connection.read_message(), left)
            except asyncio.TimeoutError:
                break
            if part is None:
                raise ConnectionError(self.connection.close_reason)
            part = part if isinstance(part, str) else ""
            if text in part:
                return part
        raise TimeoutError(f"the page did not say {text!r}")

    def find(self, **attributes):
        """The id of the only model with these attributes."""
        (found,) = (
            name
            for name, model in self.models.items()
            if all(model["attributes"].get(key) == value for key, value in attributes.items())
        )
        return found

    def of(self, kind):
        """The ids of the models of a kind, in their order on the page."""
        return [name for name, model in self.models.items() if model["name"].split(".")[-1] == kind]

    async def patch(self, event, *buffers):
        await self.send("PATCH-DOC", {"events": [event]}, *buffers)

    async def change(self, model, attribute, value):
        await self.patch({"kind": "ModelChanged", "model": {"id": model}, "attr": attribute, "new": value})

    async def event(self, name, model, *entries, buffers=()):
        values = {"type": "map", "entries": [["model", {"id": model}], *entries]}
        data = {"type": "event", "name": name, "values": values}
        await self.patch({"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": data}, *buffers)

    async def click(self, label):
        await self.event("button_click", self.find(label=label))

    async def drop(self, model, **about):
        """A piece of a file, dropped on one of the places for that."""
        buffers = [value for value in about.values() if isinstance(value, bytes)]
        shown = {key: BYTES if isinstance(value, bytes) else value for key, value in about.items()}
        entries = {"type": "map", "entries": [[key, value] for key, value in shown.items()]}
        await self.event("upload_event", model, ["data", entries], buffers=buffers)

    async def close(self):
        await end(self.connection)


async def socket_of(server, token, origin=None, host=None):
    """The page's socket, opened with a token. Raises where that is refused."""
    headers = {key: value for key, value in (("Origin", origin), ("Host", host)) if value}
    request = HTTPRequest(f"ws://127.0.0.1:{server.port}/ws", headers=headers, request_timeout=30)
    return await websocket_connect(request, subprotocols=["bokeh", token], max_message_size=2**26)


def waited(coroutine):
    """What it gives. In a thread of its own: where a browser is driven there is a loop already."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, coroutine).result()


async def end(connection):
    """Closes a socket, and waits until that has been answered."""
    connection.close()
    while await asyncio.wait_for(connection.read_message(), 30) is not None:
        pass


def message(kind, content, **header):
    """The fragments of a message of Bokeh's."""
    return [json.dumps({"msgid": "1", "msgtype": kind} | header), "{}", json.dumps(content)]


async def usable(server, session=""):
    """Whether a fresh tab answers to what is chosen in it."""
    tab = await Tab.open(server, session)
    await tab.change(tab.find(title="data"), "value", "hidden")
    said = await tab.hear('"visible"')
    await tab.close()
    return "hidden" in said or "visible" in said
