"""The pictures of a fitted model's maps, each with the table that it was drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from freelearn.render.png.reachable import reachable
from freelearn.render.png.stiffness import stiffness
from freelearn.results.maps import Maps


@dataclass(frozen=True)
class Picture:
    """name: of its files; table: what is drawn."""

    name: str
    figure: Figure
    table: pd.DataFrame


def pictures(maps: Maps, title: str, simulated: bool) -> list[Picture]:
    """One of each map; of several samples, whose planes stand side by side, one of the stiffness at each pressure."""
    drawn = []
    if maps.loads:
        drawn.append(Picture("load_polygon", reachable(maps.loads, title, simulated), maps.loads.points))
    drawn.append(Picture("reachable_poses", reachable(maps.poses, title, simulated), maps.poses.points))
    if maps.stiffness:
        found, names = maps.stiffness, maps.stiffness.ats
        apart = len(names) > 1 and found.table["sample"].nunique() > 1
        parts = [(f"stiffness_{name}", found.at(name)) for name in names] if apart else [("stiffness", found)]
        drawn += [Picture(name, stiffness(part, title, simulated), part.table) for name, part in parts]
    return drawn
