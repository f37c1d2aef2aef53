"""A work folder's sessions, and waiting until one has nothing left to do."""

import time

import pytest

from freelearn.workbench.sessions import Sessions


@pytest.fixture
def sessions(tmp_path):
    sessions = Sessions(tmp_path / "work")
    yield sessions
    sessions.close()


@pytest.fixture
def finish():
    def wait(session, seconds=90):
        end = time.monotonic() + seconds
        while session.busy and time.monotonic() < end:
            session.poll()
            time.sleep(0.05)
        assert not session.busy

    return wait
