"""A run and what is exported of it."""

import pytest
from exported import linear

from freelearn.export import export
from freelearn.export.actuator import Actuator
from freelearn.export.functions import Functions


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """A run and its functions, which several tests export: tracing and asking them takes the most time."""
    fitted = linear(tmp_path_factory.mktemp("once") / "run")
    return fitted, Functions(Actuator.from_fitted(fitted))


@pytest.fixture
def traced(once, monkeypatch):
    """That run, with whose functions an export begins."""
    fitted, functions = once
    monkeypatch.setattr(export, "Functions", lambda actuator: functions)
    return fitted
