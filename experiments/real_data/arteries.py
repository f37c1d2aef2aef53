"""Eight arteries, four of them treated with elastase, each fitted alone: which parameter did the treatment change?"""

from __future__ import annotations

from pathlib import Path

import torch
from left_out import fit
from rich.table import Table
from sets import RealSet

from freelearn.data.error import set_error
from freelearn.data.rows import Rows
from freelearn.fitting.starts import starts
from freelearn.physics.models.build import build_model

MODELS = (
    ("fiber_misalignment",),
    ("fiber_misalignment", "fiber_stiffening"),
    ("fiber_misalignment", "fiber_stiffening", "length_offset"),
)
PAIRS = 4


def arteries_table(chosen: RealSet, out: Path) -> Table:
    """C1 and C2 of each control and of the treated one beside it, by each of the models."""
    table = chosen.read(out)
    columns = [f"{name} {i + 1}" for name in ("C1", "C2") for i in range(PAIRS)]
    shown = Table("model", *columns, "E % of each", title="vessels: control → treated, kPa")
    for effects in MODELS:
        values, errors = {}, []
        for sample in range(1, 2 * PAIRS + 1):
            rows = Rows.from_table(table[table["sample"] == sample])
            model = build_model("continuum", effects=effects)
            vector = fit(model, rows, starts(model, rows, 1, torch.Generator())[0])
            with torch.no_grad():
                answer = model(rows.states)
                values[sample] = {name: float(value) / 1e3 for name, value in model.physical(vector).items()}
            errors.append(f"{100 * set_error(rows, answer.loads, answer.status == 0).E:.0f}")
        cells = [
            f"{values[i][name]:.3g} → {values[i + PAIRS][name]:.3g}"
            for name in ("C1", "C2")
            for i in range(1, PAIRS + 1)
        ]
        shown.add_row(" + ".join(["continuum", *effects]), *cells, ", ".join(errors))
    return shown
