"""What several tests need: the shared measurements, and random states of the paper's samples."""

import json
import os
import time
from pathlib import Path

import pytest
import torch

from freelearn.measurements.states import States
from freelearn.testing.tables import random_table

ROOT = Path(__file__).resolve().parents[1]
torch.set_num_threads(1)
# Several workers share the cores already.
os.environ.setdefault("FREELEARN_CORES", "1")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    folder = Path(os.environ.get("FREELEARN_SHARED_DATA", ROOT.parent / "shared/data"))
    if not folder.is_dir():
        pytest.skip(f"the shared measurements are not at {folder} (set FREELEARN_SHARED_DATA)")
    return folder


@pytest.fixture
def random_states():
    def make(count: int, seed: int = 0) -> States:
        return States.from_table(random_table(count, seed))

    return make


# --- the longest tests begin first, so that no worker is left alone with one at the end -----------------------------

DURATIONS = Path(__file__).with_name("durations.json")
# Shorter tests are in nobody's way [s].
LONG = 1.0


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--record-durations", action="store_true", help=f"write {DURATIONS.name} anew")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    seconds = json.loads(DURATIONS.read_text()) if DURATIONS.exists() else {}
    # Tests of one module stay together: their fixtures are shared.
    of_module: dict[str, float] = {}
    for name, value in seconds.items():
        module = name.split("::")[0]
        of_module[module] = of_module.get(module, 0.0) + value
    items.sort(key=lambda item: -of_module.get(item.nodeid.split("::")[0], 0.0))


class _Durations:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration

    def pytest_sessionfinish(self) -> None:
        long = {name: round(value, 1) for name, value in sorted(self.seconds.items()) if value >= LONG}
        DURATIONS.write_text(json.dumps(long, indent=1) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    # Workers report to the one that started them, which alone writes.
    if config.getoption("--record-durations") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Durations())


@pytest.fixture
def sessions(tmp_path):
    """A work folder's sessions."""
    # Here, not above: the page is imported by its own tests alone.
    from freelearn.workbench.sessions import Sessions

    sessions = Sessions(tmp_path / "work")
    yield sessions
    sessions.close()


@pytest.fixture
def finish():
    """Waits until a session has nothing left to do."""

    def wait(session, seconds=90):
        end = time.monotonic() + seconds
        while session.busy and time.monotonic() < end:
            session.poll()
            time.sleep(0.05)
        assert not session.busy

    return wait


@pytest.fixture(scope="module")
def browser():
    """Chromium, without a window."""
    # Here, as above.
    from chromium import FLAGS, PATH
    from playwright.sync_api import sync_playwright

    if not Path(PATH).exists():
        pytest.skip(f"needs Debian's chromium at {PATH}")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=PATH, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def attacked_page(tmp_path_factory):
    """The page in a process of its own, with a file beside its sessions that is nobody's."""
    # Here, not above, as above.
    from attack_page import SECRET, serving

    with serving(tmp_path_factory.mktemp("attacked")) as server:
        server.folder.mkdir(exist_ok=True)
        (server.folder / "secret.txt").write_text(SECRET)
        yield server


@pytest.fixture
def server(attacked_page):
    """That page. No attack leaves a traceback in its log, nor a long line or anything that a terminal obeys."""
    yield attacked_page
    assert "Traceback" not in attacked_page.log
    assert all(len(line) < 400 and line.isprintable() for line in attacked_page.log.splitlines())
