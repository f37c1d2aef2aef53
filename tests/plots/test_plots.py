"""Pictures say what they show: rows drawn, ranges dashed, scales symmetric, files whole."""

import numpy as np
import pandas as pd
import pytest

from freelearn.plots.canvas import save, to_rgb
from freelearn.plots.curves import curves
from freelearn.plots.parity import parity
from freelearn.plots.residual_map import residual_map
from freelearn.plots.states import pick_states


@pytest.fixture
def predictions() -> pd.DataFrame:
    """Two samples, 12 states of five pressures each; predictions off by 1 N everywhere and by 9 N at one state."""
    rows = [(s, e, t, p) for s in (3, 6) for e in (-1.0, 0.0, 1.0) for t in (-10.0, 10.0) for p in range(5)]
    table = pd.DataFrame(rows, columns=["sample", "elongation_mm", "twist_deg", "pressure_kpa"])
    table["force_n"] = table["pressure_kpa"] * 2.0 - 3
    table["moment_nmm"] = table["pressure_kpa"] * 10.0
    worst = (table["sample"] == 6) & (table["elongation_mm"] == 1) & (table["twist_deg"] == 10)
    table["force_pred_n"] = table["force_n"] + np.where(worst, 9.0, 1.0)
    table["moment_pred_nmm"] = table["moment_nmm"]
    return table.assign(buckled=0, status="ok", split="train")


def test_parity_draws_every_usable_row(predictions):
    predictions.loc[0, "buckled"] = 1
    predictions.loc[1, "status"] = "no_equilibrium"
    predictions.loc[2, "split"] = "test"
    figure = parity(predictions, "title", simulated=True)
    counts = {line.get_label(): len(line.get_xdata()) for line in figure.axes[0].lines}
    assert counts == {"train": 57, "test": 1, "perfect": 2}
    assert "N" in figure.axes[0].get_xlabel()
    assert "N·mm" in figure.axes[1].get_xlabel()
    assert "simulated" in figure.get_suptitle()
    assert "simulated" not in parity(predictions, "title", simulated=False).get_suptitle()


def test_curves_dash_what_is_extrapolated_and_join(predictions):
    pressure = np.linspace(0, 8, 17)
    curve = pd.DataFrame({"pressure_kpa": pressure, "force_pred_n": pressure, "moment_pred_nmm": pressure**2})
    curve["extrapolated"] = (pressure < 2) | (pressure > 4)
    measured = predictions[:5]
    figure = curves(measured, {"continuum": curve}, "title", simulated=False)
    axes = figure.axes[0]
    solid = next(line for line in axes.lines if line.get_label() == "continuum")
    inside = solid.get_xdata()[~np.isnan(solid.get_xdata())]
    assert (inside.min(), inside.max()) == (2, 4)
    dashed = [line.get_xdata() for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata())]
    assert sorted((float(x.min()), float(x.max())) for x in dashed) == [(0, 2), (4, 8)]
    assert all("[" in a.get_xlabel() and "[" in a.get_ylabel() for a in figure.axes)


def test_residual_map_scales_are_symmetric_and_show_the_worst(predictions):
    figure = residual_map(predictions, "title", simulated=True)
    scatters = [a.collections[0] for a in figure.axes if a.collections and a.get_title()]
    assert len(scatters) == 4
    for scatter in scatters:
        low, high = scatter.get_clim()
        assert low == -high
    # Measured minus predicted: −9 N at the planted state of sample 6.
    assert scatters[2].get_array().min() == pytest.approx(-9) or scatters[1].get_array().min() == pytest.approx(-9)


def test_the_worst_state_is_picked_last(predictions):
    assert pick_states(predictions)[-1] == (6, 1.0, 10.0)
    assert pick_states(predictions.assign(buckled=1)) == []


def test_files_are_whole(predictions, tmp_path):
    figure = parity(predictions, "title", simulated=True)
    image = to_rgb(figure)
    assert image.ndim == 3
    assert image.dtype == np.uint8
    assert image.std() > 5
    save(figure, predictions, tmp_path / "parity.png")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["parity.csv", "parity.png"]
    assert len(pd.read_csv(tmp_path / "parity.csv")) == len(predictions)
