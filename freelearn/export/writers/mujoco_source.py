"""MJCF of an actuator, and the Python module that is its force law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from freelearn.export.arithmetic.function import Function
from freelearn.export.writers.python_source import HELPERS, python_function

LAW = '''\


class Law:
    """The force law on two actuators of a MuJoCo model, by the names in NAME.xml, or by others.

    force, moment: actuators whose bias is "user", over a slide joint or a tendon, and over a hinge (None: no twist).
    pressures: actuators whose control is the pressure [Pa]. rest: of a tendon its length at zero elongation [m].
    Rising or falling pressure, and what else the actuator remembers, is followed from step to step.
    """

    def __init__(self, model, force="{name}_force", moment="{name}_moment", pressures={pressures}, rest=0.0):
        self.force = model.actuator(force).id
        self.moment = None if moment is None else model.actuator(moment).id
        self.pressures = [model.actuator(p).id for p in pressures]
        self.rest, self.memory, self.key, self.answer = rest, dict(MEMORY), None, None
        self.before = None

    def _imposed(self, data):
        length = float(data.actuator_length[self.force]) - self.rest
        twist = 0.0 if self.moment is None else float(data.actuator_length[self.moment])
        pressures = [float(data.ctrl[i]) for i in self.pressures]
        return length, twist, pressures

{loads}

def install(*laws):
    """Makes MuJoCo ask these laws: its one callback of actuators' biases."""
    import mujoco

    where = {{law.force: (law, 0) for law in laws}}
    where |= {{law.moment: (law, 1) for law in laws if law.moment is not None}}

    def bias(model, data, number):
        if number not in where:
            return 0.0
        law, place = where[number]
        return law.loads(data)[place]

    mujoco.set_mjcb_act_bias(bias)
'''


# What asks for loads: of each state by itself, and of samples of a log.
STEADY = '''\
    def loads(self, data):
        """Everything that `loads` gives, at the model's present state."""
        length, twist, pressures = self._imposed(data)
        key = (length, twist, *pressures, data.time)
        if key != self.key:
            if self.before is None or data.time < self.before[0]:
                self.memory = dict(MEMORY)
            elif data.time > self.before[0]:
                self._remember(pressures, data.time)
            self.before = (data.time, pressures)
            self.answer = loads(length, twist, *pressures, **self.memory)
            self.key = key
        return self.answer

    def _remember(self, pressures, time):
        for i, (now, then) in enumerate(zip(pressures, self.before[1]), start=1):
            name = f"direction_{i}" if f"direction_{i}" in self.memory else "direction"
            if name in self.memory and now != then:
                self.memory[name] = math.copysign(1.0, now - then)
        if "clock" in self.memory:
            self.memory["clock"] = time
        worst = [name for name in self.memory if name.startswith("worst_severity")]
        for name, value in zip(worst, self.answer[len(self.answer) - len(worst) :]):
            self.memory[name] = value
'''
ALONG = '''\
    def loads(self, data):
        """Everything that `step` answers, at the model's present state: each of its times is a sample."""
        length, twist, pressures = self._imposed(data)
        key = (length, twist, *pressures, data.time)
        if key != self.key:
            if self.before is None or data.time < self.before:
                self.state, self.dt = STATE, 1.0
            elif data.time > self.before:
                self.state, self.dt = self.after, data.time - self.before
            self.before = data.time
            found = step(length, twist, *pressures, self.dt, *self.state)
            self.answer, self.after = found[: -len(STATE)], found[-len(STATE) :]
            self.key = key
        return self.answer
'''


@dataclass(frozen=True)
class Motion:
    """What the MJCF's end block is made of, so that it swings at the told frequency: mass [kg], inertia [kg m²] and the
    joints' damping [N s/m, N m s/rad]."""

    mass: float
    inertia: float
    damping: tuple[float, float]


def module(name: str, title: str, f: Function, pressures: Sequence[str], step: Function | None) -> str:
    """NAME_mujoco.py: the force law, with nothing but Python's own library until it is installed. step: of a log."""
    memory = {p.name: 0.0 for p in f.inputs[2 + len(pressures) :]}
    # An effect that counts how long a state has lasted: in a simulation no state lasts.
    names = tuple(f"{name}_{p}" for p in pressures)
    about = f"The force law behind {name}.xml: install(Law(model)) before mujoco.mj_step."
    head = f'"""{title}.\n\n{about}"""\n\nimport math\n\n'
    return (
        head
        + f"MEMORY = {memory!r}\n"
        + (f"STATE = (0.0,) * {step.carried}\n" if step else "")
        + HELPERS
        + "\n\n"
        + python_function(f)
        + (f"\n\n{python_function(step)}" if step else "")
        + LAW.format(name=name, pressures=repr(names), loads=ALONG if step else STEADY)
    )


def mjcf(
    name: str,
    length: float,
    radius: float,
    domain: Sequence[tuple[float, float]],
    pressures: Sequence[str],
    motion: Motion,
    affine: tuple[Sequence[float], Sequence[float]] | None = None,
) -> str:
    """NAME.xml: the actuator's end block on a slide and a hinge; with `affine` (g0, g1, b0, b1 of force and moment) the
    approximation that needs no callback, whose two controls are both the pressure."""
    wide = [f"{low:.9g} {high:.9g}" for low, high in domain]
    slide, hinge = f"{name}_elongation", f"{name}_twist"
    if affine is None:
        driven = [
            f'<general name="{name}_{p}" joint="{slide}" gainprm="0" biasprm="0" ctrllimited="true" ctrlrange="{w}"/>'
            for p, w in zip(pressures, wide[2:], strict=True)
        ]
        driven += [
            f'<general name="{name}_{what}" joint="{joint}" gaintype="fixed" gainprm="0" biastype="user"/>'
            for what, joint in (("force", slide), ("moment", hinge))
        ]
    else:
        driven = [
            f'<general name="{name}_{what}" joint="{joint}" gaintype="affine" gainprm="{a[0]:.12g} {a[1]:.12g} 0" '
            f'biastype="affine" biasprm="{a[2]:.12g} {a[3]:.12g} 0" ctrllimited="true" ctrlrange="{wide[2]}"/>'
            for what, joint, a in zip(("force", "moment"), (slide, hinge), affine, strict=True)
        ]
    inertia = " ".join([f"{motion.inertia:.6g}"] * 3)
    return f"""<mujoco model="{name}">
  <option timestep="1e-4" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <site name="{name}_mount" pos="0 0 0"/>
    <body name="{name}_end" pos="0 0 {length:.9g}">
      <joint name="{slide}" type="slide" axis="0 0 1" damping="{motion.damping[0]:.6g}"/>
      <joint name="{hinge}" type="hinge" axis="0 0 1" damping="{motion.damping[1]:.6g}"/>
      <inertial pos="0 0 0" mass="{motion.mass:.6g}" diaginertia="{inertia}"/>
      <geom type="cylinder" size="{radius:.6g} {radius / 4:.6g}" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    {(chr(10) + "    ").join(driven)}
  </actuator>
</mujoco>
"""
