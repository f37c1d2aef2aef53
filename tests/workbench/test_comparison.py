"""The curves of two runs beside each other, against the numbers of their files."""

from dataclasses import replace

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

from freelearn.workbench.panels.comparison import FIRST, NOW, Comparison

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")
EFFECTS = ("pressure_gain",)


@pytest.fixture
def two_runs(sessions):
    """A session whose first fit was compared with three samples, and whose search saw the last of them alone."""
    session = sessions.get("")[1]
    table = pd.concat([folders.grid(sample) for sample in (1, 2, 3)], ignore_index=True)
    table = folders.shown(folders.continuum({"pressure_gain": {"gain": 0.1}}), table)
    folders.folder_of(session.folder / "train_first", folders.continuum(), table)
    search, found = session.folder / "discover_later", folders.continuum({"pressure_gain": {"gain": 0.1}})
    folders.folder_of(search, found, table[table["sample"] == 3].reset_index(drop=True))
    (search / "predictions.csv").rename(search / "predictions_after.csv")
    (search / "results.json").rename(search / "discovery.json")
    asked = session.question
    session.runs = [
        {"folder": "train_first", "question": asked},
        {"folder": "discover_later", "question": replace(asked, effects=EFFECTS)},
    ]
    return session


def at_measured(page, name, pressures):
    """What the drawn line shows at measured pressures."""
    line = page.curves.lines[name].data
    pressure, force = np.array(line["pressure_kpa"]), np.array(line["force_pred_n"])
    nearest = np.abs(pressure[None] - np.asarray(pressures)[:, None]).argmin(axis=1)
    np.testing.assert_allclose(pressure[nearest], pressures, atol=1e-9)
    return force[nearest]


def test_what_is_drawn_of_the_first_fit_after_a_search_is_what_its_file_says(two_runs):
    page = Comparison(two_runs)
    page.refresh()
    files = {
        FIRST: pd.read_csv(two_runs.folder / "train_first" / "predictions.csv"),
        NOW: pd.read_csv(two_runs.folder / "discover_later" / "predictions_after.csv"),
    }
    assert len(files[FIRST]) == 3 * len(files[NOW])
    assert len(page.labels) == 12
    for number, curve in enumerate(page.labels):
        page.slider.value = number
        place = page.now.place.loc[curve]
        for name, table in files.items():
            there = (table["sample"] == 3) & (table[folders.PLACE] == place[folders.PLACE]).all(axis=1)
            rows = table[there & (table["status"] == "ok")]
            drawn = at_measured(page, name, rows["pressure_kpa"])
            np.testing.assert_allclose(drawn, rows["force_pred_n"], rtol=1e-6, atol=1e-6)


def test_a_newer_run_leaves_the_slider_at_its_place(two_runs):
    later = two_runs.runs.pop()
    page = Comparison(two_runs)
    page.refresh()
    page.sample.value = 3
    page.slider.value = 7
    title = page.slider.title
    two_runs.runs.append(later)
    page.refresh()
    assert (page.slider.value, page.slider.title) == (7, title)
    # The same number is another place in the search's table.
    assert len(page.first.place) == 3 * len(page.now.place)
