"""Hidden effects in the forms of the literature, solved numerically: not the formulas of the package.

Data made so can refute the package's formulas, which shorten these forms. What each of them leaves of the change that
the literature's form makes, squared and after refitting C1 and C2, with the best parameters that it has (median and
most of eight pairs of random actuators; `python experiments/hidden_effects/forms.py` prints it):

relaxation (`history`): 0.3 %, at most 2 %. The package lets the whole present stress be as old as the state; here each
    step of pressure adds a stress of its own age. The move to the state strains the wall most, hence the likeness.
stress_softening (`history`): 1 %, at most 5 %. The package softens the whole wall by the energy of a thin tube of the
    mean radius; here each point softens by the energy that it stores.
friction_hysteresis (`rubbing`): nothing, as long as steps of pressure are long beside the sliding distance and contacts
    begin afresh in each state. Were friction carried along to a state's first row ("carried": 1) it would be 15 %.
twist_slack (`backlash`): 0.03 % from the contact's giving way; 39 % for an actuator whose moment rises with twist:
    there the package rests at the place of balance that drives away, where nothing stays; here it snaps to an edge.
fiber_dispersion (`fiber_density`): nothing, the structure tensor is the mean over the density. Where each fiber stores
    its own energy ("each_fiber": 1, Lanir 1983) 96 %: that the strains scatter then outweighs that their mean changes.

end_taper (`braided`): 0.001 %, at most 0.05 %, of cones that are sharp at rest too.
threshold_pressure (`braided`): nothing, as long as no pressure is near it; there the package rounds off what is a kink.
motion_friction (`driven`): nothing, the last move alone slides them.
contact_friction (`braided`, `rubbing`): nothing, like the other friction.
strand_jamming (`braided`): each family's strands as they lie; without twist nothing.
buckling (`braided`): Euler's load is a kink here; at it the package has two thirds of it.
bladder_slack (`braided`): nothing, the same potential, its least value by bisection.
viscoelasticity (`lagging`): τ 30 s, 6 %, at most 11 %; 60 s, 8 and 14 %: of moves as long as the bed's the wall's loads
    are not linear, which one shifted place is. τ 150 s, as long as a state: 20 and 28 %, because the package forgets
    all moves but the last.
off_axis (`leaning`): nothing, it is geometry.

All other effects are the bed's: their forms are definitions (offsets, gains), or solved apart from the package.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from freelearn.testing.reference.backlash import rubbed, settled
from freelearn.testing.reference.braided import bent, beyond_threshold, contact, jammed, tapered, unfilled
from freelearn.testing.reference.lagging_walls import overstress
from freelearn.testing.reference.material_points import Points
from freelearn.testing.reference.remembering_walls import Law, Memory, loads, remembered
from freelearn.testing.reference.total_energy import Effects, driven
from freelearn.testing.reference.truths import grown as grown_package

Array = np.ndarray[Any, Any]

# As truths.UNIT and truths.FIXED, of the effects whose literature's form has other parameters than the package's.
UNIT: dict[str, dict[str, float]] = {"stress_softening": {"inverse_r": 0.02}}
FIXED: dict[str, dict[str, float]] = {
    # m in units of C1: graded over what the points store, which is some tenths of C1.
    "stress_softening": {"energy": 0.05},
    "friction_hysteresis": {"sliding": 2e3},
    "contact_friction": {"sliding": 2e3},
    "twist_slack": {"stiffness": 1e3},
}
MOST = {"inverse_r": 0.9}
# Rounds until the play that is taken up and what the wall remembers agree.
ROUNDS, SETTLED = 20, 1e-9


def grown(effect: str, amount: float) -> dict[str, float]:
    """The effect's parameters at `amount` times their unit, at most at their physical bound."""
    if effect in UNIT:
        values = {p: min(amount * v, MOST[p]) for p, v in UNIT[effect].items()}
    else:
        values = grown_package(effect, amount)
    return values | FIXED.get(effect, {})


def on_the_rig(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array]:
    """As bed.on_the_rig: loads (N, 2) that mounted actuators hand on, and equilibrium, (N,)."""
    s = beyond_threshold(s, fx, sharp=True)
    law = Law(c1, c2, fx)

    def at(twist: Array) -> Points:
        return Points.from_state(s | {"twist": twist}, fx)

    twist, lagging = s["twist"], _lagging(s, law)
    memory = remembered(at(twist), law, s)
    if "twist_slack" in fx:
        twist, memory = _taken_up(s, law, memory, at, lagging)
    bare, balanced = loads(at(twist), law, memory)
    straight = bare + _beside(s | {"twist": twist}, fx) + lagging
    return bent(straight, s, fx, sharp=True), balanced


def _lagging(s: dict[str, Array], law: Law) -> Array | float:
    """Loads (N, 2) of walls that lag behind the moves of the bed."""
    p = law.fx.get("viscoelasticity")
    if p is None:
        return 0.0
    resting = Points.from_state(s | {"pressure": 0 * s["pressure"]}, law.fx)
    virgin = Memory(np.zeros(resting.radius.shape), np.zeros((4, *resting.radius.shape)))
    return overstress(loads(resting, law, virgin)[0], s["sample"], s["clock"], p["share"], p["time"])


def _beside(s: dict[str, Array], fx: Effects) -> Array:
    """Loads (N, 2) beside the tube's own: of its ends, less the friction."""
    rub = fx.get("friction_hysteresis", {})
    dry = _rubbed(s, fx, "friction_hysteresis")[:, None] * np.array([rub.get("force", 0.0), rub.get("moment", 0.0)])
    ends = tapered(s, fx) + unfilled(s, fx) + jammed(s, fx, apart=True)
    return np.asarray(ends - dry - driven(s, fx) - contact(s, fx, _rubbed(s, fx, "contact_friction")))


def _rubbed(s: dict[str, Array], fx: Effects, effect: str) -> Array:
    """Share of an effect's friction that acts, (N,)."""
    p = FIXED[effect] | dict(fx.get(effect, {}))
    return rubbed(s["pressure"], s["dwell"] == 0, p["sliding"], bool(p.get("carried")), bool(p.get("vented")))


def _taken_up(
    s: dict[str, Array], law: Law, memory: Memory, at: Callable[[Array], Points], lagging: Array | float
) -> tuple[Array, Memory]:
    """Twist (N,) at which actuators rest in their play, and what their walls remember of having been there."""
    p = FIXED["twist_slack"] | dict(law.fx["twist_slack"])
    twist = s["twist"]
    for _ in range(ROUNDS):
        before, past = twist, memory

        def moment(place: Array, past: Memory = past) -> Array:
            beside = _beside(s | {"twist": place}, law.fx) + lagging
            return np.asarray((loads(at(place), law, past)[0] + beside)[:, 1])

        twist = settled(s["twist"], s["sample"], p["angle"], p["stiffness"], moment)
        memory = remembered(at(twist), law, s)
        if not law.remembers or np.abs(twist - before).max() <= SETTLED:
            break
    return twist, memory
