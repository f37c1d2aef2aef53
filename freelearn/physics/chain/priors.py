"""What is known of a model's parameters before its table is looked at, as a normal distribution of its raw vector."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, FORCE, MOMENT
from freelearn.data.rows import Rows
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Prior

# Largest loads that count at least [N, N·m]: a sensor's errors are those of its range, not of a table without load.
LEAST_SPANS = {"force": 1.0, "moment": 1e-3}
# Correlation of what is one number, but for a thousandth.
ALIKE = 1 - 5e-7


def spans(rows: Rows) -> dict[str, float]:
    """Largest force [N] and moment [N·m] of a table, which errors of sensors and mounts are in proportion to.

    Under a dead load no sensor reads them: friction, and fittings and hoses that hang there unweighed, go by what the
    pressure pushes with against the end, and by its moment at the bore's radius, where that is more than what is hung.
    """
    states, readings = rows.states, rows.readings
    largest = dict(LEAST_SPANS)
    for number, quantity in enumerate(states.bed.readings):
        if quantity in (FORCE, MOMENT) and bool(readings.present[:, number].any()):
            size = float(readings.value[:, number].abs().max())
            largest[quantity.name] = max(size, largest[quantity.name])
    if states.bed is DEAD_LOAD:
        each = states.members or (states,)
        radius = torch.stack([m.inner_radius for m in each])
        push = math.pi * radius**2 * torch.stack([m.pressure.abs() for m in each])
        loads = {"force": (states.force, push.sum(0)), "moment": (states.moment, (push * radius).sum(0))}
        for name, both in loads.items():
            largest[name] = max(largest[name], *(float(load.abs().max()) for load in both))
    return largest


@dataclass(frozen=True)
class RawPrior:
    """A normal distribution of a raw vector. middle (p,); covariance (p, p), infinite variances where nothing is
    known."""

    middle: Tensor
    covariance: Tensor

    @property
    def root(self) -> Tensor:
        """R (p, p) with RᵀR the precision: ‖R (x − middle)‖² joins a fit's sum of squares. Zero rows where nothing is
        known."""
        known = self.covariance.diagonal().isfinite()
        root = torch.zeros_like(self.covariance)
        if bool(known.any()):
            part = torch.linalg.inv(self.covariance[known][:, known])
            root[known.nonzero(), known.nonzero().T] = torch.linalg.cholesky(part).mT
        return root

    def scaled(self, labels: Sequence[str], factors: Mapping[str, float], sized: Collection[str]) -> RawPrior:
        """The same with the deviations of some effects' parameters multiplied. sized: labels of those that say how
        large an effect is; its time constant, say, does not."""
        each = [factors.get(label.split(".")[0], 1.0) if label in sized else 1.0 for label in labels]
        factor = torch.tensor(each, dtype=torch.float64)
        return RawPrior(self.middle, self.covariance * factor[:, None] * factor)

    def tied(self, labels: Sequence[str], names: Collection[str]) -> RawPrior:
        """The same where some parameters are one number, but for a thousandth of their deviation; as it is where it
        says something else of each of them, as a user's own prior or a fixed value does. names: theirs, without what
        numbers samples or members."""
        one = torch.tensor([label.split("[")[0] in names for label in labels])
        said = torch.stack([self.covariance.diagonal()[one], self.middle[one]])
        if said.shape[1] < 2 or not bool((said.isfinite() & (said == said[:, :1])).all()):
            return self
        share = said[0, 0] * torch.full_like(self.covariance, ALIKE).fill_diagonal_(1.0)
        return RawPrior(self.middle, torch.where(one[:, None] & one, share, self.covariance))


def raw_prior(model: Model, spans: Mapping[str, float], given: Mapping[str, Prior] | None = None) -> RawPrior:
    """Of a model's raw vector. spans: see `spans`. given: a user's own priors, by label, in place of those declared.

    The values of several samples, or members, differ by less than the common value does. Weights, and the stiffness of
    the linear model, whose raw numbers are no parameters, have none; nor has what is fixed, which no row tells of.
    """
    labels = model.labels()
    count = len(labels)
    middle, deviation = torch.zeros(count, dtype=torch.float64), torch.full((count,), math.inf, dtype=torch.float64)
    common = torch.zeros(count, dtype=torch.float64)
    for i, label in enumerate(labels):
        if label not in model.declared or label in model.unnatural:
            continue
        p = model.declared[label]
        if p.fixed:
            continue
        prior = (given or {}).get(label) or (given or {}).get(label.split("[")[0]) or p.known
        size = spans.get(prior.of, 1.0)
        middle[i] = p.to_raw(size * prior.middle)
        deviation[i] = prior.deviation if p.log else size * prior.deviation
        common[i] = prior.common
    covariance = torch.diag(deviation**2)
    whole = [label.split("[")[0] for label in labels]
    for i in range(count):
        for j in range(count):
            if i != j and whole[i] == whole[j] and labels[i] in model.declared and math.isfinite(float(deviation[i])):
                covariance[i, j] = common[i] * deviation[i] * deviation[j]
    return RawPrior(middle, covariance)
