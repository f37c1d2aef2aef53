"""How the loads answer to a push at every place of the chain, and what each input is in every row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.derivatives import Build, none_vector
from freelearn.discovery.fits.white_fit import ONE, WhiteFit
from freelearn.discovery.residuals.hysteresis import FEWEST_COMPARISONS, comparisons
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.effect import FAMILIES
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import lent
from freelearn.physics.mechanics.equilibrium import inflate
from freelearn.physics.mechanics.layers import Deformation, Layers
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.written.forms import Form
from freelearn.physics.written.places import PLACES, TIME, Input, Place, round_scale
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import Written

CONSTANT = Form("constant", "constant", ("torch.ones_like({x})",), "{a}")
AT_REST = {"i1": 3.0, "i2": 3.0, "i4": 1.0}
# Layers of the wall at which its strains are looked at.
LAYERS = 8
# Values of an input nearer to each other than this share of its scale are one level.
LEVEL = 0.02
# Beyond this share of its scale, on both sides, an input has both signs.
SIGNED = 0.05
# Visits of states below which the time is no input of a form.
FEWEST_VISITS = 10


@dataclass(frozen=True)
class Pushes:
    """A fit's rows as an unknown function sees them.

    places: where something unknown may enter. by: derivatives of the readings by what the function changes at each of
    them, (N, 2, m) for m actuators; none for energies and potentials. inputs: their values by name, (N, m) SI; scales:
    what each counts in, SI."""

    places: Sequence[Place]
    by: dict[str, Tensor]
    inputs: dict[str, Tensor]
    scales: dict[str, float]

    def scaled(self, i: Input) -> Tensor:
        """An input in units of its scale, (N, m)."""
        return self.inputs[i.name] / self.scales[i.name]

    def signed(self, i: Input) -> bool:
        """Whether it has values of both signs, more than errors of measuring make."""
        x = self.scaled(i)
        return float(x.min()) < -SIGNED and float(x.max()) > SIGNED

    def levels(self, i: Input) -> Tensor:
        """The levels at which an input was measured, rising, in units of its scale, (k,): values that lie near each
        other are one, and where they lie everywhere there is one for each LEVEL."""
        x = self.scaled(i).reshape(-1).sort().values
        levels: list[float] = []
        for group in torch.tensor_split(x, (torch.nonzero(x.diff() > LEVEL)[:, 0] + 1)):
            low, high = float(group[0]), float(group[-1])
            count = int((high - low) / LEVEL)
            levels += [float(group.mean())] if count < 2 else torch.linspace(low, high, count + 1).tolist()
        return torch.tensor(levels, dtype=x.dtype)

    def told(self, i: Input) -> bool:
        """Whether the input is there, and differs from row to row."""
        if i.name not in self.inputs:
            return False
        values = self.inputs[i.name]
        return float(values.max() - values.min()) > 1e-3 * float(values.abs().max())


def pushes(fit: WhiteFit, rows: Rows, build: Build, clocked: bool = True) -> Pushes:
    """At a fit. build: names → the fit's model with these effects more. clocked: see Question."""
    places = places_of(fit.model, rows)
    members = len(rows.states.members)
    probes = {
        place.name: Written(place, (place.inputs[0],), (1.0,), CONSTANT, {"amount": 0.0}, each=bool(members))
        for place in places
        if not (place.energy or place.potential)
    }
    kinds = {name: effect_class(probe) for name, probe in probes.items()}
    with lent(kinds.values()):
        model = build([kind.name for kind in kinds.values()])
        labels = model.labels()
        raw = Problem(model, rows, ONE).jacobians(none_vector(model, fit)[None])[0].reshape(len(rows), 2, -1)
    by = {
        name: raw[:, :, [i for i, label in enumerate(labels) if label.startswith(f"{kind.name}.amount")]]
        for name, kind in kinds.items()
    }
    inputs = _inputs(fit, rows) | _strains(fit, rows)
    if not clocked or _few_visits(rows):
        inputs.pop(TIME.name, None)
    return Pushes(places, by, inputs, {name: round_scale(values) for name, values in inputs.items()})


def _few_visits(rows: Rows) -> bool:
    """Whether the time does little else than to number the states: a form in it tells one of them from the others."""
    visits = 1 + int((rows.state[1:] != rows.state[:-1]).sum())
    return rows.states.recording is None and visits < FEWEST_VISITS


def places_of(model: Model, rows: Rows) -> list[Place]:
    """Where something unknown may enter a model of this family, and show in these rows.

    What works against the direction of the pressure shows in rows of falling pressure beside rising ones: where there
    are none it is only another name for what does not go by the direction."""
    ports = FAMILIES[model.family]
    places = [p for p in PLACES if (p.port if p.port != "parallel" else "geometry") in ports]
    turns = len(comparisons(rows.states, rows.state)) >= FEWEST_COMPARISONS
    return [p for p in places if turns or not p.rubs]


def _placed(fit: WhiteFit, rows: Rows) -> States:
    """The rows' states; under a dead load where the actuator hangs, by the fit."""
    states = rows.states
    if states.bed is not DEAD_LOAD:
        return states
    return states.replace(length=states.reference_length + fit.shown[:, 0], twist=fit.shown[:, 1])


def _inputs(fit: WhiteFit, rows: Rows) -> dict[str, Tensor]:
    states, loads = _placed(fit, rows), fit.shown
    if states.bed is DEAD_LOAD:
        loads = torch.stack([states.force, states.moment], dim=-1)
    known = {i.name: i for place in PLACES for i in place.inputs if not place.energy}
    if not (states.bed.loads or states.bed is DEAD_LOAD):
        known.pop("moment")
    elongation = states.length - states.reference_length
    each = [m.replace(length=m.reference_length + elongation, twist=states.twist) for m in states.members]
    return {name: torch.stack([i.read(m, loads) for m in each or [states]], dim=-1) for name, i in known.items()}


def _strains(fit: WhiteFit, rows: Rows) -> dict[str, Tensor]:
    """The invariants less their values at rest, where in each row's wall they differ most from these, (N, 1); of the
    members of an end block one after another. None of a model without a wall."""
    if fit.model.family != "continuum":
        return {}
    states = _placed(fit, rows)
    states = states.side_by_side() if states.members else states
    with torch.no_grad():
        energy = fit.model.energy(fit.model.values(), states)  # type: ignore[operator]
        inflated = inflate(states, energy, LAYERS)
        wall = Deformation(Layers.from_tube(Tube.from_states(states, LAYERS)), inflated.u)
        away = {
            name: value - AT_REST[name] for name, value in zip(AT_REST, wall.invariants(tuple(AT_REST)), strict=True)
        }
    return {name: value.gather(0, value.abs().argmax(0, keepdim=True)).T for name, value in away.items()}
