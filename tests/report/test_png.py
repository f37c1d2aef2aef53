"""Pictures say what they show: rows drawn, ranges dashed, scales symmetric, files whole."""

import re

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from freelearn.common.errors import UserError
from freelearn.data.beds import KINEMATIC
from freelearn.discovery.residuals.suspects import Suspect
from freelearn.queries.curves.curve_panels import curve_numbers
from freelearn.queries.curves.model_curves import BAND, SHORT
from freelearn.queries.curves.shown_states import pick_states
from freelearn.records.suspected_readings import flagged
from freelearn.report.html.curve_charts import CurveCharts
from freelearn.report.plots.canvas import save, to_rgb
from freelearn.report.plots.curve_plots import curves
from freelearn.report.plots.residual_plots import residual_map
from freelearn.report.plots.simple_plots import parity
from freelearn.report.tables.picture_numbers import SHOWN
from freelearn.report.tables.residual_tables import residual_table, scale_limits

UNIT = re.compile(r"\[(N|N·mm|kPa|mm|°|%|–|share of .*)\]$")


@pytest.fixture
def predictions() -> pd.DataFrame:
    """Two samples, 12 states of five pressures each; predictions off by 1 N everywhere and by 9 N at one state."""
    rows = [(s, e, t, p) for s in (3, 6) for e in (-1.0, 0.0, 1.0) for t in (-10.0, 10.0) for p in range(5)]
    table = pd.DataFrame(rows, columns=["sample", "elongation_mm", "twist_deg", "pressure_kpa"])
    table["step"] = table["pressure_kpa"]
    table["force_n"] = table["pressure_kpa"] * 2.0 - 3
    table["moment_nmm"] = table["pressure_kpa"] * 10.0
    worst = (table["sample"] == 6) & (table["elongation_mm"] == 1) & (table["twist_deg"] == 10)
    table["force_pred_n"] = table["force_n"] + np.where(worst, 9.0, 1.0)
    table["moment_pred_nmm"] = table["moment_nmm"]
    return table.assign(buckled=0, status="ok", split="train")


@pytest.fixture
def curve() -> pd.DataFrame:
    """A model from 0 to 8 kPa, fitted from 2 to 4 kPa."""
    pressure = np.linspace(0, 8, 17)
    curve = pd.DataFrame({"pressure_kpa": pressure, "force_pred_n": pressure, "moment_pred_nmm": pressure**2})
    return curve.assign(extrapolated=(pressure < 2) | (pressure > 4))


def with_band(curve: pd.DataFrame, **half: float) -> pd.DataFrame:
    """The curve with a band of a quantity for each half of one, where it is not extrapolated."""
    for name, off in half.items():
        there = curve[name].where(~curve["extrapolated"])
        curve = curve.assign(**{f"{name}_low": there - off, f"{name}_high": there + off})
    return curve


def filled(axes) -> int:
    """How many bands a panel shows."""
    return sum(isinstance(patch, PathPatch) for patch in axes.patches)


def drawn(figure: Figure, label: str, panel: int = 0) -> int:
    """How many points a panel shows under a name in the legend."""
    return sum(len(line.get_xdata()) for line in figure.axes[panel].lines if line.get_label() == label)


def colored(figure: Figure) -> list:
    """The colored markers of each row of a residual map."""
    return [
        c for axes in figure.axes for c in axes.collections if c.get_array() is not None and len(c.get_offsets()) > 1
    ]


def test_parity_draws_every_usable_row(predictions):
    predictions.loc[0, "buckled"] = 1
    predictions.loc[1, "status"] = "no_equilibrium"
    predictions.loc[2, "split"] = "test"
    predictions["left_out"] = 0
    predictions.loc[3, "left_out"] = 1
    figure = parity(predictions, "title", simulated=True)
    counts = {line.get_label(): len(line.get_xdata()) for line in figure.axes[0].lines}
    assert counts == {"train": 56, "test": 1, "perfect": 2}
    assert "simulated data" in figure.get_suptitle()
    assert "simulated" not in parity(predictions, "title", simulated=False).get_suptitle()


def test_parity_of_many_rows_shows_every_pressure_and_says_how_many(predictions):
    many = pd.concat([predictions] * 300, ignore_index=True)
    first, again = parity(many, "title", simulated=True), parity(many, "title", simulated=True)
    label = f"train ({SHOWN} of {len(many)} shown)"
    assert drawn(first, label) == SHOWN
    # Every sixth of these rows would always be the same step of a few states.
    shown = first.axes[0].lines[0].get_xdata()
    assert set(shown) == set(many["force_n"])
    np.testing.assert_array_equal(shown, again.axes[0].lines[0].get_xdata())


def test_every_axis_has_a_unit(predictions, curve):
    one = predictions[predictions["sample"] == 3]
    for figure in (parity(predictions, "", True), curves(predictions[:5], curve, "", True)):
        for axes in figure.axes:
            assert UNIT.search(axes.get_xlabel())
            assert UNIT.search(axes.get_ylabel())
    for table in (predictions, one):
        labels = {text for a in residual_map(table, "", True).axes for text in (a.get_xlabel(), a.get_ylabel())}
        assert all(UNIT.search(label) for label in labels - {""})
        assert len(labels - {""}) == (4 if table is one else 3)


def beyond(axes) -> list[np.ndarray]:
    """The points of each light line, of what is extrapolated."""
    return [line.get_xydata() for line in axes.lines if line.get_label() == "_beyond"]


def test_curves_are_light_where_they_are_extrapolated_and_join(predictions, curve):
    figure = curves(predictions[:5], {"continuum": curve}, "title", simulated=False)
    for axes in figure.axes:
        line = next(line for line in axes.lines if line.get_label() == "continuum")
        points = [tuple(p) for p in line.get_xydata() if not np.isnan(p).any()]
        light = beyond(axes)
        assert len(light) == 2
        assert tuple(light[0][-1]) == points[0]
        assert tuple(light[1][0]) == points[-1]
    assert [(part[:, 0].min(), part[:, 0].max()) for part in beyond(figure.axes[0])] == [(0, 2), (4, 8)]


def test_curves_are_light_in_a_gap_inside_the_measured_range_and_nowhere_where_all_is_measured(predictions, curve):
    gap = curve.assign(extrapolated=curve["pressure_kpa"].between(3, 5))
    light = beyond(curves(predictions[:5], gap, "", True).axes[1])
    assert [(part[:, 0].min(), part[:, 0].max()) for part in light] == [(2.5, 5.5)]
    none = curves(predictions[:5], curve.assign(extrapolated=False), "", True)
    assert not [part for axes in none.axes for part in beyond(axes)]


def test_marks_belong_to_what_was_measured_and_models_differ_without_color(predictions, curve):
    figure = curves(predictions[:5], dict.fromkeys(("before", "after", "other"), curve), "", simulated=False)
    models = [line for line in figure.axes[0].lines if line.get_label() in ("before", "after", "other")]
    assert {line.get_marker() for line in models} == {"None"}
    assert len({str(line._unscaled_dash_pattern) for line in models}) == 3
    # Two that lie on each other are both seen: the later is the thinner.
    widths = [line.get_linewidth() for line in models]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] > widths[-1]


def test_dashes_are_not_drawn_twice_where_a_model_comes_back_along_its_own_line(predictions, curve):
    up = curve.assign(extrapolated=False)
    back = pd.concat([up, up[::-1]], ignore_index=True)
    lag = back.assign(force_pred_n=back["force_pred_n"] + np.r_[np.zeros(17), np.sin(np.linspace(0, np.pi, 17))])
    for there, drawn_points in ((back, 17), (lag, range(28, 35))):
        figure = curves(predictions[:5], {"one": up, "two": there}, "", simulated=False)
        line = next(line for line in figure.axes[0].lines if line.get_label() == "two")
        count = int(np.isfinite(line.get_xdata()).sum())
        assert count == drawn_points if isinstance(drawn_points, int) else count in drawn_points


def test_curves_draw_any_number_of_models(predictions, curve):
    names = [f"model {number}" for number in range(9)]
    figure = curves(predictions[:5], dict.fromkeys(names, curve), "title", simulated=False)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert set(names) <= set(labels)


def test_squares_are_filled_where_the_pressure_rose(predictions, curve):
    visit = predictions[:5].assign(pressure_kpa=[0.0, 2, 4, 3, 1], buckled=[0, 0, 1, 0, 0])
    figure = curves(visit, curve, "title", simulated=False)
    # The buckled row is not drawn, yet the row after it was reached by a fall from it.
    assert (drawn(figure, "measured, rising"), drawn(figure, "measured, falling")) == (2, 2)
    # A second visit starts below the end of the first: nothing fell.
    twice = pd.concat([predictions[:5], predictions[:5]])
    assert drawn(curves(twice, curve, "", True), "measured, falling") == 0


def test_suspected_readings_are_drawn_apart_where_they_can_be_seen(predictions, curve):
    visit = predictions[:5]
    visit.loc[1, "force_n"] = 2500.0
    visit.loc[3, "moment_nmm"] = 31.0
    suspects = [Suspect(1, "force", 0.0, 0.0, 9.0, "", (1,)), Suspect(3, "moment", 0.0, 0.0, 9.0, "", (3,))]
    figure = curves(flagged(visit, suspects), curve, "title", simulated=False)
    # A row whose force slipped still has a moment.
    assert [drawn(figure, "measured, rising", panel) for panel in range(3)] == [4, 4, 3]
    assert [drawn(figure, "suspected reading", panel) for panel in range(3)] == [1, 1, 2]
    assert "suspected reading" in [text.get_text() for text in figure.legends[0].get_texts()]
    # Next to the others, with its value, because there it would leave them no room.
    assert [[text.get_text() for text in axes.texts if text.get_text()] for axes in figure.axes] == [
        ["F = 2500 N"],
        [],
        ["F = 2500 N"],
    ]
    assert all(axes.get_ylim()[1] < 100 for axes in figure.axes)
    numbers = curve_numbers(flagged(visit, suspects), {"model": curve})
    assert numbers.loc[numbers["what"] == "suspected reading", "force_n"].tolist() == [2500.0, 3.0]
    # Nothing of it where nothing is suspected, and a row that the user left out is not drawn at all.
    plain = curves(visit.assign(left_out=[0, 1, 0, 0, 0]), curve, "", True)
    assert (drawn(plain, "measured, rising"), drawn(plain, "suspected reading")) == (4, 0)


def test_charts_draw_suspected_readings_apart_as_pictures_do(predictions, curve):
    charts = CurveCharts(["model"])
    visit = flagged(predictions[:5], [Suspect(1, "force", 0.0, 0.0, 9.0, "", (1,))])
    for shown, count in ((visit, 1), (predictions[:5], 0)):
        charts.show(shown, {"model": curve})
        assert [len(rows.data["force_n"]) for rows in charts.rows] == [5 - count, 5, 5 - count]
        assert [len(rows.data["force_n"]) for rows in charts.suspects] == [count, 0, count]
        legend = {item.label.value: item.visible for item in charts.panels[0].legend[0].items}
        assert legend == {
            **{"model": True, "measured": True, "falling pressure": False},
            **{"slack": False, "suspected reading": bool(count), SHORT: False},
        }


def test_bands_are_filled_over_the_pressure_and_named_once(predictions, curve):
    banded = with_band(curve, force_pred_n=1.0, moment_pred_nmm=3.0)
    figure = curves(predictions[:5], {"before": banded, "after": banded}, "title", simulated=False)
    assert [filled(axes) for axes in figure.axes] == [2, 2, 0]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels.count(BAND) == 1
    # As far as the pressures were measured, and as high as the band.
    extent = figure.axes[0].patches[0].get_path().get_extents()
    assert (extent.x0, extent.x1, extent.y0, extent.y1) == (2, 4, 1, 5)
    # Nothing where nothing is known: of one quantity, or of all.
    some = curves(predictions[:5], with_band(curve, force_pred_n=1.0, moment_pred_nmm=np.nan), "", True)
    assert [filled(axes) for axes in some.axes] == [1, 0, 0]
    for blank in (with_band(curve, force_pred_n=np.nan, moment_pred_nmm=np.nan), curve):
        none = curves(predictions[:5], blank, "", True)
        assert [filled(axes) for axes in none.axes] == [0, 0, 0]
        assert BAND not in [text.get_text() for text in none.legends[0].get_texts()]
        assert to_rgb(none).std() > 5


@pytest.mark.nightly
def test_a_band_that_lies_on_itself_is_as_light_as_any(predictions, curve):
    """Up and down again the model of no memory fills the same area twice."""
    up = with_band(curve.assign(extrapolated=False), force_pred_n=1.0)
    images = [
        to_rgb(curves(predictions[:5], shown, "", True)) for shown in (up, pd.concat([up, up[::-1]], ignore_index=True))
    ]
    light = [np.unique(image.reshape(-1, 3), axis=0, return_counts=True) for image in images]
    for colors, counts in light:
        # The commonest color but for the paper's.
        order = np.argsort(counts)
        assert tuple(colors[order[-1]]) == (255, 255, 255)
        assert tuple(colors[order[-2]]) == (214, 232, 242)


def test_charts_fill_bands_as_pictures_do(predictions, curve):
    charts = CurveCharts(["before", "after"])
    banded = with_band(curve, force_pred_n=1.0, moment_pred_nmm=np.nan)
    charts.show(predictions[:5], {"after": banded})
    areas = [{name: len(source.data["across"]) for name, source in panel.items()} for panel in charts.bands]
    assert areas == [{"before": 0, "after": 16}, {"before": 0, "after": 0}, {}]
    legends = [{item.label.value: item.visible for item in panel.legend[0].items} for panel in charts.panels]
    assert [legend.get(SHORT) for legend in legends] == [True, False, None]
    # The entry hides all of a panel's bands, and nothing else.
    entry = next(item for item in charts.panels[0].legend[0].items if item.label.value == SHORT)
    assert {type(renderer.glyph).__name__ for renderer in entry.renderers} == {"VArea"}
    assert len(entry.renderers) == 2
    assert charts.panels[0].legend[0].click_policy == "hide"
    # Below every line.
    assert [drawn.glyph for drawn in charts.panels[0].renderers[:2]] == [alike.glyph for alike in entry.renderers]
    charts.show(predictions[:5], {"after": curve})
    assert not len(charts.bands[0]["after"].data["across"])
    assert not entry.visible


def test_a_suspected_reading_stands_beside_a_band_and_not_on_it(predictions, curve):
    visit = predictions[:5]
    visit.loc[1, "force_n"] = 2500.0
    marked = flagged(visit, [Suspect(1, "force", 0.0, 0.0, 9.0, "", (1,))])
    figure = curves(marked, with_band(curve, force_pred_n=40.0), "", True)
    cross = next(line for line in figure.axes[0].lines if line.get_label() == "suspected reading")
    assert cross.get_ydata()[0] > 44


def test_the_legend_of_a_chart_says_what_open_squares_are(predictions, curve):
    charts = CurveCharts(["model"])
    visit = predictions[:5].assign(pressure_kpa=[0.0, 2, 4, 3, 1])
    charts.show(visit, {"model": curve})
    legend = {item.label.value: item for item in charts.panels[0].legend[0].items}
    assert (legend["measured"].visible, legend["falling pressure"].visible) == (True, True)
    marks = [legend[name].renderers[0].glyph for name in ("measured", "falling pressure")]
    assert [mark.fill_color for mark in marks] == ["black", "white"]
    # The first that are drawn so; the legend's own are nowhere.
    squares = [next(drawn for drawn in charts.panels[0].renderers if drawn.glyph is mark) for mark in marks]
    assert [len(square.data_source.data["force_n"]) for square in squares] == [3, 2]
    # Nothing is named that is not drawn.
    charts.show(visit.assign(slack=1), {"model": curve})
    assert [legend[name].visible for name in ("measured", "falling pressure", "slack")] == [False, False, True]


def test_legends_and_titles_stay_inside_their_pictures(predictions, curve):
    one = predictions[:5].drop(columns=["moment_nmm"]).assign(bed="isometric", slack=[0, 0, 0, 1, 1])
    figure = curves(one, {"continuum + fiber_misalignment + end_clamps": curve}, "title", simulated=False)
    figure.canvas.draw()
    box, below = figure.legends[0].get_window_extent(), figure.axes[0].xaxis.get_label().get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= below.y0
    names = " + ".join(["fiber_misalignment", "end_clamps", "second_invariant_log", "friction_hysteresis"])
    title = residual_map(predictions, f"after: continuum, {names}", simulated=True)._suptitle
    extent = title.get_window_extent()
    assert 0 <= extent.x0 < extent.x1 <= title.get_figure().bbox.x1


def test_residual_map_scales_are_symmetric_and_show_the_worst(predictions):
    for points in colored(residual_map(predictions, "title", True)):
        low, high = points.get_clim()
        assert low == -high
    # Measured minus predicted, N: −9 at the planted state of sample 6, −1 elsewhere, one marker per state.
    force = colored(residual_map(predictions[predictions["sample"] == 6], "title", True))[0]
    assert sorted(force.get_array()) == pytest.approx([-9] + [-1] * 5)
    assert force.get_clim() == (-9, 9)
    # With scales of their own, sample 3 is −1 N everywhere and so at the end of its scale; sample 6 is −1/9 or −1.
    own = colored(residual_map(predictions, "title", True))[0]
    assert sorted(own.get_array()) == pytest.approx([-1] * 7 + [-1 / 9] * 5)


def test_before_and_after_have_one_scale(predictions):
    one = predictions[predictions["sample"] == 6]
    after = one.assign(force_pred_n=one["force_n"] + 0.5)
    over, shown = KINEMATIC.state, KINEMATIC.measured
    limits = scale_limits([one, after], over, shown)
    assert limits[6, "force_n"] == pytest.approx(9)
    maps = [residual_map(table, "title", True, limits) for table in (one, after)]
    assert [colored(figure)[0].get_clim() for figure in maps] == [(-9, 9), (-9, 9)]
    # How small it has become stands above the field.
    assert "largest 0.5 N" in [text.get_text().split("\n")[-1] for text in maps[1].axes[0].texts]
    # Of several samples each has its own, in both maps alike.
    both = scale_limits([predictions, predictions.assign(force_pred_n=predictions["force_n"] + 0.5)], over, shown)
    assert (both[3, "force_n"], both[6, "force_n"]) == (pytest.approx(1), pytest.approx(9))


def test_rounding_is_no_residual(predictions):
    exact = predictions[predictions["sample"] == 3].assign(
        force_pred_n=lambda t: t["force_n"] * (1 + 1e-15), moment_pred_nmm=lambda t: t["moment_nmm"]
    )
    for points in colored(residual_map(exact, "title", True)):
        assert points.get_clim() == (-1, 1)


def test_a_color_bar_says_in_words_which_way_the_model_is_off(predictions):
    figure = residual_map(predictions[predictions["sample"] == 3], "title", True)
    words = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert words.count(["model too low", "model too high"]) == 2


def test_residual_map_marks_states_without_a_usable_row(predictions):
    predictions.loc[:4, "buckled"] = 1
    figure = residual_map(predictions[predictions["sample"] == 3], "title", simulated=True)
    assert [len(points.get_offsets()) for points in colored(figure)] == [5, 5]
    dot = figure.axes[0].lines[0]
    np.testing.assert_array_equal(dot.get_xydata(), [(-1.0, -10.0)])
    # Markers of neighboring states do not overlap: their side is less than the states' distance on paper.
    side = np.sqrt(colored(figure)[0].get_sizes()[0]) * figure.dpi / 72
    here = np.sort(figure.axes[0].transData.transform([(e, 10.0) for e in (-1, 0, 1)])[:, 0])
    assert side < np.diff(here).min()


def test_residual_map_says_which_samples_it_leaves_out(predictions):
    many = pd.concat([predictions.assign(sample=predictions["sample"] * 10 + k) for k in range(5)])
    assert "first 8 of 10 samples" in residual_map(many, "title", simulated=True).get_suptitle()
    nothing = residual_map(predictions.assign(buckled=1), "title", simulated=True)
    assert to_rgb(nothing).std() > 1


def test_the_best_the_middle_and_the_worst_state_are_picked(predictions):
    state = predictions.groupby(["sample", "elongation_mm", "twist_deg"]).ngroup()
    # Errors of 0, 1, … N in the order of the states, but for the planted one, and one larger with too few rows.
    predictions["force_pred_n"] = predictions["force_n"] + state
    predictions.loc[predictions.index[:5], "force_pred_n"] += 99
    predictions.loc[predictions.index[:2], "buckled"] = 1
    picked = [
        tuple(predictions.iloc[rows[0]][["sample", "elongation_mm", "twist_deg"]]) for rows in pick_states(predictions)
    ]
    assert picked == [(3, -1.0, 10.0), (6, -1.0, -10.0), (6, 1.0, 10.0)]
    assert pick_states(predictions.assign(buckled=1)) == []


def test_files_are_whole(predictions, tmp_path):
    figure = parity(predictions, "title", simulated=True)
    image = to_rgb(figure)
    height, width = (round(inches * figure.dpi) for inches in figure.get_size_inches()[::-1])
    assert image.shape == (height, width, 3)
    assert image.dtype == np.uint8
    assert image.std() > 5
    save(figure, predictions, tmp_path / "parity.png")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["parity.csv", "parity.png"]
    assert len(pd.read_csv(tmp_path / "parity.csv")) == len(predictions)


def test_a_failed_save_leaves_the_old_files_and_nothing_else(predictions, tmp_path, monkeypatch):
    figure = parity(predictions, "title", simulated=True)
    save(figure, predictions, tmp_path / "parity.png")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with monkeypatch.context() as patch:
        patch.setattr(pd.DataFrame, "to_csv", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
        with pytest.raises((OSError, UserError), match="disk full"):
            save(figure, predictions, tmp_path / "parity.png")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_creeping_bed_gives_one_state_per_visit(predictions):
    predictions["elongation_mm"] += np.linspace(0, 0.01, len(predictions))
    assert len(residual_table(predictions)) == 12
    assert [len(state) for state in pick_states(predictions)] == [5, 5, 5]
