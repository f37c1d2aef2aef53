"""State → loads → state, on all rows of the simulated bed."""

from __future__ import annotations

import time

import numpy as np
import torch
from rich.table import Table

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.loaded_table import load_table
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.queries.inverse.asker import Asker
from freelearn.queries.inverse.roots import stays
from freelearn.queries.inverse.system import Span, System

# The usual walls and fibers, and soft ones of which many a row has no equilibrium.
MATERIALS = ((1e6, 4e7), (2e5, 1e6))
RUNS = 3


def round_trip_table() -> Table:
    """One line for each material."""
    states = States.from_table(load_table(settings(TrainSettings).data).table)
    heads = ("rows", "no equilibrium", "stable", "came back", "worst error / range", "several solutions", "seconds")
    shown = Table("C1, C2 [Pa]", *heads, title="State → loads → state (the best of three runs)")
    for c1, c2 in MATERIALS:
        system = System.from_model(build_model("continuum", {"C1": c1, "C2": c2}), states)
        x = torch.stack(states.inputs(), dim=-1)
        loads, status = system.at(x)
        asker = Asker(Span.from_system(system), loads.abs().amax(0), None, False)
        blank = x.clone()
        blank[:, :2] = torch.nan
        seconds = []
        for _ in range(RUNS):
            began = time.perf_counter()
            answered = asker.answered(system, blank, system.at(x).loads)
            seconds.append(time.perf_counter() - began)
        stable = (status == Status.OK) & stays(system.slopes(x)[1], (0, 1))
        error = ((answered.x - x).abs() / (x.amax(0) - x.amin(0)))[:, :2].amax(-1)
        back = stable & (error <= 1e-8)
        worst = float(error[back].max())
        counts = [len(x), int((status == Status.NO_EQUILIBRIUM).sum()), int(stable.sum()), int(back.sum())]
        several = int((answered.solutions > 1).sum())
        shown.add_row(f"{c1:g}, {c2:g}", *map(str, counts), f"{worst:.1e}", str(several), f"{np.min(seconds):.2f}")
    return shown
