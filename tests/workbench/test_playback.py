"""A log on the page: a recording over time with a window, loops, spectra; without a browser."""

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

from freelearn.workbench.panels.comparison import FIRST, NOW, Comparison

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


def log(runs=5, count=2000, rate=100.0):
    time = np.arange(count) / rate
    parts = [
        pd.DataFrame(
            {"run": run, "elongation_mm": run - 3.0, "pressure_kpa": 30 - 30 * np.cos(time + run), "time_s": time}
        )
        for run in range(1, runs + 1)
    ]
    table = pd.concat(parts, ignore_index=True)
    return table.assign(**folders.design(3), twist_deg=0.0, buckled=0, step=0)


@pytest.fixture
def page(sessions):
    """Two fits of one log: the first knows no gain."""
    session = sessions.get("")[1]
    true = folders.continuum({"pressure_gain": {"gain": 0.1}})
    table = folders.shown(true, log())
    folders.folder_of(session.folder / "train_first", folders.continuum(), table)
    folders.folder_of(session.folder / "train_now", true, table)
    session.runs = [{"folder": name, "question": session.question} for name in ("train_first", "train_now")]
    page = Comparison(session)
    page.refresh()
    return page


def test_a_recording_stands_in_the_place_of_curves_with_the_numbers_of_the_files(page):
    playback = page.playback
    assert playback.view.visible
    assert not page.curve_group.visible
    assert page.slider.title.startswith("recording (run ")
    page.slider.value = 1
    assert page.slider.title.startswith("recording (run 2")
    for name, folder in ((FIRST, "train_first"), (NOW, "train_now")):
        table = pd.read_csv(page.session.folder / folder / "predictions.csv")
        own = table[table["run"] == 2].set_index("time_s")
        shown = playback.drawn.predicted[name]["force_n"].data
        assert shown["y"] == own["force_pred_n"].loc[shown["x"]].tolist()
        assert max(shown["y"]) == own["force_pred_n"].max()
    measured = playback.drawn.readings["moment_nmm"].data
    assert measured["y"] == own["moment_nmm"].loc[measured["x"]].tolist()
    # Of 2,000 samples the least and the greatest of each stretch.
    assert len(measured["x"]) <= 1202
    assert "of 2,000 samples" in playback.told.object


def test_a_narrower_window_shows_its_samples_all(page):
    playback = page.playback
    playback.drawn.time.update(start=3.0, end=4.0)
    playback._settle()
    shown = playback.drawn.readings["force_n"].data["x"]
    assert shown == pytest.approx(np.arange(299, 401) / 100)
    assert "Drawn" not in playback.told.object
    # Another recording begins whole again.
    page.slider.value = 4
    assert (playback.drawn.time.start, playback.drawn.time.end) == (0.0, 19.99)
    assert playback.window.value == (0.0, 19.99)


def test_the_loops_of_the_recording_are_thick_and_the_others_thin(page):
    segments = page.playback.drawn.segments["force_n"].data
    wide, thin = max(segments["wide"]), min(segments["wide"])
    thick = [n for n, width in enumerate(segments["wide"]) if width == wide]
    assert wide > thin
    # They lie on the others.
    assert thick == list(range(thick[0], len(segments["wide"])))
    table = page.playback.rows
    assert {segments["y0"][n] for n in thick} <= set(table["force_n"])


def test_a_fit_that_saw_fewer_rows_is_drawn_where_it_has_any(page, sessions):
    folder = page.session.folder / "train_first"
    rows = pd.read_csv(folder / "predictions.csv")
    rows[rows.index % 10 == 0].to_csv(folder / "predictions.csv", index=False)
    (folder / "results.json").touch()
    again = Comparison(page.session)
    again.refresh()
    assert len(again.playback.drawn.predicted[FIRST]["force_n"].data["x"]) == 200
    assert len(again.playback.drawn.predicted[NOW]["force_n"].data["x"]) >= 1000


def test_spectra_are_of_both_fits(page):
    grid = page.playback.charts.objects[1].objects
    charts = [pane.object for pane in grid if "frequency" in pane.object.title.text]
    assert len(charts) == 2
    assert [item.label.value for item in charts[0].legend[0].items][:2] == [FIRST, NOW]
