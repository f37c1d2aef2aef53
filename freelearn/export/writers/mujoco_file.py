"""An actuator for MuJoCo: MJCF, its force law as a callback, and an affine approximation where no callback can go."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.data.beds import DEG, KPA, MM
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions, View
from freelearn.export.along import Along, each_followed
from freelearn.export.arithmetic.function import Function
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import ROUNDING, Reference, Samples, Written
from freelearn.export.writers.c_file import title
from freelearn.export.writers.mujoco_source import Motion, mjcf, module

OUTSIDE = (
    "`loads` of the module gives inside = 0 beyond the data and a status where there is no equilibrium; the callback "
    "goes on with what the model would say there. Controls are limited to the pressures of the data."
)
# The end block swings so often a second, and this share of critically damped.
HERTZ, DAMPED = 50.0, 0.7
# What hangs is followed for so long [s], and at rest once it moves by less than this share of its range in a hundredth.
LONGEST, STILL = 3.0, 1e-7
# What is allowed of them, a share of the range.
ALLOWED = {"commanded": ROUNDING, "moved": ROUNDING, "hung": 1e-3, "released": 1e-3}
# Steps of a way along which the pressure goes up and down twice.
WAY = 400
# States that the affine approximation is fitted to.
FITTED = 4000


def write_mujoco(functions: Functions, folder: Path, options: Options) -> Written:
    """NAME.xml, NAME_mujoco.py, NAME_affine.xml. Raises UserError for what answers with no loads."""
    needed("mujoco")
    view = functions.loads
    actuator = view.actuator
    if [p.name for p in actuator.answered] != ["force", "moment"]:
        said = " and ".join(p.name for p in actuator.answered)
        raise UserError(f"MuJoCo needs force and moment at a place, and this network answers with {said}: use to=onnx.")
    if functions.actuator.remembers and actuator is not functions.actuator:
        raise UserError(
            "MuJoCo needs loads at a place, and along a log this run answers with places: use to=c, onnx or fmu."
        )
    step = functions.step
    if step and any("earlier sample" in p.about for p in step.state):
        raise UserError(
            "A dead time keeps fewer samples than MuJoCo's steps of time would take: use to=c, onnx or fmu."
        )
    name, states, domain = options.name, actuator.states, actuator.domain
    pressures = [p.name for p in actuator.imposed[2:]]
    loads, motion = view.answer, _motion(view)
    length, radius = float(states.reference_length), float(states.outer_radius)
    files = [folder / f"{name}.xml", folder / f"{name}_mujoco.py"]
    write_text(files[0], mjcf(name, length, radius, domain, pressures, motion))
    write_text(files[1], module(name, title(functions, options), loads, pressures, step))
    more: dict[str, Any] = {}
    notes = ["Take the law with: from NAME_mujoco import Law, install; install(Law(model)).".replace("NAME", name)]
    if len(pressures) == 1:
        affine, error = _affine(view)
        files.append(folder / f"{name}_affine.xml")
        write_text(files[2], mjcf(name, length, radius, domain, pressures, motion, affine))
        more["affine"] = error
        told = ", ".join(f"{n} {e['root_mean_square']:.1%} (largest {e['largest']:.1%})" for n, e in error.items())
        notes.append(f"{name}_affine.xml needs no callback; over the data it is off by {told} of the range.")
    if any(p.name in ("dwell", "moved_length", "moved_twist") for p in loads.inputs):
        notes.append(
            "In a simulation no state lasts: effects that count how long one has lasted see it as just reached."
        )
    law = imported(files[1])
    more["simulated"] = simulated(files[0], law, view, step)
    follow = None
    if step:
        count = len(step.answered)

        def sample(x: np.ndarray, dt: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            found = np.array(law.step(*x.tolist(), dt, *state.tolist()), dtype=np.float64)
            return found[:count], found[count:]

        follow = each_followed(sample)

    def answers(x: np.ndarray) -> np.ndarray:
        return np.array([law.loads(*row) for row in x.tolist()], dtype=np.float64)

    broken = [
        f"MuJoCo's {what} state is off by {off:.1e} of the range (allowed {ALLOWED[what]:g})"
        for what, off in more["simulated"].items()
        if off is not None and not off <= ALLOWED[what]
    ]
    return Written(files, {loads.name: answers}, OUTSIDE, notes=notes, more=more, broken=broken, follow=follow)


def imported(path: Path) -> ModuleType:
    """The module that was written."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def simulated(path: Path, law: ModuleType, view: View, step: Function | None) -> dict[str, Any]:
    """What MuJoCo shows, headless: loads at commanded states, where a hung load comes to rest, and where the actuator
    goes once it is taken off; each with its largest difference from the fitted model, a share of the range. Of a log
    in place of both loads on the way, as the pressure goes up and down."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    own = law.Law(model)
    law.install(own)
    try:
        found: dict[str, Any] = {"commanded": _commanded(model, data, own, view)}
        low, high = np.array(view.actuator.domain).T
        place = (low + high) / 2 + (high - low) / 8
        if step:
            found["moved"] = _moved(model, data, own, Along(view.actuator, step))
        else:
            found |= _hung(model, data, own, view, place)
    finally:
        mujoco.set_mjcb_act_bias(None)
    return found


def _commanded(model: Any, data: Any, own: Any, view: View) -> float:
    import mujoco

    count, names = len(view.actuator.imposed), [p.name for p in view.inputs]
    x = Samples.from_actuator(view.actuator, names, 1, 200).inside
    x[:, count:] = 0.0
    want, got = Reference(view.actuator, x, names).answered[0], []
    for row in x:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = row[:2]
        data.ctrl[own.pressures] = row[2:count]
        mujoco.mj_forward(model, data)
        got.append(data.qfrc_actuator.copy())
    return float((np.abs(np.array(got) - want) / np.maximum(np.ptp(want, axis=0), 1e-300)).max())


def _moved(model: Any, data: Any, own: Any, along: Along) -> float:
    import mujoco

    mujoco.mj_resetData(model, data)
    low, high = np.array(along.actuator.domain).T
    data.qpos[:] = (low[:2] + high[:2]) / 2
    seen, got = [], []
    for share in (1 - np.cos(np.linspace(0.0, 4 * np.pi, WAY))) / 2:
        data.ctrl[own.pressures] = low[2:] + share * (high[2:] - low[2:])
        mujoco.mj_step(model, data)
        seen.append(own.key)
        got.append(own.answer[:2])
    x = np.array(seen)
    want = along.said(x[:, :-1], x[:, -1])
    return float((np.abs(np.array(got) - want) / np.maximum(np.ptp(want, axis=0), 1e-300)).max())


def _hung(model: Any, data: Any, own: Any, view: View, place: np.ndarray) -> dict[str, Any]:
    import mujoco

    actuator, names = view.actuator, [p.name for p in view.inputs]
    x = np.zeros((1, len(names)))
    x[0, : len(actuator.imposed)] = place
    load = Reference(actuator, x, names).answered[0][0]
    span = np.ptp(np.array(actuator.domain)[:2], axis=1)
    span[span == 0] = [1e-3, 0.1][: int((span == 0).sum())]
    found: dict[str, Any] = {}
    mujoco.mj_resetData(model, data)
    data.ctrl[own.pressures] = place[2:]
    # Nearby, so that of several places of rest it is this one.
    data.qpos[:] = place[:2] - 0.05 * span
    for what, hung in (("hung", -load), ("released", np.zeros(2))):
        data.qfrc_applied[:] = hung
        found[what] = None
        if own.memory:
            # What is remembered on the way there makes the place: the model's own that is next to it, with the same.
            if _at_rest(model, data, span):
                found[what] = _lacking(view, own.memory, data.qpos, -hung, place, span)
            continue
        want = _rest(actuator, -hung, place) if what == "released" else place[:2]
        # Only where the model itself has one place of rest is there anything to find.
        if want is not None and _at_rest(model, data, span):
            found[what] = float((np.abs(data.qpos - want) / span).max())
    return found


def _lacking(
    view: View, memory: dict[str, float], at: np.ndarray, load: np.ndarray, place: np.ndarray, span: np.ndarray
) -> float:  # fmt: skip
    """How far from a place (2,) the fitted model itself carries a load, a share of the span."""
    names = [p.name for p in view.inputs]
    x = np.array([[*at, *place[2:], *(memory[n] for n in names[len(place) :])]])
    reference = Reference(view.actuator, x, names)
    rate = reference.system.slopes(reference.x)[1][0, :, :2].numpy()
    step = np.linalg.solve(rate, load - reference.answered[0][0])
    return float((np.abs(step) / span).max())


def _at_rest(model: Any, data: Any, span: np.ndarray) -> bool:
    import mujoco

    steps = round(0.01 / model.opt.timestep)
    for _ in range(round(LONGEST / 0.01)):
        before = data.qpos.copy()
        for _ in range(steps):
            mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos).all():
            return False
        if (np.abs(data.qpos - before) < STILL * span).all():
            return True
    return False


def _rest(actuator: Actuator, load: np.ndarray, place: np.ndarray) -> np.ndarray | None:
    """Where the fitted model itself says that a load is carried; None where it does not, or in several places."""
    fitted = actuator.fitted
    pressures = {p.name: place[2 + i] for i, p in enumerate(actuator.imposed[2:])}
    asked = {f"{n}_kpa": v / KPA for n, v in pressures.items()} | {"force_n": load[0], "moment_nmm": 1e3 * load[1]}
    if not actuator.states.members:
        asked["sample"] = actuator.sample
    table = fitted.invert(pd.DataFrame([asked]), bands=False).table()
    row = table.iloc[0]
    if row["status"] != "ok" or row["solutions"] != 1:
        return None
    return np.array([row["elongation_mm"] * MM, row["twist_deg"] * DEG])


def _motion(view: View) -> Motion:
    """Mass and damping of an end block that swings as told on this actuator."""
    names = [p.name for p in view.inputs]
    reference = Reference(view.actuator, Samples.from_actuator(view.actuator, names, 2, 200).inside, names)
    rate = reference.system.slopes(reference.x)[1].numpy()
    stiff = [max(float(np.nanmax(np.abs(rate[:, i, i]))), 1e-9) for i in (0, 1)]
    turned = 2 * np.pi * HERTZ
    damping = (2 * DAMPED * stiff[0] / turned, 2 * DAMPED * stiff[1] / turned)
    return Motion(stiff[0] / turned**2, stiff[1] / turned**2, damping)


def _affine(view: View) -> tuple[tuple[list[float], list[float]], dict[str, dict[str, float]]]:
    """(g0 + g1 q) P + b0 + b1 q of force and moment, q the actuator's own joint, and what it is off by, shares."""
    names = [p.name for p in view.inputs]
    x = Samples.from_actuator(view.actuator, names, 3, FITTED).inside
    x[:, 3:] = 0.0
    y, status = Reference(view.actuator, x, names).answered
    x, y = x[status == 0], y[status == 0]
    found, error = [], {}
    for i, port in enumerate(view.actuator.answered):
        q, pressure = x[:, i], x[:, 2]
        terms = np.stack([pressure, q * pressure, np.ones_like(q), q], axis=1)
        size = np.maximum(np.abs(terms).max(0), 1e-300)
        best = np.linalg.lstsq(terms / size, y[:, i], rcond=None)[0] / size
        missed = (terms @ best - y[:, i]) / max(np.ptp(y[:, i]), 1e-300)
        found.append(best.tolist())
        error[port.name] = {
            "root_mean_square": float(np.sqrt((missed**2).mean())),
            "largest": float(np.abs(missed).max()),
        }
    return (found[0], found[1]), error
