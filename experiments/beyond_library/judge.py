"""One data set searched, and whether what the search proposed is right."""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from beyond_library.forms import equivalent, family
from beyond_library.fresh import Fresh, fresh
from beyond_library.kind import Kind
from beyond_library.make import Made, make
from beyond_library.plan import kinds_of
from rich.console import Console

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.effects.registry import EFFECTS

# What ports are called, by what is changed there: other names of a port do not count as another place.
PORT = {
    **dict.fromkeys(("length", "twist", "pressure"), "boundary"),
    **dict.fromkeys(("fiber_angle", "outer_radius", "reference_length", "inner_radius"), "geometry"),
    **dict.fromkeys(("i1", "i2", "i4"), "energy"),
    **dict.fromkeys(("axial", "torsional", "both"), "parallel"),
}
# Most places that a first proposal and its twins may name for the true one to count among them.
CLASS = 2


@dataclass(frozen=True)
class Outcome:
    """What a search said. model: with all that it found, None where it failed; before: with nothing added. classes: of
    each effect all that may stand in for it. proposals: as in discovery.json; of each at least port, where, inputs,
    form, formula and twins."""

    verdict: str
    effects: list[str]
    classes: list[list[str]]
    proposals: list[dict]
    model: Model | None
    before: Model | None
    seconds: float
    error: dict = field(default_factory=dict)
    reason: str = ""


def searched(table: pd.DataFrame, accuracy: Mapping[str, float], seed: int) -> Outcome:
    """The command's own search of a table; accuracy: one standard deviation, in the table's units."""
    began = time.perf_counter()
    known = set(EFFECTS)
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "table.csv"
            table.to_csv(path, index=False)
            told = [f"data.accuracy.{name}={value!r}" for name, value in accuracy.items()]
            asked = settings(
                DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false", f"seed={seed}", *told]
            )
            found = discover(asked, Path(folder), Console(file=io.StringIO()))
    except Exception as problem:  # a failure is a result too
        reason = f"{type(problem).__name__}: {problem}"
        return Outcome("failed", [], [], [], None, None, time.perf_counter() - began, reason=reason)
    finally:
        # What one search wrote must not be in the library of the next one.
        for name in set(EFFECTS) - known:
            with suppress(KeyError):
                del EFFECTS[name]
    content, steps = found.content, found.findings
    classes = [list(members) for members in content["classes"]]
    said = content["verdict"], list(content["effects"]), classes, list(content.get("proposals") or [])
    seconds = time.perf_counter() - began
    return Outcome(*said, steps.final.fit.model, steps.steps[0].fit.model, seconds, dict(content["error"]))


def judged(job: dict) -> dict:
    """Makes a data set, has it searched, and judges the answer: the entry with its results, all JSON."""
    torch.set_num_threads(1)
    kinds = kinds_of(job)
    made = make(job, kinds)
    outcome = searched(made.table, made.told, job["seed"] % 1000)
    result = job | {
        "group": kinds[0].group if kinds else ("library" if job["effect"] else "nothing"),
        "reached": made.reached,
        "possible": made.possible,
        "hidden": [{"kind": h.kind.name, "amount": h.amount, "shape": dict(h.shape)} for h in made.truth.hidden],
        "rows": len(made.table),
        "slips": made.slips,
        "verdict": outcome.verdict,
        "effects": outcome.effects,
        "classes": outcome.classes,
        "proposals": outcome.proposals,
        "error": outcome.error,
        "reason": outcome.reason,
        "seconds": outcome.seconds,
    }
    result |= misses(made, outcome, job["seed"])
    if len(made.truth.hidden) == 1:
        result |= places(outcome.proposals, kinds[0], made.truth.hidden[0].shape)
    plain: dict = _plain(result | {"parts": parts(outcome, made)})
    return plain


def parts(outcome: Outcome, made: Made) -> dict[str, bool]:
    """Whether each part of what is hidden was found: a kind by a proposal, or a hint, at its place with its inputs, an
    effect by its name or in a class."""
    found = {
        h.kind.name: any(places([each], h.kind, h.shape)["inputs_right"] for each in outcome.proposals)
        for h in made.truth.hidden
    }
    listed = set(outcome.effects).union(*outcome.classes)
    return found | {name: name in listed for name in made.truth.effects}


def misses(made: Made, outcome: Outcome, seed: int) -> dict:
    """How far the models are from the truth on fresh states, see `miss`: with what was found, and before."""
    result: dict[str, Any] = {}
    for name, beyond in (("fresh", False), ("beyond", True)):
        states = fresh(made, beyond, seed)
        result[name] = miss(outcome.model, states)
        result[f"{name}_before"] = miss(outcome.before, states)
    return result


def miss(model: Model | None, states: Fresh) -> dict:
    """How far a model is from the truth on fresh states.

    ratio: √(1 + mean of (miss/σ)²) over both loads, σ the whole noise of a new reading, its place included: 1 for a
    perfect model. strict: likewise with σ of sensors and pressure alone: what is hidden at 30 σ in all is often less
    than the place's error in any one reading, and the ratio near 1 before anything is added. own: the root mean square
    of that, without the 1. E: the
    paper's error that measuring there would give; floor: that of a perfect model. answered: share of the rows with an
    answer; the others count as loads of zero, which is what a model without an answer commands.
    """
    rows = states.counted
    if model is None or not rows.any():
        return {}
    with torch.no_grad():
        said = model(States.from_table(states.table))
    answered = (said.status.numpy() == Status.OK) & torch.isfinite(said.loads).all(1).numpy()
    loads = np.where(answered[:, None], said.loads.numpy(), 0.0)
    missed = (loads - states.loads)[rows]
    scale = np.abs(states.loads[rows]).max(0)
    noise, error = ((each / scale) ** 2 for each in (states.whole[rows], missed))
    own = ((missed / states.own[rows]) ** 2).mean()
    return {
        "ratio": float(np.sqrt(1 + ((missed / states.whole[rows]) ** 2).mean())),
        "strict": float(np.sqrt(1 + own)),
        "own": float(np.sqrt(own)),
        "E": float(np.sqrt((noise + error).mean(0).sum())),
        "floor": float(np.sqrt(noise.mean(0).sum())),
        "answered": float(answered[rows].mean()),
        "rows": int(rows.sum()),
    }


def places(proposals: list[dict], kind: Kind, shape: Mapping[str, float]) -> dict:
    """Whether place, inputs and form are right: of the first proposal, or of the twin that is at the true place.

    A twin counts only where the first proposal and its twins name at most two places. Inputs and form count only at
    the right place. A form is right up to what the box cannot tell apart (`forms.equivalent`), and the same where it
    has the hidden one's name.
    """
    nothing = {"port_right": False, "inputs_right": False, "form_right": False, "form_same": False, "first": False}
    if not proposals:
        return nothing
    first, *_ = proposals
    told = [first, *(first.get("twins") or [])]
    if len({_place(each) for each in told}) > CLASS:
        told = [first]
    at = [each for each in told if same_place(each, kind)]
    if not at:
        return nothing
    inputs = [each for each in at if _inputs(each) == set(kind.inputs) - {"direction"}]
    form = [each for each in inputs if equivalent(str(each.get("form", "")), kind, shape)]
    return {
        "port_right": True,
        "inputs_right": bool(inputs),
        "form_right": bool(form),
        "form_same": any(family(str(each.get("form", ""))) == kind.form for each in inputs),
        "first": same_place(first, kind),
    }


def same_place(found: Mapping[str, Any], kind: Kind) -> bool:
    """Whether a proposal stands at the kind's place, or at one where the same function makes the very same loads.

    A parallel spring of the length alone, or of length and pressure, is the same as a load cell's zero that depends on
    these; likewise in twist. Friction is the same as a cell's zero that depends on the direction.
    """
    port, where = _place(found)
    if (port, where) == (kind.port, kind.where):
        return True
    load = {"axial": "force", "torsional": "moment"}.get(kind.where, kind.where)
    if {(port, where), (kind.port, kind.where)} == {("parallel", kind.where), ("measurement", load)}:
        return _zero(kind.inputs, load)
    mirrored = {"force": "axial", "moment": "torsional"}.get(kind.where)
    if kind.port == "measurement" and (port, where) == ("parallel", mirrored):
        return _zero(kind.inputs, load)
    if kind.port == "dissipation" and (port, where) == ("measurement", kind.where):
        return "direction" in (found.get("inputs") or ())
    return False


def _zero(inputs: tuple[str, ...], load: str) -> bool:
    """Whether a load that depends on these alone has a potential."""
    return set(inputs) <= {"elongation" if load == "force" else "twist", "pressure"}


def _place(found: Mapping[str, Any]) -> tuple[str, str]:
    where = str(found.get("where", ""))
    return PORT.get(where, str(found.get("port", ""))), where


def _inputs(found: Mapping[str, Any]) -> set[str]:
    return {str(name) for name in found.get("inputs") or ()} - {"direction"}


def _plain(value: Any) -> Any:
    """For a line of JSON: numbers of Python, None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value
