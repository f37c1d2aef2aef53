"""Heat maps: a number in every cell, every model, one scale that one bad model does not spoil."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb

from freelearn.report.html.heatmap_chart import heatmap_chart
from freelearn.report.plots.heatmap_plots import color_scale, heatmap, side_by_side
from freelearn.report.tables.error_map import WORST, cell_text, mean_text

SETS = ("sample1", "sample2", "even", "all")


@pytest.fixture
def cells() -> pd.DataFrame:
    """Six models; the last fails by a factor of a thousand on one set, and was not tested on another."""
    rows = [
        (f"model{k}", a, b, 0.02 * (1 + k) * (1 + i)) for k in range(6) for i, (a, b) in enumerate(product(SETS, SETS))
    ]
    table = pd.DataFrame(rows, columns=["label", "train", "test", "E"])
    table.loc[table.index[-1], "E"] = 1234.0
    table = table.drop(table.index[-2])
    return table.assign(deviation=np.nan, seeds=1, n=100, complete=True, best=False)


def numbers_in(axes) -> list[str]:
    return [text.get_text() for text in axes.texts if text.get_text()]


def test_every_cell_has_its_number_in_ink_that_can_be_read(cells):
    part = cells[cells["label"] == "model5"]
    axes = heatmap(part, "title", color_scale(cells), "simulated data").axes[0]
    assert sorted(numbers_in(axes)) == sorted(cell_text(100 * error) for error in part["E"])
    mesh = axes.collections[0]
    image = np.ma.asarray(mesh.get_array()).reshape(4, 4)
    for text in axes.texts:
        column, row = (round(value) for value in text.get_position())
        if not text.get_text():
            assert np.ma.getmaskarray(image)[row, column]
            continue
        dark, light = sorted(map(luminance, (to_rgb(text.get_color()), mesh.cmap(mesh.norm(image[row, column]))[:3])))
        # What the W3C asks of large text.
        assert (light + 0.05) / (dark + 0.05) >= 3


def luminance(color) -> float:
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in color]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def test_every_model_is_in_the_picture_of_all(cells):
    labels = list(dict.fromkeys(cells["label"]))
    figure = side_by_side(cells, labels, dict.fromkeys(labels, "caption"), "title", color_scale(cells))
    maps = [axes for axes in figure.axes if numbers_in(axes)]
    assert [axes.get_title(loc="left").split("\n")[0] for axes in maps] == labels
    assert [len(numbers_in(axes)) for axes in maps] == [16] * 5 + [15]
    # None lies on another, or outside.
    boxes = [axes.get_position() for axes in maps]
    assert all(0 <= box.x0 < box.x1 <= 1 and 0 <= box.y0 < box.y1 <= 1 for box in boxes)
    pairs = [(a, b) for i, a in enumerate(boxes) for b in boxes[:i]]
    assert not [1 for a, b in pairs if a.overlaps(b)]


def test_gray_tells_small_errors_from_large_ones(cells):
    norm = color_scale(cells)
    part = cells[cells["label"] == "model0"]
    mesh = heatmap(part, "title", norm, "").axes[0].collections[0]
    grays = [luminance(mesh.cmap(norm(error))[:3]) for error in np.geomspace(2, WORST, 12)]
    assert all(np.diff(grays) < -0.005)


def test_one_bad_cell_leaves_the_others_their_colors(cells):
    norm = color_scale(cells)
    assert norm.vmax == WORST
    assert norm(24.0) - norm(2.0) > 0.3


def test_the_median_stands_beside_the_mean(cells):
    part = cells[cells["label"] == "model5"]
    assert mean_text(part).startswith("mean 8")
    assert "median 96.0 %" in mean_text(part)


def test_the_chart_has_the_same_numbers(cells):
    panel = heatmap_chart(cells, "model5")
    sources = [r.data_source for r in panel.renderers]
    shown = [source.data["text"].tolist() for source in sources if "text" in source.data]
    assert cell_text(123400.0) == ">1k"
    assert ">1k" in shown[0]
    assert len(shown[0]) == 15
