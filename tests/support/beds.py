"""Small measurement tables of every bed, simulated, with something hidden in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from freelearn.data.accuracy import PAPER
from freelearn.data.beds import BED, DEAD_LOAD, INFLATION, ISOMETRIC, KINEMATIC, PRESSURE, Bed, bed_of
from freelearn.data.columns import members_in, pressure_column, with_members
from freelearn.data.states import States, kinematic_state
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model

Effects = Mapping[str, Mapping[str, float]]
C1, C2 = 8e5, 2e7
PRESSURES = (0.0, 15.0, 30.0, 45.0, 60.0, 72.0, 50.0, 20.0)
# Three actuators on one end block: two that twist against each other, and one that only lengthens.
MEMBERS = pd.DataFrame(
    {
        "member": [1, 2, 3],
        "gamma_deg": [40.0, -40.0, 70.0],
        "length_mm": 100.0,
        "inner_radius_mm": 4.77,
        "outer_radius_mm": 6.4,
    }
)


def isometric(effects: Effects, seed: int = 0) -> pd.DataFrame:
    """A braided muscle, held at lengths a little more or less than its own; slack where it would push."""
    design = {
        "gamma_deg": 24.0,
        "gamma2_deg": -24.0,
        "length_mm": 150.0,
        "inner_radius_mm": 5.0,
        "outer_radius_mm": 6.2,
    }
    places = [(1, elongation, 0.0) for elongation in np.linspace(2.0, -8.0, 16)]
    table = _measured(_visits(ISOMETRIC, places, np.array(PRESSURES) * 4).assign(**design), effects, seed)
    loose = table["force_n"] > 0
    return table.assign(force_n=table["force_n"].where(~loose, 0.0), slack=loose.astype(int)).drop(columns=BED)


def dead_load(effects: Effects, seed: int = 0, levels: int = 4) -> pd.DataFrame:
    """Two actuators under so many hung moments; nobody measured the second one's length."""
    hung = [((0.0, -1.0)[number % 2], float(moment)) for number, moment in enumerate(np.linspace(-90, 90, levels))]
    loads = [(sample, *load) for sample in (1, 2) for load in hung]
    table = _visits(DEAD_LOAD, loads, np.array(PRESSURES) / 2)
    angle = np.where(table["sample"] == 1, 40.0, 62.0)
    table = table.assign(gamma_deg=angle, length_mm=100.0, inner_radius_mm=4.77, outer_radius_mm=6.4)
    table = _measured(table, effects, seed)
    table.loc[table["sample"] == 2, "elongation_mm"] = np.nan
    return table.drop(columns=BED)


def inflation(effects: Effects, seed: int = 0) -> pd.DataFrame:
    """One actuator, held at several lengths and twists, with a camera at its side."""
    design = {"gamma_deg": 62.0, "length_mm": 100.0, "inner_radius_mm": 4.77, "outer_radius_mm": 6.4}
    places = [(1, elongation, twist) for elongation in (-3.0, 0.0, 3.0, 6.0) for twist in (-60.0, 0.0, 60.0)]
    return _measured(_visits(INFLATION, places, PRESSURES).assign(**design), effects, seed).drop(columns=BED)


def block(effects: Effects, seed: int = 0) -> pd.DataFrame:
    """MEMBERS on one end block, inflated one at a time and all at once; their designs are not in the table."""
    places = [(1, elongation, twist) for elongation in (-3.0, 0.0, 3.0) for twist in (-60.0, 0.0, 60.0)]
    parts = []
    for inflated in ([1], [2], [3], [1, 2, 3]):
        part = _visits(KINEMATIC, places, PRESSURES)
        parts.append(part.assign(**{pressure_column(m): part["pressure_kpa"] * (m in inflated) for m in (1, 2, 3)}))
    table = with_members(pd.concat(parts, ignore_index=True).drop(columns="pressure_kpa"), MEMBERS)
    own = ["sample", "step", "elongation_mm", "twist_deg", *map(pressure_column, (1, 2, 3))]
    return _measured(table, effects, seed)[[*own, "force_n", "moment_nmm", "buckled"]]


TABLES = {"isometric": isometric, "dead_load": dead_load, "inflation": inflation, "block": block}


def write(name: str, effects: Effects, folder: Path, seed: int = 0, **more: int) -> list[str]:
    """Writes one of TABLES into the folder; the overrides that read it. more: of that table's own function."""
    path = folder / f"{name}.csv"
    TABLES[name](effects, seed, **more).to_csv(path, index=False)
    overrides = ["data=csv", f"data.path={path}"]
    if name != "block":
        return [*overrides, f"data.bed={name}"]
    MEMBERS.to_csv(folder / "members.csv", index=False)
    return [*overrides, f"data.members={folder / 'members.csv'}"]


def _visits(
    bed: Bed, places: Sequence[tuple[int, float, float]], pressures: Sequence[float] | np.ndarray
) -> pd.DataFrame:
    """Every pressure at every place (sample and the bed's two quantities), in the columns of the bed's table."""
    first, second = (quantity.column for quantity in bed.state)
    rows = [(*place, step, pressure) for place in places for step, pressure in enumerate(pressures)]
    table = pd.DataFrame(rows, columns=["sample", first, second, "step", "pressure_kpa"])
    return table.assign(buckled=0, **({} if bed is KINEMATIC else {BED: bed.name}))


def _measured(table: pd.DataFrame, effects: Effects, seed: int) -> pd.DataFrame:
    """The table with what its bed measures: the loads of a continuum with these effects, and the bed's noise."""
    bed, generator = bed_of(table), np.random.default_rng(seed)
    state, true = kinematic_state(table), table.copy()
    for quantity in bed.state:
        size = getattr(PAPER, quantity.error) / quantity.factor
        true[quantity.column] += size * generator.normal(size=state.max() + 1)[state]
    for name in [pressure_column(m) for m in members_in(table.columns)] or ["pressure_kpa"]:
        true[name] += PAPER.pressure / PRESSURE.factor * generator.normal(size=len(table))
    samples = [int(n) for n in np.unique(table["sample"])]
    model = build_model("continuum", {"C1": C1, "C2": C2}, list(effects), samples, len(members_in(table.columns)))
    hidden = {f"{effect}.{name}": value for effect, own in effects.items() for name, value in own.items()}
    # A parameter of each sample's or member's own has its number behind its name.
    model.set_values({n: hidden[n.split("[")[0]] for n in model.declared if n.split("[")[0] in hidden})
    with torch.no_grad():
        shown, status = model(States.from_table(true))
    assert bool((status == Status.OK).all())
    for channel, quantity in enumerate(bed.readings):
        if quantity in bed.measured:
            noise = getattr(PAPER, quantity.error) * generator.normal(size=len(table))
            table = table.assign(**{quantity.column: (shown[:, channel].numpy() + noise) / quantity.factor})
    return table
