"""What residuals look like in the order of measuring, in rising and falling pressure, level by level; and bands."""

from __future__ import annotations

import numpy as np
import torch
from scipy import stats

from freelearn.inference.referee.case import Case
from freelearn.inference.referee.check import CANNOT, FAIL, PASS, Check

# Chance at which a pattern counts, of few that are looked at; and the size in σ below which it does not matter.
CHANCE, MATTERS = 1e-4, 0.5
FEWEST = 20
# Share of new readings that 95 % bands must hold, of those left out; and chance of fewer.
HOLD = 0.85


def patterns(case: Case, raw: torch.Tensor | None = None) -> list[Check]:
    """raw: residuals (N, 2) of rows that were left out, for the bands."""
    return [_order(case), _branches(case), *([] if raw is None else [_bands(case, raw)])]


def _white(case: Case) -> np.ndarray:
    """Whitened residuals, (N, 2), NaN where nothing was read."""
    white: np.ndarray = np.where(case.present.numpy(), case.fit.residual.numpy(), np.nan)
    return white


def _order(case: Case) -> Check:
    """Neighbors in the order of measuring: correlation of each residual with the next of the same channel."""
    white, sample = _white(case), case.rows.states.sample.numpy()
    pairs = [
        (a, b)
        for channel in white.T
        for a, b, same in zip(channel[:-1], channel[1:], sample[1:] == sample[:-1], strict=True)
        if same and np.isfinite(a) and np.isfinite(b)
    ]
    name = "order of measuring"
    if len(pairs) < FEWEST:
        return Check(name, CANNOT, None, None, "Too few rows follow each other.", decides=False)
    correlation = float(stats.spearmanr(*np.array(pairs).T).statistic)
    chance = float(2 * stats.norm.sf(abs(correlation) * np.sqrt(len(pairs))))
    says = f"Each residual and the next one correlate by {correlation:.2f}."
    if chance < CHANCE and abs(correlation) > MATTERS:
        return Check(name, FAIL, abs(correlation), MATTERS, f"{says} What is left goes on from row to row.")
    return Check(name, PASS, abs(correlation), MATTERS, says, decides=False)


def _branches(case: Case) -> Check:
    """Rising against falling pressure."""
    direction, white = case.rows.states.direction.numpy(), _white(case)
    name = "rising against falling"
    if min((direction > 0).sum(), (direction < 0).sum()) < FEWEST / 2:
        return Check(name, CANNOT, None, None, "The rows hardly have both rising and falling pressure.", decides=False)
    worst, chance = 0.0, 1.0
    for channel in white.T:
        up, down = (channel[(direction == s) & np.isfinite(channel)] for s in (1, -1))
        if min(len(up), len(down)) < FEWEST / 2:
            continue
        p = float(stats.ttest_ind(up, down, equal_var=False).pvalue)
        if p < chance:
            worst, chance = float(up.mean() - down.mean()), p
    says = f"Between rising and falling pressure residuals differ by {abs(worst):.2f} σ."
    if chance < CHANCE and abs(worst) > MATTERS:
        return Check(name, FAIL, abs(worst), MATTERS, says)
    return Check(name, PASS, abs(worst), MATTERS, says)


def _bands(case: Case, raw: torch.Tensor) -> Check:
    """Share of readings left out that lie within 95 % of noise and parameters."""
    by = case.fit.raw_jacobian
    variance = case.noise + torch.einsum("ncp,pq,ncq->nc", by, case.covariance, by).clamp_min(0)
    inside = raw.abs() <= 1.96 * variance.sqrt()
    share = float(inside[case.present].double().mean()) if bool(case.present.any()) else 1.0
    says = f"95 % bands hold {100 * share:.0f} % of the readings that were left out."
    if share < HOLD and case.states >= FEWEST:
        return Check("bands", FAIL, share, HOLD, says)
    return Check("bands", PASS if share >= HOLD else CANNOT, share, HOLD, says, decides=False)
