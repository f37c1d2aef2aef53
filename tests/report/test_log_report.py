"""A log in a report and in TensorBoard: a recording and spectra in the place of curves at kinematic states."""

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

from freelearn.data.accuracy import PAPER
from freelearn.queries.curves.log_spectra import log_spectra
from freelearn.report.html.run_charts import chart_sections
from freelearn.report.plots.log_plots import recording_figure


@pytest.fixture(scope="module")
def own():
    """Two recordings, the second predicted worse, and the model."""
    time = np.arange(1500) / 50
    parts = [
        pd.DataFrame(
            {"run": f"r{run}", "elongation_mm": float(run), "pressure_kpa": 30 - 30 * np.cos(time), "time_s": time}
        )
        for run in (1, 2)
    ]
    table = pd.concat(parts, ignore_index=True).assign(**folders.design(3), twist_deg=0.0, buckled=0, step=0)
    table = folders.shown(folders.continuum(), table)
    table = table.assign(force_pred_n=table["force_n"], moment_pred_nmm=table["moment_nmm"], status="ok", split="train")
    table["force_n"] += np.where(table["run"] == "r2", 1.0, 0.1) * np.sin(3 * table["time_s"])
    return table


def test_a_report_shows_the_worst_recording_its_loops_and_what_is_left(own):
    spectra = log_spectra(folders.continuum(), own, PAPER)
    sections = chart_sections(own, [], spectra)
    headings = [section.heading for section in sections]
    assert headings[:2] == [
        "Along the recording that is predicted worst: sample 3, run r2", "What is left, by its frequency",
    ]  # fmt: skip
    titles = [chart.title.text for chart in sections[0].charts]
    assert titles[:3] == ["pressure", "force", "moment"]
    assert [title.split(",")[0] for title in titles[3:]] == ["F–P", "M–P"]
    assert "of 1,500 samples" in sections[0].lines[-1]
    numbers = sections[1].numbers["spectra.csv"]
    force = numbers[numbers["quantity"] == "force"]
    assert force["frequency_hz"].iloc[force["density"].argmax()] == pytest.approx(3 / (2 * np.pi), abs=0.15)
    # Where no recording is long enough there are none.
    assert len(chart_sections(own, [], [])) == len(sections) - 1


def test_the_picture_for_tensorboard_has_a_panel_for_each(own):
    spectra = log_spectra(folders.continuum(), own, PAPER)
    figure = recording_figure(own, spectra, "continuum fitted on all", simulated=True)
    labels = [axes.get_ylabel() for axes in figure.axes if axes.axison]
    for label in ("pressure P [kPa]", "force F [N]", "moment M [N·mm]", "power density [N²/Hz]"):
        assert label in labels
    assert "simulated data" in figure.get_suptitle()
    assert "run r2" in figure.get_suptitle()
