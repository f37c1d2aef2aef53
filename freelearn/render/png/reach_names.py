"""What places, loads and samples are called in pictures of what is reached, and where the bed did not go."""

from __future__ import annotations

import re
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from freelearn.measurements.beds import FORCE, Pair
from freelearn.results.reachable import Case, Reachable
from freelearn.results.states import place_text

BEYOND = "0.93"


def place_name(found: Reachable, case: Case) -> str:
    """The two imposed quantities of a case."""
    text = place_text(case.points.iloc[0], found.imposed)
    return re.sub(r"\+0(?=[ °])", "0", text).replace("-", "−")


def case_name(found: Reachable, case: Case, cases: Sequence[Case]) -> str:
    """What tells a case from the others."""
    several = len({other.sample for other in cases}) > 1
    parts = [f"sample {case.sample}" + ("" if case.sample in found.fitted else " (not fitted)")] if several else []
    if len({(other.first, other.second) for other in cases}) > 1:
        parts.append(place_name(found, case))
    return ", ".join(parts) or f"sample {case.sample}"


def shade_beyond(found: Reachable, axes: Axes, drawn: Pair) -> list[Patch]:
    """Shades where the bed did not go, if any of that is seen; what a legend says of it. Over a plane of poses."""
    if drawn != found.plane or found.plane[0] is FORCE:
        return []
    (left, right), (low, high) = found.reached.elongation, found.reached.twist
    across, up = axes.get_xlim(), axes.get_ylim()
    if left <= across[0] and across[1] <= right and low <= up[0] and up[1] <= high:
        return []
    axes.set_facecolor(BEYOND)
    axes.add_patch(Rectangle((left, low), right - left, high - low, facecolor="white", edgecolor="none", zorder=0))
    axes.set(xlim=across, ylim=up)
    return [Patch(facecolor=BEYOND, edgecolor="0.7", label="beyond where the bed went")]
