"""What a referee looks at, and one check of a claim."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.noise import Whitener, relative_error

Result = Literal["pass", "fail", "cannot_tell"]
PASS: Result = "pass"
FAIL: Result = "fail"
CANNOT: Result = "cannot_tell"
# The check that asks for rows which could show an effect of the answer.
ROWS_SHOW = "rows that show it"
# Factor by which calibration certificates differ from what is true; beyond it the rows themselves have to show it.
CERTIFIED = 1.5


@dataclass(frozen=True)
class Check:
    """name: of what was looked at. figure beside threshold: a failed check's is on the wrong side; None where there is
    no number. says: one sentence. decides: whether a claim needs it: where it fails there is none, and where it cannot
    tell the table is undecided."""

    name: str
    result: Result
    figure: float | None
    threshold: float | None
    says: str
    decides: bool = True

    def plain(self) -> dict[str, Any]:
        """As referee.json holds it."""
        return asdict(self)


# What a referee looks at: a fitted model, its rows, and how well they were measured.


@dataclass(frozen=True)
class Case:
    """fit: of the model that is claimed; plain: of the one without what was found, None where nothing was. rows: those
    with an answer. whiten: of the noise as it was found to be. scale: largest readings (2,). accuracy: as stated.
    fold: in which the kinematic states were left out, (N,). effects: those that are claimed."""

    fit: WhiteFit
    plain: WhiteFit | None
    rows: Rows
    whiten: Whitener
    scale: Tensor
    accuracy: Accuracy
    fold: np.ndarray
    effects: Sequence[str] = ()

    @cached_property
    def present(self) -> Tensor:
        """Readings that count, (N, 2) bool: those that are there and did not slip."""
        scatter = self.whiten.scatter
        return self.whiten.told if scatter is None else self.whiten.told & self.whiten.right

    @cached_property
    def scatters_more(self) -> bool:
        """Whether readings of a kind scatter more than was stated: their sensor is worse, or the model."""
        if self.whiten.scatter is None:
            return False
        return bool((self.whiten.scatter.deviations > CERTIFIED)[self.present.any(0)].any())

    @property
    def places_assumed(self) -> bool:
        """Whether the errors of places are what is usual beside such readings, because too few states show them."""
        return self.whiten.scatter is not None and self.whiten.scatter.assumed

    @cached_property
    def states(self) -> int:
        """How many kinematic states there are."""
        return len(np.unique(self.rows.state))

    @cached_property
    def covariance(self) -> Tensor:
        """Of the raw vector, (p, p): of the rows and of what was known beforehand."""
        return self.covariance_from()

    def covariance_from(self, rows: Tensor | None = None) -> Tensor:
        """The same as some rows know it, (N,) bool."""
        return self.fit.covariance(rows, self.whiten.efficiency)

    def error(self, raw: Tensor, of: Tensor | None = None) -> float:
        """The paper's E of residuals (N, 2), a fraction, on all rows or on some, (N,) bool."""
        right = self.present if of is None else self.present & of[:, None]
        return relative_error((raw / self.scale).square(), right)

    def expected(self, of: Tensor, without: Tensor | None = None, places: float = 1.0) -> float:
        """The E that noise and what is not known of the parameters would make on some rows, (N,) bool.

        without: covariance (p, p) of a fit that did not see them. places: times that errors of places are as large as
        they were found to be."""
        by_place = self.whiten.places.square().sum(-1).nan_to_num(0.0, 0.0, 0.0)
        variance = self.noise + (places**2 - 1) * torch.where(self.present, by_place, 0.0)
        if without is not None:
            by = self.fit.raw_jacobian
            variance = variance + torch.einsum("ncp,pq,ncq->nc", by, without, by).clamp_min(0)
        return relative_error(variance / self.scale**2, self.present & of[:, None])

    def draws(self, places: float = 1.0) -> float:
        """Of how many independent errors of one size the square of what noise makes would scatter as much: few, where
        few states were set with errors that make most of it (Satterthwaite 1946). places: as `expected` has it."""
        right, scale = self.present[..., None], self.scale[:, None]
        by = torch.where(right, self.whiten.places / scale, 0.0).nan_to_num(0.0, 0.0, 0.0)
        own = (self.noise / self.scale**2 - by.square().sum(-1)).clamp_min(0)
        of_states = places**2 * self.whiten.gathered(by.mT @ by)
        total = own.sum() + of_states.diagonal(dim1=1, dim2=2).sum()
        return float(total**2 / (own.square().sum() + of_states.square().sum()))

    @cached_property
    def noise(self) -> Tensor:
        """Variance of every reading as it was found to scatter, place and all, (N, 2) SI."""
        return torch.where(self.present, self.whiten.scattered, 0.0)

    @cached_property
    def floor(self) -> float:
        """The E that noise alone would make, as it was found to scatter."""
        every = torch.ones(len(self.rows), dtype=torch.bool)
        return self.expected(every)
