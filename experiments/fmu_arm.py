"""The arm of mujoco_arm.py with the muscles' FMU in FMPy.

python experiments/fmu_arm.py. Two instances of the one FMU, joined by the arm's own equation of motion.
"""

from __future__ import annotations

import atexit
import math
import shutil
import tempfile
from functools import cache
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from mujoco_arm import CONTRACTED, DAMPING, FOREARM, GRAVITY, INERTIA, LEVER, LOAD, SECONDS, TRICEPS, Held, biceps

import freelearn as fl

STEP = 5e-4


@cache
def exported() -> Path:
    """A folder with dmsp20.fmu, and what is in it as `unzipped`, gone when this process ends."""
    place = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    fl.actuators["dmsp20"].export(place / "dmsp20.fmu")
    fmpy.extract(str(place / "dmsp20.fmu"), str(place / "unzipped"))
    return place


def hold(wanted: float, begin: float) -> Held:
    """Where the arm comes to rest from `begin` [rad] under the pressures for an angle [rad]."""
    pressures = (biceps(fl.actuators["dmsp20"].load(), wanted), TRICEPS)
    about = fmpy.read_model_description(str(exported() / "dmsp20.fmu"))
    reference = {v.name: v.valueReference for v in about.modelVariables}
    given, told = [reference["elongation"], reference["pressure"]], [reference["force"]]
    pair = [_begun(about, name) for name in ("biceps", "triceps")]
    angle, speed = begin, 0.0
    for k in range(round(SECONDS / STEP)):
        forces = []
        for fmu, sign, pressure in zip(pair, (-1.0, 1.0), pressures, strict=True):
            fmu.setReal(given, [sign * LEVER * angle - CONTRACTED, pressure])
            fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
            forces += fmu.getReal(told)
        turning = LEVER * (forces[1] - forces[0]) - LOAD * GRAVITY * FOREARM * math.cos(angle)
        # Damping at the step's end: stable however large it is.
        speed = (speed + STEP * turning / INERTIA) / (1 + STEP * DAMPING / INERTIA)
        angle += STEP * speed
    for fmu in pair:
        fmu.terminate()
        fmu.freeInstance()
    return Held(wanted, angle, pressures)


def _begun(about, name: str) -> FMU2Slave:
    fmu = FMU2Slave(
        guid=about.guid,
        unzipDirectory=str(exported() / "unzipped"),
        modelIdentifier=about.coSimulation.modelIdentifier,
        instanceName=name,
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


if __name__ == "__main__":
    for wanted in (-0.2, 0.0, 0.3):
        held = hold(wanted, wanted + 0.1)
        print(f"wanted {held.wanted:+.3f} rad, reached {held.reached:+.6f} rad")
