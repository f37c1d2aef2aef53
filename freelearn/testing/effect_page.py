"""docs/effects.md, made from the classes: `python -m freelearn.testing.effect_page > docs/effects.md`."""

from __future__ import annotations

from typing import Any

from freelearn.data.beds import BEDS
from freelearn.physics.chain.effect import FAMILIES, Effect
from freelearn.physics.effects.registry import EFFECTS

HEAD = """# The effects

Each is a part that plugs into one place of the chain: *boundary* (what state was really imposed) → *geometry* (what
actuator it really is) → *energy* (wall and fiber) → *dissipation* → *measurement*; *history* acts along a
log. With its parameters at no effect the model is unchanged to the last bit (with an energy: to rounding). Which models
have which of these places:

{families}

Standard forms and sources stand in each effect's docstring (`freelearn/physics/effects/`, a folder for each port);
[what each does to F and M](#what-each-does) over the kinematic plane stands in pictures below.

**per sample**: where a training set holds several samples, what is set by building or mounting a sample (offsets of the
mounting, play, fiber angle, wall thickness, friction) has one value for each of them, and so have the zeros of load
cells and gauges, which are set anew when a sample is mounted. What belongs to the rig (gains of load cells and gauges,
the stiffness of shaft and stage), to the material or to fittings that all samples share has one value: tubes of several
stocks are an effect, `wall_modulus`, and so are fibers of several, `fiber_modulus`, and gains that change from sample
to sample, `own_force_gain`, `own_moment_gain` and `own_pressure_gain`, whose values are those beyond the first
sample's.

**beds**: those on which an effect can be told ([what a bed imposes and measures](glossary.md)); on another one the
search says that it cannot be tested.

Relaxation and stress softening act on the stresses of the wall, never on the fluid's thrust. With play the actuator
rests, within the band, where its own moment (wall, fluid and friction) is nearest zero. `sensor_drift` needs the time
of each row: a table without `time_s` is taken to have 20 s from row to row, and a run with this effect says so; a
log's runs whose times begin anew are laid end to end.
`off_axis` tells d², the square of the distance: 1e-4 m² is d = √(d²) = 10 mm. On an end block each member has its own.
`block_tilt` is asked of several actuators on one end block alone, `wall_modulus` and `fiber_modulus` of such or of
several samples, unless `per_sample=false` says that they are of one stock; their pictures are those of one actuator,
which the first lifts as a mount that gives way does, and whose C1, or C2, the others change. The three gains that are
each sample's own are asked of several samples alone: of actuators on one end block `pressure_gain` has each one's.
`motion_friction` is told by states that the bed went to from either side, under one pressure each: a sweep of the
length, forth and back.
`viscoelasticity` needs the times too, and states in the order in which the bed went to them, buckled and left-out ones
included. It knows the last move alone: where states last less than τ, earlier ones are felt, and not told.

Effects of the *history* act in [logs](logs.md) alone, tables with `time_s` and `run`: on the pressure, on the wall's
stresses, on the loads or on the readings, as their docstrings say. They carry a state from sample to sample.

An effect of one's own at the boundary writes `impose`, the state of the actuator from that of the table. Where the
actuator then moves otherwise than its mount (a lever, a gear) it also writes `hand_on`: the loads on the mount from the
actuator's, so that both do the same work.

| port | name | parameters | per sample | beds | when to suspect it |
|---|---|---|---|---|---|
"""

PICTURES = """
## What each does

Each picture shows by how much an effect changes force and moment over the kinematic plane, at the values in its title
(the scale of its parameters), for the simulated sample 4 at half of the protocol's pressure, while the pressure rises
(`motion_friction`: before it does).
Red: more; blue: less; white: little beside the largest change. Effects of time, of order and of the past are shown
after a last move of 1 mm and 10° and a minute at the state, a third of a day after the first row, and with the
harshest state visited before. Effects of the history are shown along a recording, two quick steps of the pressure,
between them a stretch of 1 mm for three seconds, then slow ramps up, down and half up again: the force with the effect
and without it, what changes, and loops over the pressure.
`python experiments/effect_gallery.py` draws them, and your own effects with them, in `outputs/effects`.
"""


def effects_page() -> str:
    """The page: what ports are, which models have them, and one row per effect of the library."""
    families = "\n".join(f"- {_family(name)}: {', '.join(ports)}" for name, ports in FAMILIES.items())
    library = [effect for effect in EFFECTS.values() if in_library(effect)]
    table = "".join(map(_row, library))
    pictures = [_picture(effect) for effect in library]
    return HEAD.format(families=families) + table + PICTURES + "".join(pictures)


def in_library(effect: type[Effect[Any]] | Effect[Any]) -> bool:
    """Whether an effect is one of the library's, and no user's own."""
    return effect.__module__.startswith("freelearn.physics.effects.")


def _picture(effect: type[Effect[Any]]) -> str:
    """Where the picture is missing, its words still stand."""
    along = effect.port == "history"
    words = f"what {effect.name} does to force{' along a recording' if along else ' and moment over length and twist'}"
    return f"\n### {effect.name}\n\n![{words}](effects/{effect.name}.png)\n"


def _family(name: str) -> str:
    return "a model of one's own" if name == "own" else f"`{name}`"


def _row(effect: type[Effect[Any]]) -> str:
    parameters = effect.declared_parameters()
    declared = ", ".join(f"{p.name} [{p.unit}]" for p in parameters)
    own = "yes" if any(p.per_sample for p in parameters) else "no"
    return f"| {effect.port} | `{effect.name}` | {declared} | {own} | {beds_of(effect)} | {effect.suspect} |\n"


def beds_of(effect: type[Effect[Any]]) -> str:
    """The beds on which an effect can be told, in words; those on which it cannot, where they are fewer.

    >>> beds_of(EFFECTS["end_clamps"]), beds_of(EFFECTS["twist_slack"])
    ('all', 'all but dead_load')
    """
    lacking = [name for name in BEDS if effect.untold(name)]
    if not lacking:
        return "all"
    if len(lacking) == 1:
        return f"all but {lacking[0]}"
    return ", ".join(name for name in BEDS if name not in lacking)


if __name__ == "__main__":
    print(effects_page(), end="")
