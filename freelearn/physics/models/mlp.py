"""The paper's neural network: seven inputs, six tanh neurons, two loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.model import Model, Values
from freelearn.physics.chain.parameters import Parameters
from freelearn.physics.chain.prediction import Prediction, Status

INPUTS, HIDDEN, OUTPUTS = 7, 6, 2
# Order of the inputs; a checkpoint relies on it.
INPUT_NAMES = (
    "length",
    "twist",
    "pressure",
    "fiber_angle",
    "reference_length",
    "inner_radius",
    "outer_radius",
)
SHAPES: dict[str, tuple[int, ...]] = {
    "hidden_weight": (HIDDEN, INPUTS),
    "hidden_bias": (HIDDEN,),
    "load_weight": (OUTPUTS, HIDDEN),
    "load_bias": (OUTPUTS,),
}


class MLP(Model[Parameters]):
    """loads = U tanh(W x + o) + b on inputs and loads scaled to [−1, 1]: 42 + 6 + 12 + 2 = 62 parameters.

    The scaling is that of the training rows. An input that is constant in them is removed (scaled to zero), as
    MATLAB does: a network trained on one sample ignores the design, and still runs on another sample.
    """

    name = "mlp"
    family = "mlp"
    needs_validation = True
    needs_restarts = True

    def __init__(self, effects: Sequence[Effect[Any]] = ()) -> None:
        super().__init__(effects)
        self.input_center: Tensor
        self.input_gain: Tensor
        self.load_center: Tensor
        self.load_half_range: Tensor
        self.register_buffer("input_center", torch.zeros(INPUTS, dtype=torch.float64))
        # Zero removes an input.
        self.register_buffer("input_gain", torch.ones(INPUTS, dtype=torch.float64))
        self.register_buffer("load_center", torch.zeros(OUTPUTS, dtype=torch.float64))
        self.register_buffer("load_half_range", torch.ones(OUTPUTS, dtype=torch.float64))

    @classmethod
    def shapes(cls) -> dict[str, tuple[int, ...]]:
        """Shapes of the weights."""
        return SHAPES

    def bare(self, states: States, values: Values) -> Prediction:
        """Loads of the network."""
        x = (inputs(states) - self.input_center) * self.input_gain
        hidden = torch.tanh(_apply(values["hidden_weight"], x) + values["hidden_bias"])
        loads = _apply(values["load_weight"], hidden) + values["load_bias"]
        loads = loads * self.load_half_range + self.load_center
        return Prediction(loads, torch.full((len(states),), Status.OK, dtype=torch.uint8, device=loads.device))

    def row_jacobian(self, states: States, vector: Tensor) -> Tensor | None:
        """By hand, several times quicker than autograd: ∂L_f/∂W_ji = U_fj (1 − h_j²) x_i, ∂L_f/∂U_fj = h_j."""
        # A class derived from this one may be another network.
        if self.effects or type(self) is not MLP:
            return None
        with torch.no_grad():
            values = self.physical(vector)
            x = (inputs(states) - self.input_center) * self.input_gain
            hidden = torch.tanh(_apply(values["hidden_weight"], x) + values["hidden_bias"])
            by_bias = (1 - hidden * hidden)[:, None, :] * (values["load_weight"] * self.load_half_range[:, None])
            rows = len(x)
            jacobian = vector.new_zeros(rows, OUTPUTS, len(vector))
            sizes = [HIDDEN * INPUTS, HIDDEN, OUTPUTS * HIDDEN, OUTPUTS]
            weight, bias, load, load_bias = jacobian.split(sizes, dim=-1)
            torch.mul(by_bias[..., None], x[:, None, None, :], out=weight.unflatten(-1, (HIDDEN, INPUTS)))
            bias.copy_(by_bias)
            for f in range(OUTPUTS):
                load[:, f, f * HIDDEN : (f + 1) * HIDDEN] = hidden * self.load_half_range[f]
                load_bias[:, f, f] = self.load_half_range[f]
        return jacobian

    def chain(self, states: States, values: Values) -> Prediction:
        """As Chain.chain; on a bed that measures anything but loads, the network gives that by itself."""
        if states.bed.loads:
            return super().chain(states, values)
        if self.effects:
            raise UserError(
                f"On the bed {states.bed.name} the network answers with what the bed measures, so that no effect can "
                f"join it: leave out {', '.join(effect.name for effect in self.effects)}."
            )
        return self.bare(states, values)

    def _rested(self, states: States, values: Values) -> Prediction:
        """A network knows no single members: it takes all of their pressures."""
        if not states.members:
            return super()._rested(states, values)
        return self._alone(states, values)

    def prepare(self, rows: Rows) -> None:
        """Takes the input and load scaling from the training rows."""
        x, loads = inputs(rows.states), rows.readings.value
        low, high = x.amin(0), x.amax(0)
        half = (high - low) / 2
        # Rounding of a constant column must not count as variation.
        varies = half > 1e-9 * x.abs().amax(0)
        self.input_center.copy_((low + high) / 2)
        self.input_gain.copy_(torch.where(varies, 1 / torch.where(varies, half, 1.0), 0.0))
        # Blanks are zeros, which must not widen the range.
        there, most = rows.readings.present, torch.tensor(torch.inf, dtype=torch.float64)
        low, high = torch.where(there, loads, most).amin(0), torch.where(there, loads, -most).amax(0)
        low, high = torch.where(there.any(0), low, 0.0), torch.where(there.any(0), high, 0.0)
        self.load_center.copy_((low + high) / 2)
        self.load_half_range.copy_(torch.where(high > low, (high - low) / 2, 1.0))


def _apply(weight: Tensor, x: Tensor) -> Tensor:
    """Weight (o, i), or one weight per row (N, o, i), times rows x (N, i): (N, o)."""
    return x @ weight.T if weight.ndim == 2 else torch.linalg.vecdot(weight, x[:, None, :])


def inputs(states: States) -> Tensor:
    """The network's unscaled inputs, (N, 7), SI: what the bed imposes, and the design (see INPUT_NAMES).

    The design of several actuators on one end block is the same in every row: their pressures stand in its place, of as
    many as five. Raises UserError for more."""
    imposed = states.inputs()
    design = [] if states.members else [getattr(states, name) for name in INPUT_NAMES[len(imposed) :]]
    if len(imposed) > INPUTS:
        raise UserError(f"The network has {INPUTS} inputs, too few for the pressures of {len(states.members)} members.")
    spare = [torch.zeros_like(states.length)] * (INPUTS - len(imposed) - len(design))
    return torch.stack([*imposed, *design, *spare], dim=-1)
