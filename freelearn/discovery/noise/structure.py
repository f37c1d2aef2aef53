"""Is there anything systematic left? Tests of whitened residuals that need no candidate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from scipy.special import fdtrc
from torch import Tensor

from freelearn.data.states import States
from freelearn.discovery.noise.linear_algebra import DEPENDENT, ROUNDING, SMALLEST, norms, orthonormal, summed_products
from freelearn.discovery.noise.noise import Whitener, whitened_basis
from freelearn.discovery.noise.shapes import Basis, Block, bases_with_slopes, place_shapes
from freelearn.discovery.thresholds import ALPHA_STRUCTURE, FEW_STATES

# Chance at which a screen speaks. Its false statements are counted by experiments/hidden_effects: at most 2 %.
ALPHA = 0.004


@dataclass(frozen=True)
class ResidualTest:
    """shows: whether what it looks for shows; None where the rows cannot tell, and then p_value is None too. p_value:
    chance that noise alone would look like this. says: in words. at_most: force [N] and moment [N·m] that a denial
    leaves possible, with 99 % confidence; None where it puts no figure on it."""

    name: str
    shows: bool | None
    p_value: float | None
    says: str
    at_most: tuple[float, float] | None = None


class InErrors(NamedTuple):
    """What errors of the pressures' readings do to k whitened shapes, on average: size (k, k), products of what they
    change in each, as far as these errors make the residuals, and shared (k, pressures), products of the shapes with
    what they make of these."""

    size: Tensor
    shared: Tensor


class WhiteBlock(NamedTuple):
    """rows (n,) and whitened shapes of theirs, columns (2n, k). errors: None where no pressure is in them."""

    rows: Tensor
    columns: Tensor
    errors: InErrors | None = None


# Share of a shape's square that may be errors of the pressures' readings, and χ² that a set of shapes may see in these
# beyond that of noise.
MOST_ERRORS, SEEN_IN_ERRORS = 0.02, 0.5
# What a fit absorbs changes over the range of a pressure by so many times its size, about.
CHANGES = 2.0
# Standard deviations beyond which a residual counts as an outlier.
OUTLYING = 4.0
# What an error of place adds to a state's readings, in units of their own variance, for it to be seen at all.
VISIBLE = 1.0
# Fewer degrees of freedom than this tell nothing of the noise.
FEWEST_FREE = 10
# A p-value below this is looked at again without each of the states, if these are not so few that one of them may be
# the one that tells.
LOOKED_AT = 0.05


@dataclass(frozen=True)
class Structure:
    """p_value that residuals without structure would look as systematic as these; scale: standard deviation of
    what is left after all smooth structure is taken off, in units of the stated noise (one if that is right). seen_by:
    places of the sets of shapes, the one that sees most first. size: χ² that one of these explains beyond what noise
    would, at most, in units of what is left."""

    p_value: float
    scale: float
    seen_by: tuple[int, ...] = ()
    size: float = 0.0

    @property
    def shows(self) -> bool:
        """Whether something systematic is left."""
        return self.p_value < ALPHA_STRUCTURE


def structure(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> Structure:
    """Tests whitened residuals (N, 2) of a fit with whitened Jacobian (N, 2, p) for smooth structure: bases of shapes,
    for force and moment separately, and what places would have to be off by."""
    sets = (_white(basis, whiten) for basis in bases_with_slopes(states))
    found = seen(residual, jacobian, whiten, sets, _in_absorbed(states, whiten))
    of_places = displaced(residual, states, whiten)
    return found if of_places is None else replace(found, p_value=min(1.0, 2 * min(found.p_value, of_places)))


def seen(
    residual: Tensor, jacobian: Tensor, whiten: Whitener, sets: Iterable[Iterable[WhiteBlock]], in_absorbed: float = 0.0
) -> Structure:
    """What sets of whitened shapes see in whitened residuals (N, 2) of a fit with whitened Jacobian (N, 2, p).
    in_absorbed: share of the square of what the fit absorbs that errors of the pressures' readings are.

    Each set, cleared of what the fit could absorb, is regressed on the residuals; an F-test compares what it explains
    with what the finest one leaves. The least p-value is multiplied by the number of sets (Bonferroni). Residuals
    beyond OUTLYING standard deviations are drawn in to there: a few rows on a kink of the model are not a systematic
    misfit, and neither is one odd state of many: where the F-test sees something, it has to see it without any one of
    the states too. Where the order of a regular protocol tells the pressure better than its gauge does, shapes of both
    are the gauge's errors: what of a set these alone would show in is left out.
    """
    flat = winsorized(residual.reshape(-1), whiten.present.reshape(-1))
    absorbed = orthonormal(jacobian.flatten(0, 1))
    views = [_view(blocks, absorbed, flat, whiten, in_absorbed) for blocks in sets]
    places = [place for place, view in enumerate(views) if view.rank]
    views = [views[place] for place in places]
    total = max(float(flat.square().sum()), SMALLEST)
    if not views:
        return Structure(1.0, float((total / max(whiten.count - absorbed.shape[1], 1)) ** 0.5))
    finest = max(views, key=lambda view: view.rank)
    freedom = whiten.count - absorbed.shape[1] - finest.rank
    if freedom < FEWEST_FREE:
        return Structure(1.0, float((total / max(whiten.count - absorbed.shape[1], 1)) ** 0.5))
    every = torch.ones(1, whiten.states, dtype=torch.float64)
    variance = max(total - float(finest.explained(every)[0]), SMALLEST) / freedom

    size = max(float(view.explained(every)[0]) / variance - view.rank for view in views)

    def chances(cases: Tensor) -> np.ndarray:
        return np.array([fdtrc(v.rank, freedom, v.explained(cases) / v.rank / variance) for v in views])

    whole = chances(every)[:, 0]
    p_value = min(1.0, len(views) * float(whole.min()))
    if p_value < LOOKED_AT and whiten.states >= FEW_STATES:
        without = chances(1 - torch.eye(whiten.states, dtype=torch.float64))
        p_value = min(1.0, len(views) * float(without.min(axis=0).max()))
    return Structure(p_value, variance**0.5, tuple(places[i] for i in whole.argsort(kind="stable")), size)


def displaced(residual: Tensor, states: States, whiten: Whitener) -> float | None:
    """Chance that errors of places alone would look as much like functions of the place as what states' residuals
    (N, 2), whitened, have in common; None where too few states show any.

    What a state's rows share counts as an error of its place, however large, and hardly shows among all readings: a
    misfit that differs from state to state and not with the pressure would pass for places that were set badly. Their
    own scatter is what it is measured by, so that it does not matter how large they are."""
    count, shared = whiten.states, whiten.shared
    # The rows of a state with errors u of its place: white = (I + A Aᵀ)^−½ (A u + noise), of which Aᵀ white is left.
    size, axes = torch.linalg.eigh(whiten.gathered(shared.transpose(1, 2) @ shared))
    visible, turned = size > VISIBLE, axes.transpose(1, 2)
    along = whiten.gathered((shared * residual[..., None]).sum(1))
    target = (turned @ along[..., None])[..., 0] / torch.where(visible, size.sqrt(), torch.inf)
    shapes = place_shapes(states[torch.as_tensor(np.unique(whiten.state.numpy(), return_index=True)[1])])
    moved = torch.where(visible, (size / (1 + size)).sqrt(), 0.0)[:, :, None] * turned
    design = (moved[..., None] * shapes[:, None, None, :]).reshape(-1, moved.shape[2] * shapes.shape[1])
    basis = orthonormal(design)
    rank, freedom = basis.shape[1], int(visible.sum()) - basis.shape[1]
    if freedom < FEWEST_FREE or not rank:
        return None
    flat = winsorized(target.reshape(-1), visible.reshape(-1))
    missed = flat - basis @ (basis.T @ flat)
    whole, rest = float(flat.square().sum()), float(missed.square().sum())
    # Without each state in turn: one that is odd is nothing that they have in common.
    own, each = basis.reshape(count, -1, rank), missed.reshape(count, -1, 1)
    free = torch.eye(own.shape[1], dtype=torch.float64) * (1 + ROUNDING) - own @ own.transpose(1, 2)
    rests = rest - (each * torch.linalg.solve(free, each)).sum((1, 2)).clamp(0, rest)
    wholes = whole - flat.reshape(count, -1).square().sum(1).clamp_max(whole)
    ratio = ((wholes - rests) / rank / (rests.clamp_min(SMALLEST) / freedom)).clamp_min(0)
    return float(np.max(fdtrc(rank, freedom, ratio.numpy())))


def f_test(ratio: float, of: int, over: int) -> float:
    """Chance that Fisher's F with (of, over) degrees of freedom exceeds the ratio.

    >>> round(f_test(1.0, 10, 10), 3)
    0.5
    """
    return float(fdtrc(of, over, ratio))


@dataclass(frozen=True)
class _View:
    """A basis of some rank, cleared of what the fit absorbs: axes (k, rank) that make its columns orthonormal, their
    products with the residuals summed over each kinematic state, (states, k), and the share of these that is absorbed:
    products of the absorbed span (states, r) and with the columns (r, k)."""

    rank: int
    axes: Tensor
    along: Tensor
    taken: Tensor
    shared: Tensor

    def explained(self, states: Tensor) -> np.ndarray:
        """What the basis explains of the squared residuals, (cases,), if each state's count as often as states
        (cases, states) says."""
        slope = states @ self.along - (states @ self.taken) @ self.shared
        explained: np.ndarray = (slope @ self.axes).square().sum(1).numpy()
        return explained


def _white(basis: Basis, whiten: Whitener) -> Iterator[WhiteBlock]:
    """The shapes of a basis, given to either load."""
    for block in basis:
        part = whiten.part(block.rows)
        yield WhiteBlock(block.rows, whitened_basis(block.columns, part), _in_errors(block, part))


def _in_errors(block: Block, whiten: Whitener) -> InErrors | None:
    """whiten: of the block's rows. What it takes off for what a state's rows share is left in: it is hardly any."""
    if block.slopes is None:
        return None
    count, k = block.columns.shape
    # Of one standard deviation of either load, and of each pressure's error, in a row's whitened readings.
    unit = whiten.apart(torch.diag(whiten.variance.sqrt().mean(0)).expand(count, 2, 2))
    made = whiten.apart(whiten.by_pressure)
    size, shared = torch.zeros(2, k, 2, k, dtype=torch.float64), torch.zeros(2, k, made.shape[2], dtype=torch.float64)
    for place, slopes in enumerate(block.slopes):
        own = torch.nonzero(slopes.abs().amax(0))[:, 0]
        change, share = slopes[:, own] * whiten.pressure_error, made[:, :, place].square().sum(1)
        for a in range(2):
            shared[a, own, place] = change.T @ (unit[:, :, a] * made[:, :, place]).sum(1)
            for b in range(2):
                weight = (unit[:, :, a] * unit[:, :, b]).sum(1) * share
                size[a, own[:, None], b, own] += change.T @ (weight[:, None] * change)
    return InErrors(size.reshape(2 * k, 2 * k), shared.reshape(2 * k, -1))


def _in_absorbed(states: States, whiten: Whitener) -> float:
    """Share of the square of what a fit absorbs that errors of the pressures' readings are, as far as these make the
    residuals: where hardly anything is left of a shape beside it, they are what is left."""
    made = whiten.apart(whiten.by_pressure).square().sum(1).mean(0)
    wide = torch.stack([p.max() - p.min() for p in states.inputs()[2:]])
    return float((made * (CHANGES * whiten.pressure_error / wide.clamp_min(SMALLEST)).square().clamp_max(1.0)).sum())


def _view(blocks: Iterable[WhiteBlock], absorbed: Tensor, flat: Tensor, whiten: Whitener, in_absorbed: float) -> _View:
    """A set of shapes seen beside an orthonormal span (2N, r) and residuals (2N,).

    All from inner products, block by block: the cleared columns themselves would cost several passes over them."""
    span, residual = absorbed.reshape(len(flat) // 2, 2, -1), flat.reshape(-1, 2)
    grams, shared, along, sizes, in_errors = [], [], [], [], []
    for rows, columns, errors in blocks:
        length = norms(columns)
        there, length = length > 0, length[length > 0]
        columns = columns[:, there] / length
        grams.append(columns.T @ columns)
        shared.append(span[rows].flatten(0, 1).T @ columns)
        along.append(summed_products(columns, residual[rows].reshape(-1), whiten.state[rows], whiten.states))
        none = InErrors(columns.new_zeros(len(there), len(there)), columns.new_zeros(len(there), 1))
        size, made = errors or none
        sizes.append(size[there][:, there] / length / length[:, None])
        in_errors.append(made[there] / length[:, None])
    together, taken = torch.block_diag(*grams), torch.cat(shared, dim=1)
    size, axes = torch.linalg.eigh(together - taken.T @ taken)
    kept = size > DEPENDENT
    axes = axes[:, kept] / size[kept].sqrt()
    axes = _told_apart(axes, torch.block_diag(*sizes) + in_absorbed * taken.T @ taken, torch.cat(in_errors))
    return _View(
        axes.shape[1], axes, torch.cat(along, 1), summed_products(absorbed, flat, whiten.state, whiten.states), taken
    )


def _told_apart(axes: Tensor, size: Tensor, shared: Tensor) -> Tensor:
    """Axes (k, rank) of a set of shapes without those that errors of the pressures' readings would show in. size,
    shared: see InErrors, of the whole set."""
    share, turned = torch.linalg.eigh(axes.T @ size @ axes)
    axes = axes @ turned[:, share <= MOST_ERRORS]
    seen = axes.T @ shared
    large = seen.square().sum(0) > SEEN_IN_ERRORS
    if not bool(large.any()):
        return axes
    along = orthonormal(seen[:, large])
    beside: Tensor = torch.linalg.qr(along, mode="complete")[0][:, along.shape[1] :]
    return axes @ beside


def winsorized(residual: Tensor, present: Tensor) -> Tensor:
    """Residuals drawn in to OUTLYING standard deviations, these from the median absolute value of those present."""
    limit = OUTLYING * 1.4826 * float(residual[present].abs().median())
    return residual.clamp(-limit, limit) if limit > 0 else residual
