"""Pictures of maps say what they show, of one sample and of several, and stay inside their edges."""

import re

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.contour import ContourSet

from freelearn.data.beds import DEAD_LOAD, ELONGATION, FORCE, KINEMATIC, MOMENT, PRESSURE, TWIST
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.queries.curves.curve_rows import pressure_of
from freelearn.queries.maps.map_scope import OperatingRange
from freelearn.queries.maps.maps import Maps
from freelearn.queries.maps.reach import PressureGrid, Reachable, crossed, reached_points
from freelearn.queries.maps.stiffness_map import AXIAL, BACK, COUPLING, RATES, TORSIONAL, StiffnessMap
from freelearn.report.plots.canvas import to_rgb
from freelearn.report.plots.map_plots import FEW, pictures, stiffness
from freelearn.report.plots.reach_plots import reachable

torch = pytest.importorskip("torch")
UNIT = re.compile(r"\[(N|N·mm|kPa|mm|°)\]$")


def made(samples=(3,), members=1, plane=(FORCE, MOMENT), lost=0, silent=False, places=1, elongation=(-5.0, 5.0)):
    """What each pressure adds is along a direction of its own, and bent a little; the first rows may be lost."""
    several = tuple(pressure_of(n + 1) for n in range(members)) if members > 1 else (PRESSURE,)
    grid = PressureGrid.between(several, np.zeros(members), np.full(members, 60.0))
    imposed = KINEMATIC.state if plane == (FORCE, MOMENT) else DEAD_LOAD.state
    names = [quantity.column for quantity in imposed]
    cases = pd.DataFrame([(n, float(i), 0.0) for n in samples for i in range(places)], columns=["sample", *names])
    rows = crossed(grid, cases)
    pressed = rows[[q.column for q in several]].to_numpy()
    away = np.array([(-0.3, 1.5), (0.4, -2.0), (0.2, 0.5)])[:members]
    values = (pressed + 0.002 * pressed**2) @ away
    values[:, 1] *= not silent
    factors = [quantity.factor for quantity in plane]
    status = torch.tensor(np.where(np.arange(len(rows)) < lost, Status.NO_EQUILIBRIUM, Status.OK).astype(np.uint8))
    points = reached_points(rows, grid, plane, Prediction(torch.tensor(values * factors), status))
    reached = OperatingRange(elongation, (-500.0, 500.0), several, grid.levels[:, 0], grid.levels[:, -1])
    return Reachable(points, grid, imposed, plane, reached, (3,), ("A note.",))


def planes(samples=(3,), ats=("lowest", "highest"), blank=0, unstable=True, back=1.0, size=9):
    lengths, twists = np.linspace(-2, 2, size), np.linspace(-60, 60, size + 4)
    parts = []
    for n in samples:
        for p, at in enumerate(ats):
            length, twist = (axis.ravel() for axis in np.meshgrid(lengths, twists, indexing="ij"))
            part = pd.DataFrame({"sample": n, "at": at, "elongation_mm": length, "twist_deg": twist})
            part = part.assign(pressure_kpa=60.0 * p, status="ok")
            part[AXIAL.column], part[TORSIONAL.column] = n * (10 + length), 2 + twist / 40
            part[COUPLING.column] = 0.01 * n * (length + 0.5)
            part[BACK.column] = back * np.rad2deg(part[COUPLING.column])
            part["least_nm_per_rad"] = part[TORSIONAL.column] - (1.0 if unstable else -9.0)
            part["stable"] = (part["least_nm_per_rad"] > 0) * 1.0
            part.loc[part.index[:blank], [*(r.column for r in RATES), "least_nm_per_rad", "stable"]] = np.nan
            parts.append(part)
    return StiffnessMap(pd.concat(parts, ignore_index=True), (ELONGATION, TWIST), (3,), ())


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()] if figure.legends else []


def beyond_the_edges(figure):
    """Texts that are not wholly on the picture."""
    figure.canvas.draw()
    parts = [figure._suptitle, *figure.texts, *figure.legends]
    for axes in figure.axes:
        parts += [axes.xaxis.label, axes.yaxis.label, axes.title, *axes.texts]
        for axis, ends in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            parts += [tick.label1 for tick in axis.get_major_ticks() if min(ends) <= tick.get_loc() <= max(ends)]
    boxes = [(part, part.get_window_extent()) for part in parts if not hasattr(part, "get_text") or part.get_text()]
    whole = figure.bbox
    return [
        part
        for part, box in boxes
        if box.x0 < whole.x0 or box.y0 < whole.y0 or box.x1 > whole.x1 + 1 or box.y1 > whole.y1 + 1
    ]


@pytest.mark.parametrize("samples", [(3,), (3, 6), tuple(range(1, 12))])
def test_a_curve_for_each_actuator_with_its_pressures(samples):
    found = made(samples, lost=7)
    figure = reachable(found, "continuum", simulated=True)
    assert "continuum — simulated data" in figure.get_suptitle()
    assert "loads within reach at 0 mm, 0°" in figure.get_suptitle()
    (axes,) = figure.axes
    assert UNIT.search(axes.get_xlabel())
    assert UNIT.search(axes.get_ylabel())
    lines = [line for line in axes.lines if line.get_label().startswith("sample")]
    assert len(lines) == min(8, len(samples))
    drawn = np.asarray(lines[0].get_xydata())
    assert np.isnan(drawn[:7]).all()
    np.testing.assert_allclose(drawn[7:], found.points[["force_n", "moment_nmm"]].to_numpy()[7:61])
    # Dashed and said where the model was not fitted.
    styles = {line.get_label(): line.get_linestyle() for line in lines}
    assert all((style == "-") == (label == "sample 3") for label, style in styles.items())
    assert {"at 0, 15, 30, 45 kPa", "at 60 kPa"} <= set(legend(figure))
    # Told apart without colors too: no two lines have one mark.
    marks = [handle.get_marker() for handle in figure.legends[0].legend_handles[: len(lines)]]
    assert len(set(marks)) == len(marks)
    notes = " ".join(text.get_text() for text in figure.texts)
    assert "A note." in notes
    assert ("first 8 of 11" in notes) == (len(samples) > 8)
    assert not beyond_the_edges(figure)


def test_what_does_not_turn_is_drawn_over_the_pressure():
    figure = reachable(made(silent=True), "muscle", simulated=False)
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("pressure P [kPa]", "force F [N]")
    assert axes.get_title(loc="left") == "M = 0 N·mm throughout"
    assert "simulated" not in figure.get_suptitle()


@pytest.mark.parametrize("places", [1, 2, 5])
def test_a_region_for_each_place_of_an_end_block(places):
    found = made(members=3, places=places)
    figure = reachable(found, "continuum", simulated=False)
    assert len(figure.axes) == places
    for axes, case in zip(figure.axes, found.cases(), strict=True):
        (region,) = (c for c in axes.collections if isinstance(c, PolyCollection))
        assert len(region.get_paths()) == len(found.grid.cells)
        (outline,) = (line for line in axes.lines if line.get_linestyle() == "--")
        assert len(outline.get_xdata()) == case.points["vertex"].notna().sum() + 1
        assert {text.get_text() for text in axes.texts} == {"none", "1", "2", "3", "1+2", "1+3", "2+3", "1+2+3"}
        assert UNIT.search(axes.get_xlabel())
        assert UNIT.search(axes.get_ylabel())
    assert legend(figure) == ["within reach", "convex hull of it", "corner of the pressures"]
    notes = " ".join(text.get_text() for text in figure.texts)
    assert "P3 from 0 to 60 kPa" in " ".join(notes.split())
    assert not beyond_the_edges(figure)


def test_poses_have_no_hull_and_show_where_the_bed_did_not_go():
    near, far = (made(members=2, plane=(ELONGATION, TWIST), elongation=ends) for ends in ((-99.0, 99.0), (-1.0, 2.0)))
    assert legend(reachable(near, "", True)) == ["within reach", "corner of the pressures"]
    figure = reachable(far, "", True)
    assert legend(figure)[-1] == "beyond where the bed went"
    assert "poses within reach of a free end" in figure.get_suptitle()
    assert not [line for line in figure.axes[0].lines if line.get_linestyle() == "--"]
    assert not beyond_the_edges(figure)
    hung = made(plane=(ELONGATION, TWIST), places=2)
    assert "under" not in reachable(hung, "", True).get_suptitle()


def test_a_map_without_any_equilibrium_is_drawn_empty():
    for members in (1, 2):
        figure = reachable(made(members=members, lost=10**6), "", True)
        assert to_rgb(figure).std() > 1
    empty = planes(blank=10**6)
    assert legend(stiffness(empty, "", True)) == ["no equilibrium"]


@pytest.mark.parametrize(
    ("samples", "ats", "fields"),
    [((3,), ("given",), 3), ((3,), ("lowest", "highest"), 6), ((1, 2, 3, 4, 5), ("given",), 15)],
)
def test_a_field_for_each_plane_and_entry(samples, ats, fields):
    found = planes(samples, ats)
    figure = stiffness(found, "continuum", simulated=True)
    bars = [axes for axes in figure.axes if axes.get_position().width * figure.get_figwidth() < 0.2]
    assert len(figure.axes) - len(bars) == fields
    assert len(bars) == 3
    few = len(samples) <= FEW
    assert [bar.get_ylabel() for bar in bars] == [
        rate.label if few else f"{rate.name} {rate.symbol}\n[share of the range above]"
        for rate in (AXIAL, TORSIONAL, COUPLING)
    ]
    labels = {text for axes in figure.axes if axes not in bars for text in (axes.get_xlabel(), axes.get_ylabel())}
    assert labels - {""} == {"elongation Δl [mm]", "twist φ [°]"}
    assert legend(figure) == ["not stable under a dead load"]
    assert "simulated data" in figure.get_suptitle()
    if not few:
        # Each sample has its own scale, and says its ends.
        titles = [axes.get_title() for axes in figure.axes if axes not in bars]
        assert all(re.search(r"(N/mm|N·mm/°|N/°)$", title) for title in titles)
        assert "sample 1 (not fitted)" in titles[0]
    assert not beyond_the_edges(figure)


def test_what_is_not_stable_is_hatched_and_what_has_no_equilibrium_is_blank():
    def hatched(figure):
        return [c for a in figure.axes for c in a.collections if isinstance(c, ContourSet) and any(c.hatches or [])]

    assert hatched(stiffness(planes(), "", True))
    sound = stiffness(planes(unstable=False), "", True)
    assert not hatched(sound)
    assert legend(sound) == []
    figure = stiffness(planes(unstable=False, blank=20), "", True)
    assert legend(figure) == ["no equilibrium"]
    field = next(c for c in figure.axes[0].collections if c.get_array() is not None and c.get_array().size > 50)
    assert np.ma.getmaskarray(field.get_array()).sum() == 20


def test_a_coupling_that_differs_both_ways_is_drawn_both_ways():
    figure = stiffness(planes(back=0.5), "", True)
    assert BACK.label in {axes.get_ylabel() for axes in figure.axes}
    assert not beyond_the_edges(figure)


def test_the_names_of_many_effects_fit_into_a_heading():
    names = "continuum + fiber_misalignment + end_clamps + second_invariant_log + friction_hysteresis + off_axis"
    poses = made(members=2, plane=(ELONGATION, TWIST))
    for figure in (reachable(made(), names, True), reachable(poses, names, True), stiffness(planes(), names, True)):
        assert "off_axis" in figure.get_suptitle()
        assert not beyond_the_edges(figure)
        title = figure._suptitle.get_window_extent()
        assert all(axes.get_tightbbox().y1 <= title.y0 + 1 for axes in figure.axes)


def test_scales_of_what_has_a_sign_are_even_about_zero():
    figure = stiffness(planes(), "", True)
    for axes in figure.axes:
        if axes.get_ylabel() == COUPLING.label:
            low, high = axes.get_ylim()
            assert low == -high


def test_planes_of_several_samples_have_a_picture_for_each_pressure():
    poses = made(plane=(ELONGATION, TWIST))
    names = [p.name for p in pictures(Maps(made(), poses, planes()), "", True)]
    assert names == ["load_polygon", "reachable_poses", "stiffness"]
    several = pictures(Maps(made(), poses, planes((3, 6))), "", True)
    assert [p.name for p in several[2:]] == ["stiffness_lowest", "stiffness_highest"]
    assert [p.table["pressure_kpa"].unique().tolist() for p in several[2:]] == [[0.0], [60.0]]
    assert "P = 60 kPa" in several[3].figure.get_suptitle()
    assert [p.name for p in pictures(Maps(None, poses, None), "", True)] == ["reachable_poses"]
