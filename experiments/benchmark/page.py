"""The workbench in a real browser, as a user waits for it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from benchmark.common import ROOT, Report
from playwright.sync_api import Page, sync_playwright

from freelearn.testing.reference.simulated_logs import UNIT, log

CHROMIUM = "/usr/bin/chromium"
MOVES = 100
# From a key on the slider until the curves are those of another state, and drawn.
MOVED = """key => new Promise(told => {
    const every = Bokeh.documents.flatMap(d => [...d._all_models.values()])
    const title = every.find(m => m.type === 'Title' && m.text.startsWith('F–P'))
    const before = title.text, handle = document.querySelector('.bk-Slider')?.shadowRoot?.querySelector('.noUi-handle')
        ?? Bokeh.index.query_one(v => v.model.type === 'Slider').shadow_el.querySelector('.noUi-handle')
    const began = performance.now()
    const look = () => title.text !== before || performance.now() - began > 5000
        ? requestAnimationFrame(() => told(performance.now() - began)) : setTimeout(look, 1)
    handle.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }))
    look()
})"""

# When a page first showed anything [ms].
PAINTED = "() => performance.getEntriesByName('first-contentful-paint')[0].startTime"
# Samples a second of five recordings of 40 s.
LOGS = (114.4, 500.0)
# Milliseconds of each move of a log's cursor until it is drawn: the second frame after it.
CURSOR = """count => new Promise(told => {
    const every = Bokeh.documents.flatMap(d => [...d._all_models.values()])
    const cursor = every.find(m => m.type === 'Slider' && m.title.startsWith('cursor')), took = []
    const go = () => {
        const began = performance.now()
        cursor.value = cursor.start + (cursor.end - cursor.start) * (took.length % 50) / 50
        requestAnimationFrame(() => requestAnimationFrame(() => {
            took.push(performance.now() - began)
            took.length < count ? go() : told(took)
        }))
    }
    go()
})"""
# Milliseconds until another recording is there, and drawn.
RECORDING = """count => new Promise(told => {
    const every = Bokeh.documents.flatMap(d => [...d._all_models.values()])
    const slider = every.find(m => m.type === 'Slider' && m.title.startsWith('recording')), took = []
    const go = () => {
        const began = performance.now(), before = slider.title
        slider.value = (slider.value + 1) % (slider.end + 1)
        const look = () => slider.title !== before || performance.now() - began > 5000
            ? requestAnimationFrame(() => {
                took.push(performance.now() - began)
                took.length < count ? setTimeout(go, 300) : told(took)
            }) : setTimeout(look, 1)
        look()
    }
    go()
})"""


def page(report: Report) -> None:
    """The page opened, and its slider moved, on the paper's whole protocol."""
    if not Path(CHROMIUM).exists():
        report("the page in a browser", "not measured", "", f"needs Debian's chromium at {CHROMIUM}")
        return
    with sync_playwright() as driver, _served() as (address, began):
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page(viewport={"width": 1440, "height": 900})
        tab.set_default_timeout(60_000)
        _first(tab, address)
        report("the page usable, from the command", f"{time.perf_counter() - began:.1f} s", "≤ 3 s")
        again = time.perf_counter()
        _first(tab, address)
        report("  a further tab usable", f"{time.perf_counter() - again:.1f} s", "")
        report("  its first paint", f"{tab.evaluate(PAINTED) / 1e3:.2f} s", "≤ 2 s")
        tab.get_by_role("button", name="Fit", exact=True).click()
        tab.get_by_text("Fitting: done").wait_for()
        moves = np.array(_moves(tab))
        slow = np.quantile(moves, 0.95)
        detail = f"median {np.median(moves):.0f} ms, {100 * np.mean(moves <= 50):.0f} % within 50 ms, {MOVES} moves"
        report("slider to new curve, 22,880 rows, 95 % of moves", f"{slow:.0f} ms", "≤ 50 ms", detail)
        browser.close()


def playback(report: Report) -> None:
    """A log on the page: a move of its cursor, and another recording, of few samples and of many."""
    if not Path(CHROMIUM).exists():
        report("a log in a browser", "not measured", "", f"needs Debian's chromium at {CHROMIUM}")
        return
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver, _served() as (address, _):
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        for rate in LOGS:
            table = log({"creep": UNIT["creep"]}, 0, recordings=5, rate=rate, seconds=40.0)
            path = Path(folder) / f"log_{len(table)}.csv"
            table.to_csv(path, index=False)
            tab = browser.new_page(viewport={"width": 1440, "height": 900})
            tab.set_default_timeout(300_000)
            _first(tab, address)
            tab.get_by_label("data", exact=True).select_option(label="my own file")
            tab.locator("input[type=file]").first.set_input_files(path)
            tab.get_by_text(f"{path.name}: {len(table)} rows").wait_for()
            tab.get_by_role("button", name="Fit", exact=True).click()
            tab.get_by_label("cursor at time t").wait_for()
            tab.wait_for_timeout(3000)
            moves = np.array(tab.evaluate(CURSOR, MOVES))
            detail = f"median {np.median(moves):.0f} ms, of which 33 ms are two frames without a move"
            report(
                f"cursor of a log, {len(table)} samples, 95 % of moves",
                f"{np.quantile(moves, 0.95):.0f} ms",
                "≤ 50 ms",
                detail,
            )
            report("  another recording", f"{np.median(tab.evaluate(RECORDING, 20)):.0f} ms", "")
            tab.close()
        browser.close()


def _first(tab: Page, address: str) -> None:
    """A fresh tab, until its button can be pressed."""
    tab.goto(address)
    tab.get_by_role("button", name="Fit", exact=True).wait_for()


def _moves(tab: Page) -> list[float]:
    """Milliseconds of each move; there and back, so that the ends are not reached."""
    tab.wait_for_function("() => Bokeh.index.query_one(v => v.model.type === 'Slider') !== null")
    keys = ["ArrowRight"] * 10 + ["ArrowLeft"] * 10
    # Not from where it stands: the worst state may be the last.
    for key in ("Home", *["ArrowRight"] * 3):
        tab.wait_for_timeout(500)
        tab.evaluate(MOVED, key)
    moves = []
    for number in range(MOVES):
        moves.append(float(tab.evaluate(MOVED, keys[number % len(keys)])))
        tab.wait_for_timeout(50)
    return moves


@contextmanager
def _served() -> Iterator[tuple[str, float]]:
    """The page's address, and when its command was given."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "freelearn.workbench", "--no-browser", "--port", str(port), "--folder", folder]
        began = time.perf_counter()
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, env=os.environ) as server:
            try:
                _answering(server, port)
                yield f"http://localhost:{port}", began
            finally:
                server.terminate()


def _answering(server: subprocess.Popen[bytes], port: int) -> None:
    while server.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            return
        except OSError:
            time.sleep(0.02)
    raise RuntimeError("the page does not start")
