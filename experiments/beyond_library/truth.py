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
class Truth:
    """material: C1, C2 [Pa]. Hidden is a kind with its shape, at `amount` units, or effects of the library in the
    forms of the literature, or nothing."""

    material: tuple[float, float]
    kind: Kind | None = None
    shape: Mapping[str, float] = field(default_factory=dict)
    amount: float = 0.0
    effects: Effects = field(default_factory=dict)

    def loads(self, s: States) -> tuple[Array, Array]:
        """Force [N] and moment [N·m] that the cells show without noise, (N, 2), and equilibrium, (N,)."""
        if self.kind is None or self.amount == 0:
            return bed_loads(s, *self.material, self.effects, None, literature.on_the_rig)
        with np.errstate(over="ignore", invalid="ignore"):
            shown, balanced = self._acting(self.kind, s)
        return shown, np.asarray(balanced & np.isfinite(shown).all(1))

    def _acting(self, kind: Kind, s: States) -> tuple[Array, Array]:
        port, where = kind.port, kind.where
        if port == "energy":
            return tube.loads(s, *self.material, self._psi)
        if port in ("boundary", "geometry"):
            name = FIELD.get(where, where)
            return self._bare(s | {name: s[name] + self._value(_inputs(s))})
        loads, balanced = self._bare(s)
        if where == "both":
            return loads - self._slopes(s), balanced
        inputs = _inputs(s) | {"force": loads[:, 0] / ONE["force"], "moment": loads[:, 1] / ONE["moment"]}
        added = self._value(inputs) * (-s["direction"] if port == "dissipation" else 1.0)
        first = where in ("force", "axial")
        return loads + np.stack([added, 0 * added] if first else [0 * added, added], axis=1), balanced

    def _bare(self, s: States) -> tuple[Array, Array]:
        return bed_loads(s, *self.material, {}, None, literature.on_the_rig)

    def _value(self, inputs: Mapping[str, Array]) -> Array:
        """What the kind adds, in SI."""
        assert self.kind is not None
        value = self.kind.function(inputs, self.shape)
        return np.asarray(self.amount * self.shape.get("sign", 1.0) * self.kind.unit * value)

    def _psi(self, invariants: Mapping[str, Array]) -> Array:
        return self._value({name: (value - INVARIANT[name]) / ONE[name] for name, value in invariants.items()})

    def _slopes(self, s: States) -> Array:
        """∂V/∂(l, φ) of a parallel element's potential, (N, 2)."""
        moved = (s | {"length": s["length"] + 1j * STEP}, s | {"twist": s["twist"] + 1j * STEP})
        return np.stack([self._value(_inputs(each)).imag / STEP for each in moved], axis=1)


def _inputs(s: States) -> dict[str, Array]:
    """What functions may depend on, as numbers of order one."""
    shown = {"elongation": s["length"] - s["reference"], "time": s["clock"]}
    shown |= {name: s[name] for name in ("twist", "pressure", "direction")}
    return {name: value / ONE[name] for name, value in shown.items()}
