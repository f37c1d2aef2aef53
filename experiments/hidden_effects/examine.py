"""One data set: made, searched, and what came out."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch
from hidden_effects.make import Made, make

from freelearn.data.rows import Rows
from freelearn.discovery.residuals.hysteresis import rising_falling
from freelearn.discovery.residuals.reciprocity import reciprocity
from freelearn.discovery.search.search import Findings, search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.records.discovery import final_estimates


def examine(job: dict) -> dict:
    """Makes one data set, searches it, and says what came out."""
    torch.set_num_threads(1)
    made = make(job)
    table = made.measured.table
    began = time.perf_counter()
    asked = np.flatnonzero(table["buckled"] == 0)
    rows = Rows.from_table(table)[torch.as_tensor(asked)]

    def build(names: Any) -> Any:
        return build_model("continuum", {}, names, list(made.actuators))

    question = question_of_rows(build, table.columns, rows, made.told, job["seed"] % 1000)
    result = job | {
        "reached": made.reached,
        "testable": job["kind"] == "outside" or set(job["hidden"]) <= set(question.candidates),
        "actuators": {str(n): list(a) for n, a in made.actuators.items()},
        "rows": len(rows),
    }
    try:
        found = search(question)
    except Exception as problem:  # a failure is a result too
        reason = f"{type(problem).__name__}: {problem}"
        return result | {"verdict": "failed", "reason": reason, "effects": [], "classes": []}
    return result | answers(found, job, made) | slipped(found, asked, made) | {"seconds": time.perf_counter() - began}


def answers(found: Findings, job: dict, made: Made) -> dict:
    """Verdict, effects, errors, screens, and which intervals cover the truth."""
    first, last = found.steps[0], found.final
    screens = [
        rising_falling(first.fit.raw_residual, found.rows.states, found.rows.state, first.whiten),
        reciprocity(first.fit.residual, first.fit.jacobian, found.rows.states, first.whiten),
    ]
    truth = {"C1": made.material[0], "C2": made.material[1]}
    truth |= {f"{name}.{p}": v for name, values in made.fx.items() for p, v in values.items()}
    right = set(found.effects) == set(job["hidden"]) and job["kind"] != "outside"
    return {
        "verdict": found.verdict,
        "effects": found.effects,
        "classes": [list(c) for c in found.classes],
        "truth": truth,
        "screens": {screen.name: screen.shows for screen in screens},
        "hysteresis_at_most": screens[0].at_most,
        "before": first.E_heldout,
        "after": last.E_heldout,
        "floor": last.floor,
        "covered": covered(found, truth) if right else {},
    }


def covered(found: Findings, truth: dict[str, float]) -> dict[str, bool]:
    """Whether each parameter's 95 % interval holds the truth, where there is one by its name and it can be told.

    Friction in twist is nothing to a bed without a moment."""
    out = {}
    for known in final_estimates(found):
        if (whole := known.name.split("[")[0]) in truth and known.stderr > 0:
            out[known.name] = bool(known.low <= truth[whole] <= known.high)
    return out


def slipped(found: Findings, asked: np.ndarray, made: Made) -> dict:
    """The readings that slipped and whether each was suspected, and how many good rows were.

    asked: places in the table of the rows that were asked about, which is what suspects count by.
    """
    # A block that slipped together accuses no single reading: it says that a zero or a scale has changed.
    loads = {(s.row, s.load) for s in found.suspects if len(s.rows) == 1}
    accused = {row for row, _ in loads}
    place = {int(row): number for number, row in enumerate(asked)}
    slips = []
    for slip in made.measured.slips.to_dict("records"):
        row, load = place[int(slip["row"])], str(slip["load"]).split("_")[0]
        slips.append(
            {"row": row, "load": load, "kind": slip["kind"], "sensor_sigmas": float(slip["sensor_sigmas"])}
            | {"all_sigmas": float(slip["all_sigmas"]), "found": row in accused, "load_too": (row, load) in loads}
        )
    good = accused - {slip["row"] for slip in slips}
    blocks = [s.slip for s in found.suspects if len(s.rows) > 1]
    return {
        "slips": slips,
        "blocks": blocks,
        "accused": len(good),
        "good_rows": len(asked) - len({slip["row"] for slip in slips}),
    }
