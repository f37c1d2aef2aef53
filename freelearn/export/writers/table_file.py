"""An actuator as a gridded table (netCDF), refined until linear interpolation in it errs less than was asked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from freelearn.common.errors import UserError
from freelearn.common.files import write_bytes
from freelearn.export.actuator_functions import Functions, View
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import Reference, Written
from freelearn.export.writers.c_file import title

OUTSIDE = (
    "Interpolation beyond the grid gives NaN (no number), never an extrapolation; the grid is the box of the data."
)
# Nodes along each input at first, and all that a table may have.
FIRST, MOST = 5, 3_000_000
# Places between nodes where the error is looked at; of it so much is allowed, for the places that are not.
PROBES, SHARE = 4000, 0.6


def write_table(functions: Functions, folder: Path, options: Options) -> Written:
    """NAME.nc. Raises UserError where a table cannot hold what the actuator remembers, or would be too large."""
    modules = needed("table")
    view, actuator = functions.view, functions.actuator
    if actuator.remembers:
        history = [e.name for some in actuator.fitted.model.history.values() for e in some]
        raise UserError(
            f"A table has no room for what goes on along a log ({', '.join(history)}): use to=c, onnx or fmu."
        )
    ports = view.inputs
    held = [p.name for p in ports[len(actuator.imposed) :] if not p.name.startswith("direction")]
    if held:
        raise UserError(
            f"A table has no room for what the actuator remembers ({', '.join(held)}): use to=c, onnx or fmu."
        )
    axes = _refined(view, options.error)
    names = [p.name for p in actuator.answered]
    values = _at(view, _nodes(axes)).reshape(*map(len, axes), len(names))
    coordinates = {
        p.name: (p.name, axis, {"units": p.unit, "long_name": p.about}) for p, axis in zip(ports, axes, strict=True)
    }
    data = {
        p.name: ([q.name for q in ports], values[..., i], {"units": p.unit, "long_name": p.about})
        for i, p in enumerate(actuator.answered)
    }
    told = {"title": title(functions, options), "interpolation": "linear", "largest_error": options.error}
    dataset: Any = modules["xarray"].Dataset(data, coordinates, told)
    path = folder / f"{options.name}.nc"
    # In memory first: HDF5 may bring down the whole process where a disk is full.
    write_bytes(path, bytes(dataset.to_netcdf(engine="h5netcdf")))
    stored = modules["xarray"].load_dataset(path, engine="h5netcdf")
    grid = tuple(stored[p.name].to_numpy() for p in ports)
    look = RegularGridInterpolator(
        grid, np.stack([stored[n].to_numpy() for n in names], axis=-1), bounds_error=False, fill_value=np.nan
    )

    def answers(x: np.ndarray) -> np.ndarray:
        y = look(x)
        found: np.ndarray = np.c_[y, np.zeros(len(y)), np.isfinite(y).all(1)]
        return found

    size = " × ".join(str(len(axis)) for axis in axes)
    notes = [f"{size} nodes; interpolate linearly"]
    return Written([path], {view.answer.name: answers}, OUTSIDE, options.error, True, notes)


def _nodes(axes: list[np.ndarray]) -> np.ndarray:
    """Every node, (n, k)."""
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def _at(view: View, x: np.ndarray) -> np.ndarray:
    """What the model answers, (n, 2). Raises UserError where it has no answer."""
    y, status = Reference(view.actuator, x, [p.name for p in view.inputs]).answered
    if (status != 0).any() or not np.isfinite(y).all():
        raise UserError(
            "A table needs an answer everywhere in the box of the data, and at some of its states the model has none "
            "(no equilibrium, or fibers at their end): use to=c, onnx or fmu, which flag them."
        )
    return y


def _refined(view: View, error: float) -> list[np.ndarray]:
    """Nodes along each input: those that interpolation along it errs by most are doubled until all do not."""
    ports, generator = view.inputs, np.random.default_rng(0)
    domain = view.actuator.domain
    domain = [*domain, *[(-1.0, 1.0)] * (len(ports) - len(domain))]
    flat = [low == high for low, high in domain]
    # What was never varied: the one place and a little to either side, which no interpolation needs.
    count = [
        2 if still else 3 if p.name.startswith("direction") else FIRST for still, p in zip(flat, ports, strict=True)
    ]
    wide = [max(1e-9, 1e-6 * abs(low)) if still else 0.0 for still, (low, _) in zip(flat, domain, strict=True)]
    while True:
        axes = [np.linspace(low - w, high + w, n) for (low, high), n, w in zip(domain, count, wide, strict=True)]
        if np.prod(count) > MOST:
            raise UserError(
                f"A table that errs by less than {error:g} of the range would have more than {MOST:,} nodes: "
                "ask for a larger error, or use to=c."
            )
        values = _at(view, _nodes(axes)).reshape(*count, -1)
        look = RegularGridInterpolator(tuple(axes), values)
        span = np.maximum(np.ptp(values.reshape(-1, values.shape[-1]), axis=0), 1e-300)
        low, high = np.array([axis[[0, -1]] for axis in axes]).T
        probes = generator.uniform(low, high, size=(PROBES, len(axes)))
        worst = np.abs(look(probes) - _at(view, probes)).max(0) / span
        # Halfway between nodes of one input, at nodes of the others: what that input's spacing alone errs by.
        alone = []
        for i, axis in enumerate(axes):
            at = np.stack([generator.choice(a, size=400) for a in axes], axis=1)
            at[:, i] = generator.choice((axis[1:] + axis[:-1]) / 2, size=400)
            fixed = ports[i].name == "direction" or flat[i]
            alone.append(0.0 if fixed else float((np.abs(look(at) - _at(view, at)).max(0) / span).max()))
        if worst.max() <= SHARE * error:
            return axes
        most = max(alone)
        if most == 0.0:
            raise UserError("No finer grid makes the table better: use to=c.")
        count = [2 * n - 1 if e > most / 2 else n for n, e in zip(count, alone, strict=True)]
