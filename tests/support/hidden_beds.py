"""Tables of every bed from the reference physics, with something hidden in them, and the question that they ask."""

import numpy as np
import pandas as pd
import torch

from freelearn.data.accuracy import PAPER
from freelearn.data.columns import members_in, with_members
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.other_beds import DESIGN_COLUMNS, measure, measure_block, nominal

MATERIAL = 8e5, 2e7
# kPa: up, and down again.
UP_AND_DOWN = np.r_[np.linspace(0, 72.5, 6), 36.25, 0.0]
BRAIDS = {1: (25.0, -25.0, 150.0, 8.0, 9.5), 2: (32.0, -32.0, 150.0, 8.0, 9.5)}
TUBES = {3: (36.0, np.nan, 98.42, 4.77, 6.74), 6: (62.0, np.nan, 99.0, 4.77, 6.36)}
MEMBERS = {
    1: (36.0, np.nan, 98.42, 4.77, 6.74),
    2: (-36.0, np.nan, 98.42, 4.77, 6.74),
    3: (62.0, np.nan, 99.0, 4.77, 6.36),
}
ALONE = ("isometric", "dead_load", "inflation")
BLOCK = "block"


def grid(first, second) -> np.ndarray:
    return np.stack([x.ravel() for x in np.meshgrid(first, second, indexing="ij")], axis=1)


def table_of(bed: str, effects=None, seed: int = 0, coarse: int = 1) -> pd.DataFrame:
    """An isometric bed with braids, a dead load that twists helices, their inflation, or three helices on one end
    block. effects: hidden ones, of a block by the member's number. coarse: every so manieth state."""
    generator = np.random.default_rng([seed, 5])
    hidden = effects or {}
    if bed == BLOCK:
        return _block(hidden, seed, generator)
    designs, pressures = TUBES, UP_AND_DOWN
    if bed == "isometric":
        designs, pressures = BRAIDS, 4 * UP_AND_DOWN
        places = np.stack([np.linspace(-12, 6, 16), np.zeros(16)], axis=1)
    elif bed == "dead_load":
        places = grid([-4.0, -2.0, 0.0, 2.0, 4.0], [-30.0, -10.0, 10.0, 30.0])
    else:
        places = grid([-4.0, -2.0, 0.0, 2.0, 4.0], [-60.0, -30.0, 0.0, 30.0, 60.0])
    places = generator.permutation(places)[::coarse]
    return measure(bed, nominal(bed, designs, places, pressures), *MATERIAL, hidden, seed)


def _block(hidden, seed: int, generator: np.random.Generator) -> pd.DataFrame:
    places = generator.permutation(grid([-4.0, -2.0, 0.0, 2.0, 4.0], [-60.0, -30.0, 10.0, 30.0, 60.0]))
    table = nominal("kinematic", {1: (np.nan,) * 5}, places, UP_AND_DOWN)
    table = table.drop(columns=[*DESIGN_COLUMNS, "pressure_kpa"])
    for n in MEMBERS:
        table[f"pressure_{n}_kpa"] = np.where(table["step"] == 0, 0.0, generator.uniform(0, 72.5, len(table)))
    header = ["member", *DESIGN_COLUMNS]
    members = pd.DataFrame([(n, *design) for n, design in MEMBERS.items()], columns=header)
    return with_members(measure_block(table, MEMBERS, *MATERIAL, hidden, seed), members)


def rows_of(table: pd.DataFrame) -> Rows:
    return Rows.from_table(table)[torch.as_tensor(np.flatnonzero(table["buckled"] == 0))]


def model_of(table: pd.DataFrame, effects=(), name: str = "continuum"):
    samples = sorted(table["sample"].unique().tolist())
    return build_model(name, {}, list(effects), samples, len(members_in(table.columns)))


def question(table: pd.DataFrame, candidates=(), seed: int = 0) -> Question:
    return Question(lambda names: model_of(table, names), list(candidates), rows_of(table), PAPER, seed)


def blanked(table: pd.DataFrame, columns, share: float, seed: int) -> pd.DataFrame:
    """The table with a share of these readings blank."""
    generator = np.random.default_rng([seed, 6])
    return table.assign(**{c: table[c].where(generator.random(len(table)) >= share) for c in columns})
