"""An arm of two antagonist muscles in MuJoCo that holds a load by feed-forward pressures.

python experiments/mujoco_arm.py. Both muscles are the package's `dmsp20`. Nothing is fed back: the biceps' pressure is
the one that the fitted model itself asks for (`invert`), for the force that balances the load and the triceps.
"""

from __future__ import annotations

import importlib.util
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pandas as pd

import freelearn as fl

# Lever of both muscles [m], how much each is contracted at 0 rad [m], the load [kg] on the forearm [m] it hangs on.
LEVER, CONTRACTED, LOAD, FOREARM = 0.03, 0.04, 4.0, 0.3
# Damping of the elbow [N m s/rad], and the inertia about it [kg m²].
DAMPING, INERTIA = 5.0, LOAD * FOREARM**2 + 1e-3
GRAVITY, TRICEPS, SECONDS = 9.81, 150e3, 4.0

ARM = f"""
<mujoco model="arm">
  <option timestep="5e-4" gravity="0 0 -{GRAVITY}" integrator="implicitfast"/>
  <worldbody><body name="forearm">
    <joint name="elbow" type="hinge" axis="0 -1 0" damping="{DAMPING}"/>
    <inertial pos="{FOREARM} 0 0" mass="{LOAD}" diaginertia="1e-3 1e-3 1e-3"/>
  </body></worldbody>
  <tendon>
    <fixed name="biceps"><joint joint="elbow" coef="-{LEVER}"/></fixed>
    <fixed name="triceps"><joint joint="elbow" coef="{LEVER}"/></fixed>
  </tendon>
  <actuator>
    <general name="biceps" tendon="biceps" gaintype="fixed" gainprm="0" biastype="user"/>
    <general name="triceps" tendon="triceps" gaintype="fixed" gainprm="0" biastype="user"/>
    <general name="biceps_pressure" joint="elbow" gainprm="0" biasprm="0"/>
    <general name="triceps_pressure" joint="elbow" gainprm="0" biasprm="0"/>
  </actuator>
</mujoco>
"""


class Held(NamedTuple):
    """angle wanted and reached [rad]; pressures commanded [Pa], biceps and triceps."""

    wanted: float
    reached: float
    pressures: tuple[float, float]


def hold(wanted: float, begin: float) -> Held:
    """Where the arm comes to rest from `begin` [rad] under the pressures for an angle [rad]."""
    muscle = fl.actuators["dmsp20"]
    run = muscle.load()
    pressures = (biceps(run, wanted), TRICEPS)
    with tempfile.TemporaryDirectory() as folder:
        muscle.export(Path(folder) / "dmsp20.xml")
        law = _module(Path(folder) / "dmsp20_mujoco.py")
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qpos[0] = begin
    names = ("biceps", "triceps")
    law.install(*(law.Law(model, n, None, [f"{n}_pressure"], rest=CONTRACTED) for n in names))
    try:
        for name, pressure in zip(names, pressures, strict=True):
            data.ctrl[model.actuator(f"{name}_pressure").id] = pressure
        for _ in range(round(SECONDS / model.opt.timestep)):
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_act_bias(None)
    return Held(wanted, float(data.qpos[0]), pressures)


def biceps(run: fl.FittedRun, angle: float) -> float:
    """The biceps' pressure [Pa] that holds the load at an angle [rad] against the triceps."""
    still = {"sample": 1, "twist_deg": 0.0}
    stretched = 1e3 * (LEVER * angle - CONTRACTED)
    triceps = run.predict(pd.DataFrame([still | {"elongation_mm": stretched, "pressure_kpa": TRICEPS / 1e3}])).loads[
        0, 0
    ]
    # Levers of opposite sign: what is wanted of the biceps is the triceps' force less the load's over the lever.
    force = triceps - LOAD * GRAVITY * FOREARM * math.cos(angle) / LEVER
    asked = still | {"elongation_mm": 1e3 * (-LEVER * angle - CONTRACTED), "force_n": force}
    row = run.invert(pd.DataFrame([asked]), bands=False).table().iloc[0]
    if row["status"] != "ok":
        raise fl.UserError(f"No pressure holds the load there: {row['note']}")
    return float(1e3 * row["pressure_kpa"])


def _module(path: Path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


if __name__ == "__main__":
    for wanted in (-0.2, 0.0, 0.3):
        held = hold(wanted, wanted + 0.1)
        kpa = np.round(np.array(held.pressures) / 1e3, 1)
        print(f"wanted {held.wanted:+.3f} rad, reached {held.reached:+.6f} rad, at {kpa[0]} and {kpa[1]} kPa")
