"""All maps of a fitted model: what it can push, where it can go, how stiff it is there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freelearn.results.fitted_model import FittedModel
from freelearn.results.load_polygon import load_polygon
from freelearn.results.map_scope import refused, tells_loads, tells_poses
from freelearn.results.reachable import Reachable
from freelearn.results.reachable_poses import reachable_poses
from freelearn.results.reached import Ends, Reached
from freelearn.results.stiffness_map import StiffnessMap
from freelearn.results.stiffness_plane import stiffness_map

__all__ = ["Maps", "Reachable", "StiffnessMap", "load_polygon", "maps", "reachable_poses", "stiffness_map"]

# An end of the plane is a place of its own from this share of the plane away from rest.
APART = 0.2
# Places along the only quantity that a bed moved.
ALONG = 5


@dataclass(frozen=True)
class Maps:
    """loads: reachable at rest, of a single sample also elsewhere in the plane; poses: of a free end; stiffness: at
    three pressures. None for what the model does not tell: a network knows only what it was fitted to."""

    loads: Reachable | None
    poses: Reachable
    stiffness: StiffnessMap | None


def maps(fitted: FittedModel) -> Maps:
    """All maps of a run, within the reach of its bed. Raises UserError where there is none."""
    if not tells_poses(fitted):
        raise refused(fitted)
    poses = reachable_poses(fitted)
    if not tells_loads(fitted):
        return Maps(None, poses, None)
    elongation, twist = zip(*_places(fitted, poses.reached), strict=True)
    return Maps(load_polygon(fitted, elongation, twist), poses, stiffness_map(fitted))


def _places(fitted: FittedModel, reached: Reached) -> list[tuple[float, float]]:
    """Rest, or the nearest place to it that the bed went to; of a single sample also the plane's ends from there, or
    where the bed moved in one way alone, even steps along it."""
    rest = reached.nearest(0.0, 0.0)
    if len(fitted.design) > 1:
        return [rest]
    moved = [low < high for low, high in (reached.elongation, reached.twist)]
    if sum(moved) == 1:
        lengths, twists = (np.linspace(*ends, ALONG) for ends in (reached.elongation, reached.twist))
        return [(float(length), float(twist)) for length, twist in zip(lengths, twists, strict=True)]
    stretched = [(end, rest[1]) for end in _apart(reached.elongation, rest[0])]
    return [rest, *stretched, *((rest[0], end) for end in _apart(reached.twist, rest[1]))]


def _apart(ends: Ends, rest: float) -> list[float]:
    """Those of the ends that are no more or less where the actuator rests."""
    return [end for end in ends if abs(end - rest) > APART * (ends[1] - ends[0])]
