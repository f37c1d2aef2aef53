"""What several tests need: the shared measurements, and random states of the paper's samples."""

import gc
import json
import os
import time
from pathlib import Path

import pytest
import torch
from nightly import EVERY

from freelearn.data.states import States
from freelearn.testing.small_tables import random_table

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


# --- what runs, and in which order -----------------------------------------------------------------------------------

# Seconds of each file of tests on a worker, fixtures included: `make durations` writes it.
DURATIONS = Path(__file__).with_name("durations.json")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--record-durations", action="store_true", help=f"write what was run into {DURATIONS.name}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out what is marked nightly where not everything is asked for, and puts the longest files first.

    With --dist loadfile a worker takes one file after another, so that none is left with a long one at the end."""
    if not EVERY:
        out = [item for item in items if item.get_closest_marker("nightly")]
        config.hook.pytest_deselected(items=out)
        items[:] = [item for item in items if not item.get_closest_marker("nightly")]
    seconds = json.loads(DURATIONS.read_text()) if DURATIONS.exists() else {}
    items.sort(key=lambda item: -seconds.get(item.nodeid.split("::")[0], 0.0))


def pytest_collection_finish() -> None:
    """What is imported and collected by now stays: else Python goes through all of it, most of a second, each time that
    it looks for garbage, which took a fifteenth of the tests' time; and it looks more rarely, which takes a twentieth
    off what makes many objects."""
    gc.freeze()
    gc.set_threshold(20_000, 50, 100)


class _Durations:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        file = report.nodeid.split("::")[0]
        self.seconds[file] = self.seconds.get(file, 0.0) + report.duration

    def pytest_sessionfinish(self) -> None:
        known = json.loads(DURATIONS.read_text()) if DURATIONS.exists() else {}
        known |= {file: round(value, 1) for file, value in self.seconds.items()}
        # Shorter files are in nobody's way, and those that are gone in nobody's list.
        kept = {file: value for file, value in sorted(known.items()) if value >= 0.5 and (ROOT / file).exists()}
        DURATIONS.write_text(json.dumps(kept, indent=1) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    # Workers report to the one that started them, which alone writes.
    if config.getoption("--record-durations") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Durations())


@pytest.fixture(scope="session")
def commands(tmp_path_factory):
    """Commands in processes of their own that import nothing anew."""
    from forked_commands import Commands

    with Commands(tmp_path_factory.mktemp("commands")) as commands:
        yield commands


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """A run and its functions, which several tests export: tracing and asking them takes the most time."""
    # Here, not above: exports are imported by their own tests alone.
    from exported import linear

    from freelearn.export.actuator import Actuator
    from freelearn.export.actuator_functions import Functions

    fitted = linear(tmp_path_factory.mktemp("once") / "run")
    return fitted, Functions(Actuator.from_fitted(fitted))


@pytest.fixture
def traced(once):
    """That run, with whose functions an export begins."""
    from exported import already

    fitted, functions = once
    with already(functions):
        yield fitted


@pytest.fixture
def sessions(tmp_path):
    """A work folder's sessions."""
    # Here, not above: the page is imported by its own tests alone.
    from freelearn.workbench.state.job import warm_up
    from freelearn.workbench.state.session import Sessions

    # As the page's server does it: jobs are forked from one process that has imported everything.
    warm_up()
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
