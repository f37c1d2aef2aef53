"""Which effects the page offers before a search: those that the rows can tell of."""

import re
from html import unescape

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

from freelearn.physics.effects.registry import EFFECTS
from freelearn.workbench.panels.effects_panel import ONLY_LOGS, Effects

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")
HISTORY = {name for name, effect in EFFECTS.items() if effect.port == "history"}
BRAIDS = {"bladder_slack", "strand_jamming"}


def offered(session, table):
    """The tab's boxes, and why there are no others, after a fit of this table."""
    shown = folders.shown(folders.continuum(), table)
    folders.folder_of(session.folder / "train_only", folders.continuum(), shown)
    session.runs = [{"folder": "train_only", "question": session.question}]
    page = Effects(session)
    page.refresh()
    return page, unescape(page.reasons.object)


def log():
    """Five recordings of pressure up and down, each at a place of its own."""
    pressure = np.concatenate([np.linspace(0, 60, 12), np.linspace(60, 0, 12)])
    places = zip((-3.0, 0.0, 3.0, -1.5, 2.0), (0.0, 60.0, -60.0, 30.0, -20.0), strict=True)
    parts = [
        pd.DataFrame({"elongation_mm": place[0], "twist_deg": place[1], "run": run, "pressure_kpa": pressure})
        for run, place in enumerate(places, 1)
    ]
    time = np.tile(np.arange(24) / 4, 5)
    return pd.concat(parts, ignore_index=True).assign(**folders.design(3), buckled=0, step=0, time_s=time)


def test_what_only_logs_tell_is_not_offered_for_a_table_without_time_and_the_reason_stands_there_once(sessions):
    page, reasons = offered(sessions.get("")[1], folders.grid())
    names = set(page.boxes.options.values())
    assert {"creep", "sensor_lag", "dead_time"} <= HISTORY
    assert not names & HISTORY
    assert not names & BRAIDS
    assert {"length_compliance", "fiber_misalignment", "wall_stiffening"} <= names
    assert not set(page.absent.options) & HISTORY
    assert reasons.count(ONLY_LOGS) == 1
    assert all(name in reasons for name in HISTORY | BRAIDS)
    assert page.untold.visible


def test_along_a_log_they_are(sessions):
    page, reasons = offered(sessions.get("")[1], log())
    assert {"creep", "sensor_lag", "dead_time", "maxwell_slip"} <= set(page.boxes.options.values())
    assert ONLY_LOGS not in reasons


def test_what_is_in_the_model_already_can_still_be_taken_out(sessions):
    session = sessions.get("")[1]
    session.choose(effects=("creep",), ruled_out=("strand_jamming",))
    page, reasons = offered(session, folders.grid())
    assert page.boxes.value == ["creep"]
    assert page.absent.value == ["strand_jamming"]
    assert not re.search(r"\bcreep\b", reasons)
