"""The error before and after effects were added, on the same rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from freelearn.data.error import common, load_scale, set_error
from freelearn.data.rows import Rows
from freelearn.data.sets import samples_of, set_names
from freelearn.discovery.noise.noise import relative_error
from freelearn.discovery.search.search import Findings
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status

EVERY = "every"


def errors_by_set(findings: Findings, whole: Rows, test: str = EVERY) -> dict[str, dict[str, float]]:
    """The paper's error of the first and of the last model on test sets: {set: {before, after}}, fractions.

    whole: every usable row of the table. test: one set's name, or every. On samples that were fitted it is that of
    held-out kinematic states, without readings that slipped, on others that of all rows; sets with both kinds of
    samples are left out.
    """
    sample, fitted_sample = whole.states.sample.numpy(), findings.rows.states.sample.numpy()
    errors = {}
    for name in set_names(sample) if test == EVERY else [test]:
        members = samples_of(name, sample)
        fitted = np.isin(members, fitted_sample)
        if fitted.all():
            pair = _heldout(findings, np.isin(fitted_sample, members))
        elif not fitted.any():
            models = [findings.steps[0].fit.model, findings.final.fit.model]
            pair = common_errors(models, whole[torch.as_tensor(np.flatnonzero(np.isin(sample, members)))])
        else:
            continue
        if pair:
            errors[name] = dict(zip(("before", "after"), pair, strict=True))
    return errors


def common_errors(models: Sequence[Model], rows: Rows) -> list[float]:
    """The paper's error of each model on the rows (N) that all of them answer, scaled by the largest loads of all rows;
    nothing if there is no such row.

    Compared on the rows that each of them answers, a model that answers more would look worse for it.
    """
    with torch.no_grad():
        answers = [model(rows.states) for model in models]
    answered = common(*(status == Status.OK for _, status in answers))
    if not bool(answered.any()):
        return []
    return [set_error(rows, loads, answered).E for loads, _ in answers]


def _heldout(findings: Findings, inside: np.ndarray) -> list[float]:
    chosen = torch.as_tensor(np.flatnonzero(inside))
    found = findings.final.whiten.scatter
    present = findings.rows.readings.present[chosen]
    right = present if found is None else present & ~found.slipped[chosen]
    scale = load_scale(findings.rows.loads[chosen] * right)
    missed = [step.heldout.raw[chosen] / scale for step in (findings.steps[0], findings.final)]
    return [relative_error(each.square(), right) for each in missed]
