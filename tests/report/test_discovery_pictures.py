"""The staircase and the ranking say no more than is known."""

import numpy as np
import pandas as pd
import pytest
from bokeh.models import Scatter

from freelearn.report.html.ranking_charts import StaircaseChart, ranking_chart
from freelearn.report.plots.discovery_plots import ranking, staircase


@pytest.fixture
def trail() -> pd.DataFrame:
    """The last error lies below its noise floor, as it may by chance."""
    steps = ["model alone", "+ fiber_tension_only", "+ length_compliance"]
    error = {"E_heldout": [0.0824, 0.0487, 0.00627], "E_train": [0.08, 0.047, 0.006]}
    floors = {"noise_floor": [0.0076, 0.0073, 0.0065], "sigmas_heldout": [20.0, 12.0, 0.96]}
    return pd.DataFrame({"step": steps, **error, **floors})


@pytest.fixture
def ranked() -> pd.DataFrame:
    """A large effect that chance may give, as in a model that is far off."""
    table = pd.DataFrame({"effect": ["a", "b", "c"], "size": [200.0, 25.0, 0.0], "p_value": [0.001, 0.3, 1.0]})
    return table.assign(E_heldout=[0.1, 0.2, 0.3])


@pytest.mark.parametrize("floor", [0.0065, 0.0060, 0.00627, 0.001])
def test_no_label_of_the_staircase_lies_on_a_line(trail, floor):
    trail.loc[2, "noise_floor"] = floor
    figure = staircase(trail, simulated=True)
    figure.canvas.draw()
    axes = figure.axes[0]
    heights = axes.transData.transform([(0, 100 * value) for value in trail["noise_floor"]])[:, 1]
    frame = axes.get_window_extent()
    for text, height in zip(axes.texts, heights, strict=True):
        box = text.get_window_extent()
        assert not box.y0 <= height <= box.y1
        assert frame.y0 < box.y0
        assert box.y1 < frame.y1


@pytest.mark.parametrize("error", [[0.0824, np.inf, 0.00627], [np.nan, np.nan, np.nan], [0.08, 0.04, 0.0]])
def test_a_step_without_an_error_leaves_a_gap_in_the_staircase(trail, error):
    figure = staircase(trail.assign(E_heldout=error), simulated=True)
    figure.canvas.draw()
    axes = figure.axes[0]
    known = [value for value in error if 0 < value < np.inf]
    assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all()
    assert len(axes.texts) == len(known)
    chart = StaircaseChart()
    chart.show(trail.assign(E_heldout=error))
    assert len(chart.panel.x_range.factors) == 3
    assert np.isfinite([chart.panel.y_range.start, chart.panel.y_range.end]).all()


@pytest.mark.parametrize("count", [1, 3])
def test_what_the_ranking_says_of_its_axis_is_inside_the_picture_and_above_the_legend(ranked, count):
    figure = ranking(ranked[:count], None, simulated=True)
    figure.canvas.draw()
    label, legend = figure.axes[0].xaxis.get_label().get_window_extent(), figure.legends[0].get_window_extent()
    assert 0 <= label.x0 < label.x1 <= figure.bbox.x1
    assert 0 <= legend.y0 < legend.y1 <= label.y0


def test_the_staircase_has_several_numbers_on_its_axis(trail):
    for error in ([0.0824, 0.0487, 0.00627], [0.011, 0.0105, 0.0101]):
        figure = staircase(trail.assign(E_heldout=error, noise_floor=0.009), simulated=True)
        figure.canvas.draw()
        axes = figure.axes[0]
        low, high = axes.get_ylim()
        assert sum(low <= tick <= high for tick in axes.yaxis.get_majorticklocs()) >= 2


def test_the_ranking_draws_no_bar_on_a_logarithmic_axis(ranked):
    figure = ranking(ranked, ranked.assign(size=[0.3, 0.2, 0.1]), simulated=True)
    axes = figure.axes[0]
    assert axes.get_xscale() == "log"
    assert not axes.patches
    assert {type(r.glyph) for r in ranking_chart(ranked).renderers} == {Scatter}
    drawn = {line.get_label(): line.get_xdata() for line in axes.lines}
    open_ones = next(x for label, x in drawn.items() if "rest of the misfit" in label)
    np.testing.assert_allclose(sorted(open_ones), [0.1, 25.0])


def test_a_large_effect_is_not_called_chance(ranked):
    figure = ranking(ranked, None, simulated=True)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["before: stands out, p ≤ 0.01", "before: may be the rest of the misfit"]
