"""What every model is: typed parameters, effects, and one method of its own, the loads of the bare structure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Generic, Protocol

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.chain import BLOCK, Chain
from freelearn.physics.chain.effect import OWN, Effect
from freelearn.physics.chain.parameters import P, Parameters
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.chain.raw_vector import Values

__all__ = ["BLOCK", "Model", "Values"]


class Bound(Protocol):
    """A model at fixed states, as a fit asks for it again and again: no status, nothing recorded for autograd."""

    def loads(self, vector: Tensor) -> Tensor:
        """Loads (N, 2) N, N·m at a raw vector (p,)."""

    def jacobian(self, vector: Tensor) -> Tensor:
        """∂loads/∂vector of every row, (N, 2, p)."""


class Model(Chain, Generic[P]):
    """Derive from it, name the class of its parameters, and write `structure`: that is a whole model.

    Effects, fits, uncertainty, checkpoints and discovery then work on it. docs/own_model.md shows one in twenty lines.
    """

    name: str
    parameter_class: ClassVar[type[Parameters]] = Parameters
    # Which effects it can take (freelearn.physics.chain.effect.FAMILIES).
    family: ClassVar[str] = OWN
    # Whether ∂F/∂φ = ∂M/∂l at fixed pressure, and whether the unloaded, unpressurized actuator carries no load.
    # Said by the author of a model, checked by freelearn.testing.models.ModelContract.
    conservative: ClassVar[bool] = False
    relaxed_at_rest: ClassVar[bool] = False
    # Whether a fit needs validation rows to know when to stop.
    needs_validation: ClassVar[bool] = False
    # Whether a fit may end in different minima from different starts, so that restarts help.
    needs_restarts: ClassVar[bool] = False

    def __init__(self, effects: Sequence[Effect[Any]] = (), **values: float) -> None:
        """values: of the model's own parameters in SI; those not given have their start. Raises UserError."""
        super().__init__({p.name: p for p in self.parameter_class.records()}, effects, self.shapes())
        self.set_values(values)

    @classmethod
    def shapes(cls) -> dict[str, tuple[int, ...]]:
        """Shapes of parameters without physical meaning (a network's weights), by name. None by default."""
        return {}

    def structure(self, states: States, p: P) -> Tensor | Prediction:
        """Loads (N, 2) of the bare actuator, force [N] and moment [N·m], at the states imposed on it.

        F > 0 pushes, M > 0 turns towards positive twist: F = −∂Π/∂l, M = −∂Π/∂φ for a potential Π. p: the model's own
        parameters in SI, each () or (N,). Write it with torch operations; every derivative follows from that. Rows
        whose loads are not finite count as without equilibrium; a Prediction says more about each row.
        """
        raise NotImplementedError

    def own(self, values: Values) -> P:
        """The model's own parameters out of all values."""
        own = {p.name: values[p.name] for p in self.parameter_class.records()}
        return self.parameter_class(**own)  # type: ignore[return-value]  # P is the type of `parameter_class`

    def bare(self, states: States, values: Values) -> Prediction:
        """Loads of `structure`, with a finite number and a status in rows where it has none."""
        p = self.own(values)
        said = self.structure(states, p)
        if isinstance(said, Prediction) and self.family != OWN:
            return said
        loads = said.loads if isinstance(said, Prediction) else said
        lost = ~loads.isfinite().all(-1)
        if all_if_known(~lost):
            status = torch.zeros(loads.shape[:-1], dtype=torch.uint8, device=loads.device)
            return said if isinstance(said, Prediction) else Prediction(loads, status)
        # Only a second look at a harmless state keeps what is not finite out of every derivative.
        harmless = {
            "length": torch.where(lost, states.reference_length, states.length),
            "twist": torch.where(lost, 0.0, states.twist),
            "pressure": torch.where(lost, 0.0, states.pressure),
        }
        again = self.structure(states.replace(**harmless), p)
        kept = again.loads if isinstance(again, Prediction) else again
        status = again.status if isinstance(again, Prediction) else torch.zeros_like(lost, dtype=torch.uint8)
        return Prediction(
            torch.where(lost[..., None], 0.0, kept), torch.where(lost, Status.NO_EQUILIBRIUM, status).to(torch.uint8)
        )

    def remarks(self) -> list[str]:
        """Sentences on the present parameters that a reader of a fit should know. None by default."""
        return []

    @property
    def coefficients(self) -> int:
        """How many numbers a fit has learned beside the parameters. None by default."""
        return 0

    def prepare(self, rows: Rows) -> None:
        """Looks at the training rows before a fit (input scaling). Nothing by default."""

    def row_jacobian(self, states: States, vector: Tensor) -> Tensor | None:
        """∂loads/∂vector of every row, (N, 2, p), where the model has it in closed form; None leaves it to autograd."""
        return None

    def bind(self, states: States) -> Bound | None:
        """The model at fixed states, where something can be made once for all raw vectors; None by default."""
        return None

    def description(self) -> dict[str, Any]:
        """Everything needed to rebuild the model, as plain containers and tensors (see build)."""
        samples = sorted({sample for effect in self.effects for sample in effect.samples})
        effects = [effect.name for effect in self.effects]
        members = max((len(effect.members) for effect in self.effects), default=0)
        known: dict[str, Any] = {} if self.known.nothing else {"known": self.known.plain()}
        known |= {"raw_form": self.raw_form} if self.raw_form > 1 else {}
        return {"model": self.name, "effects": effects, "samples": samples, "members": members, **known} | {
            "state": self.state()
        }
