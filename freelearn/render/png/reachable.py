"""What pressures reach in a plane of loads or of poses."""

from __future__ import annotations

from matplotlib.figure import Figure

from freelearn.measurements.beds import FORCE
from freelearn.render.png.canvas import heading
from freelearn.render.png.reach_curves import reach_curves
from freelearn.render.png.reach_names import place_name
from freelearn.render.png.reach_regions import reach_regions
from freelearn.results.reachable import Reachable
from freelearn.results.residuals import MOST_SAMPLES


def reachable(found: Reachable, title: str, simulated: bool) -> Figure:
    """Loads at a place, or poses under a load, over all pressures within reach. title: the model.

    Single actuators share one panel, in which marks are even steps of the pressure; actuators on an end block have a
    panel for each place, with the corners of what is reached named by the pressures that make them.
    """
    cases = list(found.cases())
    shown = cases[:MOST_SAMPLES]
    more = [f"Shown: first {len(shown)} of {len(cases)}."] if len(cases) > len(shown) else []
    what, here = "poses within reach", place_name(found, shown[0])
    if found.plane[0] is FORCE:
        same = len({(case.first, case.second) for case in shown}) == 1
        what = "loads within reach" + (f" at {here}" if same else "")
    else:
        free = not (shown[0].first or shown[0].second)
        what += " of a free end" if free else f" under {here}"
    draw = reach_regions if found.several else reach_curves
    return draw(found, shown, [heading(title, simulated), what], [*found.notes, *more])
