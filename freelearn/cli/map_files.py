"""All maps of a fitted model as pictures, and the numbers that they show."""

from __future__ import annotations

from pathlib import Path

from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.maps.maps import maps
from freelearn.records.provenance import Provenance
from freelearn.records.run_files import check_folder
from freelearn.report.plots.canvas import save
from freelearn.report.plots.map_plots import pictures


def write_maps(fitted: FittedModel, folder: Path) -> list[Path]:
    """Writes each map as PNG and, of the same name, as CSV; the paths of all of them. Raises UserError.

    load_polygon, reachable_poses and stiffness; of several samples stiffness_lowest, _middle and _highest, for the
    pressures. A network that was fitted under a dead load has reachable_poses alone.
    """
    found = maps(fitted)
    check_folder(folder)
    written = []
    for picture in pictures(found, fitted.title, Provenance.from_plain(fitted.run.content["data"]).simulated):
        path = folder / f"{picture.name}.png"
        save(picture.figure, picture.table, path)
        written += [path, path.with_suffix(".csv")]
    return written
