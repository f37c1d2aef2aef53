"""What a fit minimizes: the error metric over training rows, as residuals of a raw vector, and the pull of priors."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from freelearn.common.progress import tell
from freelearn.data.error import load_scale
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.data.warm_start import Near
from freelearn.physics.chain.log_derivatives import log_jacobian
from freelearn.physics.chain.model import BLOCK, Bound, Model
from freelearn.physics.chain.priors import RawPrior, raw_prior, spans

# Of raw vectors, (members, p).
Function = Callable[[Tensor], Tensor]

# What a fit minimizes: the error metric of a model over training rows, as residuals of a raw vector.

# With more rows everything is made in pieces of so many, and nothing is kept of them: it would be 60 numbers a row.
MANY_ROWS, PIECE = 500_000, 1 << 15
# With fewer rows an operation costs as much as with twice as many.
FEW_ROWS = 600


class _Recorded(NamedTuple):
    """What rows miss at raw vectors (members, p), with all that derivatives need.

    copies: each row's own vector; missed (k, members, N, 2): of every row, standing there k times; near: where it
    ended."""

    vectors: Tensor
    copies: Tensor
    missed: Tensor
    near: Near

    def rates(self, channels: list[bool]) -> Tensor:
        """∂missed/∂vector of every row, (members · N, 2, p). channels: which anything was measured of."""
        with torch.enable_grad():
            rows = self.missed.flatten(1, 2)
            if len(rows) == 2:
                asked = [rows[0, :, 0].sum() + rows[1, :, 1].sum()]
            else:
                asked = [some.sum() for some, measured in zip(rows[0].unbind(-1), channels, strict=True) if measured]
        by = [torch.autograd.grad(one, self.copies, retain_graph=True, materialize_grads=True)[0] for one in asked]
        if len(rows) == 2:
            return by[0].reshape(2, rows.shape[1], -1).transpose(0, 1)
        found = iter(by)
        return torch.stack([next(found) if measured else torch.zeros_like(self.copies) for measured in channels], 1)


class Problem:
    """Residuals of a model over rows, normalized so that their sum of squares is N·E².

    residual: raw vector (p,) → (2N,), force and moment of a row side by side (or what its bed measures), zero where
    nothing was measured. scale: (2,), the loads that count as
    one; by default the largest of the rows.
    """

    def __init__(self, model: Model, rows: Rows, scale: Tensor | None = None, near: Near | None = None) -> None:
        self.model = model
        self.rows = rows
        # Whether rows hang together by the samples before them: they then are evaluated as whole recordings.
        self.whole = model.remembers(rows.states)
        # A fit moves on from equilibria that it has found.
        self.states = self._remembered(rows.states, Near() if near is None else near)
        self._copies: dict[int, States] = {1: self.states}
        self.scale = load_scale(rows.loads) if scale is None else scale
        pieces = range(0, len(rows), PIECE) if len(rows) > MANY_ROWS and not self.whole else ()
        self.begun = [slice(start, start + PIECE) for start in pieces]
        self.near = [Near() for _ in self.begun]
        # Whether derivatives are taken by autograd, once they have been asked for; and the last step that was tried.
        self._by_autograd = False
        self._tried: _Recorded | None = None
        self._walked: tuple[Tensor, Near] | None = None

    def _remembered(self, states: States, near: Near) -> States:
        """The states with what belongs to them from evaluation to evaluation: of whole recordings, to all samples."""
        if self.whole:
            return _along(states, near.released())
        remembered = states.replace(near=near)
        near.fix(tensor for _, tensor in remembered.tensors())
        return remembered

    def _side_by_side(self, members: int) -> States:
        """The states once for each of so many raw vectors."""
        if members not in self._copies:
            place = torch.arange(len(self.rows), device=self.states.length.device).repeat(members)
            near = self.states.near
            self._copies[members] = self._remembered(self.states[place], Near() if near is None else near.copy(members))
        return self._copies[members]

    @property
    def parted(self) -> bool:
        """Whether there are so many rows that everything is made in pieces."""
        return bool(self.begun)

    def parts(self) -> Iterator[Problem]:
        """The problem in pieces, which begin where those before them ended."""
        total = len(self.begun)
        for number, (rows, near) in enumerate(zip(self.begun, self.near, strict=True), 1):
            yield Problem(self.model, self.rows[rows], self.scale, near)
            tell("evaluating", number, total)

    def pieces(self, vectors: Tensor) -> Iterator[Tensor]:
        """As `jacobians`, but some rows after the other, (members, 2n, p) each."""
        for part in self.parts():
            yield part.jacobians(vectors)

    @cached_property
    def channels(self) -> list[bool]:
        """Of which of the two anything was measured."""
        measured: list[bool] = self.rows.readings.present.any(0).tolist()
        return measured

    @cached_property
    def bound(self) -> Bound | None:
        """The model at these rows, where it has something to make once."""
        return self.model.bind(self.rows.states)

    def residual(self, vector: Tensor) -> Tensor:
        """Residuals at one raw vector, (p,) → (2N,), differentiable."""
        return self.missed(self.model(self.states, self.model.physical(vector)).loads)

    def readings(self, vector: Tensor) -> Tensor:
        """What the model says the sensors show, at one raw vector: (N, 2) SI."""
        with torch.no_grad():
            shown: Tensor = self.model(self.states, self.model.physical(vector)).loads
        return shown

    def residuals(self, vectors: Tensor) -> Tensor:
        """Residuals of several members: (members, p) → (members, 2N), in one batch."""
        recorded = torch.is_grad_enabled() and vectors.requires_grad
        if self.parted and not recorded:
            found = vectors.new_empty(len(vectors), len(self.rows), 2)
            for rows, part in zip(self.begun, self.parts(), strict=True):
                found[:, rows] = part.residuals(vectors).view(len(vectors), -1, 2)
            return found.view(len(vectors), -1)
        if len(vectors) > 1:
            if self.whole and not recorded:
                return torch.stack([self.residual(vector) for vector in vectors])
            if self.model.weights or recorded or self.model.bind(self.rows.states):
                return torch.func.vmap(self.residual)(vectors)
            together = max(1, BLOCK // len(self.rows))
            return torch.cat([self._tiled(some) for some in vectors.split(together)])
        # Outside vmap the radial equilibrium may stop as soon as it has converged.
        if self.bound and not recorded:
            return self.missed(self.bound.loads(vectors[0]))[None]
        return self.residual(vectors[0])[None]

    def residual_by_part(self, vectors: Tensor, part: Tensor) -> Tensor:
        """Residuals (2N,) of every row by the raw vector (parts, p) of its part, (N,) int64: at the price of one."""
        if self.whole or self.parted or self.model.weights:
            each = self.residuals(vectors).view(len(vectors), len(self.rows), 2)
            return each[part, torch.arange(len(self.rows))].flatten()
        return self.missed(self.model(self.states, self.model.physical(vectors[part])).loads)

    def _tiled(self, vectors: Tensor) -> Tensor:
        """Residuals of a few members whose rows stand below each other, (members, p) → (members, 2N)."""
        if len(vectors) == 1:
            return self.residual(vectors[0])[None]
        copies = vectors.repeat_interleave(len(self.rows), 0)
        loads = self.model(self._side_by_side(len(vectors)), self.model.physical(copies)).loads
        return self.missed(loads.view(len(vectors), -1, 2)).view(len(vectors), -1)

    def missed(self, loads: Tensor) -> Tensor:
        """Residuals (…, 2N) of what a model says the sensors show, (…, N, 2) SI."""
        return (self.rows.readings.missed(loads) / self.scale).reshape(*loads.shape[:-2], -1)

    def jacobians(self, vectors: Tensor) -> Tensor:
        """∂residual/∂vector of several members: (members, p) → (members, 2N, p)."""
        rows = [self._row_jacobian(vector) for vector in vectors]
        known = [j for j in rows if j is not None]
        if len(known) < len(rows):
            return self._automatic(vectors)
        # Networks on many rows: megabytes, so nothing is copied without need.
        pairs = zip(known, vectors, strict=True)
        scaled = [self._felt(j, vector).flatten(0, 1) for j, vector in pairs]
        return torch.stack(scaled) if len(scaled) > 1 else scaled[0][None]

    def columns(self, vector: Tensor, places: Collection[int]) -> Tensor:
        """∂residual/∂ some numbers of one raw vector (p,), by their places: (N, 2, k)."""
        if not self.whole:
            found = self.jacobians(vector[None])[0].reshape(len(self.rows), 2, -1)
        else:
            rates = self._row_jacobian(vector, places)
            assert rates is not None
            found = self._felt(rates, vector)
        return found[..., list(places)]

    def _felt(self, jacobian: Tensor, vector: Tensor) -> Tensor:
        """Rates (N, 2, p) of the readings as those of the residuals: zero of those that do not count."""
        jacobian, readings = jacobian.div_(self.scale[:, None]), self.rows.readings
        if readings.plain:
            return jacobian
        # Only a tube that hangs loose makes it a matter of what the model says.
        counts = readings.informative_mask(self.readings(vector)) if readings.loose else readings.present
        return jacobian * counts[..., None]

    def _row_jacobian(self, vector: Tensor, wanted: Collection[int] | None = None) -> Tensor | None:
        """Rates (N, 2, p) of the readings; None where autograd takes them. wanted: of a log, those that are."""
        if self.whole:
            rates: Tensor | None = self._whole_jacobian(vector.detach(), wanted)
        else:
            rates = self.bound.jacobian(vector) if self.bound else self.model.row_jacobian(self.rows.states, vector)
        if rates is not None and self.model.known.fixed:
            rates = torch.where(self.model.free.to(rates.device), rates, 0.0)
        return rates

    def _whole_jacobian(self, vector: Tensor, wanted: Collection[int] | None = None) -> Tensor:
        """Rates (N, 2, p) of what rows of a log show, from where the try of this vector ended. wanted: of these."""
        near, walked = self.states.near, self._walked
        assert near is not None
        if walked is not None and torch.equal(walked[0], vector):
            near.follow(walked[1], 1)
        with near.keeping():
            return log_jacobian(self.model, self.states, vector, wanted)

    def tried(self, vectors: Tensor) -> Tensor:
        """`residuals` where a search may go on from: what derivatives there need is kept until the next try."""
        if self.whole and len(vectors) == 1:
            assert self.states.near is not None
            way = self.states.near.along()
            with torch.no_grad():
                shown = self.model(_along(self.states, way), self.model.physical(vectors[0])).loads
            self._walked = vectors[0].detach().clone(), way
            return self.missed(shown)[None]
        if not self._by_autograd or len(vectors) * len(self.rows) > BLOCK:
            return self.residuals(vectors)
        self._tried = self._recorded(vectors)
        return self._tried.missed[0].detach().flatten(1)

    def _automatic(self, vectors: Tensor) -> Tensor:
        """The Jacobians by autograd.

        A row's loads depend on the parameters alone, so giving each row of each member its own copy of them lets
        two reverse passes (force, moment) return every derivative at once; forward mode pays for each parameter. What
        no row measures needs none; and of few rows, where every operation costs the same however many there are, each
        stands there twice, so that one pass does.
        """
        self._by_autograd = not self.parted
        members, size = vectors.shape
        count = len(self.rows)
        states = self._side_by_side(members)
        if members * count <= BLOCK:
            here, self._tried = self._tried, None
            if here is None or not torch.equal(here.vectors, vectors):
                here = self._recorded(vectors)
            assert states.near is not None
            states.near.lead(here.near, members * count)
            return here.rates(self.channels).reshape(members, 2 * count, size)
        blocks = []
        for rows in torch.arange(members * count, device=vectors.device).split(BLOCK):
            with torch.enable_grad():
                copies = vectors.detach()[rows // count].requires_grad_()
                loads = self.model.chain(states[rows], self.model.physical(copies)).loads
                missed = self.rows.readings[rows % count].missed(loads) / self.scale
            blocks.append(_Recorded(vectors, copies, missed[None, None], Near()).rates(self.channels))
        return torch.cat(blocks).reshape(members, 2 * count, size)

    def _recorded(self, vectors: Tensor) -> _Recorded:
        """At raw vectors (members, p), on a way of its own: where it leads is told by who goes on from there."""
        members, count = len(vectors), len(self.rows)
        # Where equilibria are searched for, rates by the place are asked of both loads on the way.
        asked = all(self.channels) or bool(self.model.yielding)
        times = 2 if members * count <= FEW_ROWS and asked else 1
        begun = self._side_by_side(members)
        states = begun.on_the_way() if times == 1 else self._side_by_side(2 * members)
        near = states.near
        assert begun.near is not None
        assert near is not None
        if times == 2:
            near.follow(begun.near, 2)
        with torch.enable_grad(), near.keeping(doubled=len(states) if times == 2 else 0):
            copies = vectors.detach().repeat(times, 1).repeat_interleave(count, 0).requires_grad_()
            loads = self.model.chain(states, self.model.physical(copies)).loads.reshape(times, members, count, 2)
            missed = self.rows.readings.missed(loads) / self.scale
        return _Recorded(vectors.detach().clone(), copies, missed, near)


def _along(states: States, near: Near) -> States:
    """Rows of a log whose recordings begin where they ended before; if these are evaluated in blocks, each anew."""
    whole = states.recording
    assert whole is not None
    if len(whole) > BLOCK:
        return states.replace(near=near)
    begun = whole.states.replace(near=near)
    near.fix(tensor for _, tensor in begun.tensors())
    return states.replace(near=near, recording=whole.with_states(begun))


# How a user's own priors pull at the parameters of a least-squares fit.


@dataclass(frozen=True)
class Pull:
    """‖root (x − middle)‖² joins the sum of squares of a raw vector x. root (k, p); middle (p,). spread: of a
    kinematic state's residual, in units of the sum of squares, by which the priors were weighed."""

    root: Tensor
    middle: Tensor
    spread: float

    @classmethod
    def from_problem(cls, problem: Problem, vector: Tensor) -> Pull | None:
        """Of the priors that were given for the problem's model, weighed at a raw vector (p,); None without any.

        A residual is worth what all are at the vector, each kinematic state counting once, because all its rows may
        share one error: many rows of a model that is wrong do not outweigh what is known. Priors that are declared take
        no part: this is the fit of the paper.
        """
        model = problem.model
        given = torch.tensor([model.known.prior(label) is not None for label in model.labels()]) & model.free
        if not bool(given.any()):
            return None
        prior = raw_prior(model, spans(problem.rows))
        everything = torch.diag(torch.full_like(prior.middle, torch.inf))
        both = given[:, None] & given
        root = RawPrior(prior.middle, torch.where(both, prior.covariance, everything)).root
        with torch.no_grad():
            total = float(problem.residuals(vector[None])[0].square().sum())
        states = len(np.unique(problem.rows.state))
        spread = (total / max(states - int(model.free.sum()), 1)) ** 0.5
        return cls(spread * root[given], torch.where(given, prior.middle, 0.0), spread)

    def residuals(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, k)."""
        return (vectors - self.middle) @ self.root.T

    def jacobians(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, k, p)."""
        return self.root.expand(len(vectors), -1, -1)

    def joined(self, problem: Problem) -> tuple[Function, Function]:
        """Residuals and derivatives of a problem with these below them."""

        def residuals(vectors: Tensor) -> Tensor:
            return torch.cat([problem.residuals(vectors), self.residuals(vectors)], dim=1)

        def jacobians(vectors: Tensor) -> Tensor:
            return torch.cat([problem.jacobians(vectors), self.jacobians(vectors)], dim=1)

        return residuals, jacobians


def pulled(model: Model) -> bool:
    """Whether a fit of the model has priors to heed."""
    return any(model.known.prior(label) is not None and not p.fixed for label, p in model.declared.items())
