"""What really happens on the bed: loads of a data set's actuators with what is hidden in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from beyond_library import tube
from beyond_library.kind import ONE, Array, Kind

from freelearn.testing.reference import literature
from freelearn.testing.reference.total_energy import STEP, Effects, bed_loads

# As freelearn.testing.reference.total_energy.state_of.
States = dict[str, Array]
FIELD = {"fiber_angle": "gamma", "outer_radius": "outer", "reference_length": "reference"}
INVARIANT = {"i1": 3.0, "i2": 3.0, "i4": 1.0}


@dataclass(frozen=True)
class Hidden:
    """A kind with its shape, at `amount` units."""

    kind: Kind
    shape: Mapping[str, float] = field(default_factory=dict)
    amount: float = 0.0

    def value(self, inputs: Mapping[str, Array]) -> Array:
        """What the kind adds, in SI."""
        value = self.kind.function(inputs, self.shape)
        return np.asarray(self.amount * self.shape.get("sign", 1.0) * self.kind.unit * value)

    def at(self, *ports: str) -> bool:
        """Whether it is at one of these ports."""
        return self.amount != 0 and self.kind.port in ports


@dataclass(frozen=True)
class Truth:
    """material: C1, C2 [Pa]. hidden: kinds of physics that are in no library. effects: of the library, in the forms of
    the literature; not beside an energy, whose tube knows none."""

    material: tuple[float, float]
    hidden: tuple[Hidden, ...] = ()
    effects: Effects = field(default_factory=dict)

    def loads(self, s: States) -> tuple[Array, Array]:
        """Force [N] and moment [N·m] that the cells show without noise, (N, 2), and equilibrium, (N,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            shown, balanced = self._shown(s)
        return shown, np.asarray(balanced & np.isfinite(shown).all(1))

    def _shown(self, s: States) -> tuple[Array, Array]:
        loads, balanced = self._borne(s)
        pulls = sum((_slopes(each, s) for each in self.hidden if each.at("parallel") and _both(each)), 0 * loads)
        inputs = _inputs(s) | {"force": loads[:, 0] / ONE["force"], "moment": loads[:, 1] / ONE["moment"]}
        loads = loads - pulls
        for each in self.hidden:
            if each.at("parallel", "dissipation", "measurement") and not _both(each):
                added = each.value(inputs) * (-s["direction"] if each.kind.port == "dissipation" else 1.0)
                loads[:, 0 if each.kind.where in ("force", "axial") else 1] += added
        return loads, balanced

    def _borne(self, s: States) -> tuple[Array, Array]:
        """By the tube, where it really is, as it really is."""
        inputs = _inputs(s)
        for each in self.hidden:
            if each.at("boundary", "geometry"):
                name = FIELD.get(each.kind.where, each.kind.where)
                s = s | {name: s[name] + each.value(inputs)}
        energies = [each for each in self.hidden if each.at("energy")]
        if not energies:
            return bed_loads(s, *self.material, self.effects, None, literature.on_the_rig)

        def psi(invariants: Mapping[str, Array]) -> Array:
            shown = {name: (value - INVARIANT[name]) / ONE[name] for name, value in invariants.items()}
            return np.asarray(sum(each.value(shown) for each in energies))

        return tube.loads(s, *self.material, psi)


def _both(hidden: Hidden) -> bool:
    """Whether it is a potential of length and twist."""
    return hidden.kind.where == "both"


def _slopes(hidden: Hidden, s: States) -> Array:
    """∂V/∂(l, φ) of a parallel element's potential, (N, 2)."""
    moved = (s | {"length": s["length"] + 1j * STEP}, s | {"twist": s["twist"] + 1j * STEP})
    return np.stack([hidden.value(_inputs(each)).imag / STEP for each in moved], axis=1)


def _inputs(s: States) -> dict[str, Array]:
    """What functions may depend on, as numbers of order one."""
    shown = {"elongation": s["length"] - s["reference"], "time": s["clock"]}
    shown |= {name: s[name] for name in ("twist", "pressure", "direction")}
    return {name: value / ONE[name] for name, value in shown.items()}
