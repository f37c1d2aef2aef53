"""Are the parameters what rubber, threads and sensors have, and do the rows determine them?"""

from __future__ import annotations

import math
from collections.abc import Mapping

from freelearn.common.formats import in_words
from freelearn.data.beds import INFLATION, behind
from freelearn.discovery.fits.white_fit import GONE
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, Case, Check
from freelearn.physics.chain.material import FIBERS, RUBBER
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.chain.priors import spans

# A parameter whose error is this share of what was known beforehand is not determined by the rows.
UNDETERMINED = 0.7
# Standard errors that a parameter of the model's own moves, from where its effects enter, to be told.
MOVED = 3.0


def parameters(case: Case) -> list[Check]:
    """Plausible, off their bounds, and determined."""
    return [_plausible(case), _determined(case), *_moved(case)]


def _plausible(case: Case) -> Check:
    sizes, values = spans(case.rows), case.fit.values()
    wrong = []
    for name, p in case.fit.model.declared.items():
        if name in case.fit.model.unnatural or p.fixed:
            continue
        low, high = p.plausible(sizes)
        value = values[name]
        if not low - _slack(low) <= value <= high + _slack(high):
            wrong.append((name, value, low, high, p))
        elif _at_limit(p, value):
            wrong.append((name, value, p.lower, p.upper, p))
    if not wrong:
        return Check(
            "parameters plausible", PASS, None, None, "Every parameter is one that such actuators and beds have."
        )
    name, value, low, high, p = max(wrong, key=lambda w: _beyond(w[1], w[2], w[3]))
    usual = f"{in_words(low)} to {in_words(high)}{behind(p.unit)}"
    says = f"{name} = {in_words(value)}{behind(p.unit)} is not what such actuators have: {usual}"
    says += f" ({p.known.source})." if p.known.source else "."
    if case.rows.states.bed is INFLATION and p.known in (RUBBER, FIBERS):
        says += " Of a vessel say material=artery."
    if len(wrong) > 1:
        others = [w[0] for w in wrong if w[0] != name]
        says += f" Nor {'is' if len(others) == 1 else 'are'} {', '.join(others)}."
    return Check("parameters plausible", FAIL, value, high if value > high else low, says)


def _slack(end: float) -> float:
    return 1e-6 * abs(end)


def _beyond(value: float, low: float, high: float) -> float:
    return max(low - value, value - high) / max(abs(high - low), 1e-300)


def _at_limit(p: Parameter, value: float) -> bool:
    """Whether it rests on a bound that is no physical limit: one between its prior's ends."""
    if p.none is None or not math.isfinite(p.upper) or p.upper == 1.0:
        return False
    return (p.none not in (p.upper,) and value >= p.upper * (1 - 1e-9)) or (
        p.none != p.lower and value <= p.lower + _slack(p.lower)
    )


def _determined(case: Case) -> Check:
    """Errors beside what was known beforehand, and parameters that no reading depends on any more."""
    labels, prior = case.fit.model.labels(), case.fit.prior
    error = case.covariance.diagonal().clamp_min(0).sqrt()
    moved = case.fit.jacobian.flatten(0, 1).square().sum(0).sqrt()
    loss = float(case.fit.residual.square().sum().sqrt())
    declared = case.fit.model.declared
    own = [i for i, x in enumerate(labels) if "." not in x and x in declared and not declared[x].fixed]
    gone = [labels[i] for i in own if float(moved[i]) <= GONE * max(loss, 1.0)]
    if gone:
        says = f"No reading depends on {', '.join(gone)} any more: it has gone to {_where(case, gone[0])}."
        return Check("parameters determined", FAIL, float(moved[labels.index(gone[0])]), GONE * loss, says)
    loose = []
    if prior is not None:
        before = prior.covariance.diagonal().sqrt()
        told = [i for i, free in enumerate(case.fit.model.free.tolist()) if free]
        loose = [labels[i] for i in told if float(error[i]) > UNDETERMINED * float(before[i])]
    if loose:
        known = "its value is" if len(loose) == 1 else "their values are"
        says = f"The rows hardly determine {', '.join(loose)}: {known} what was known beforehand."
        return Check("parameters determined", CANNOT, None, UNDETERMINED, says, decides=False)
    return Check(
        "parameters determined", PASS, None, None, "Of every parameter the rows say more than was known beforehand."
    )


def _where(case: Case, label: str) -> str:
    value = case.fit.values()[label]
    return f"{value:.2g} {case.fit.model.declared[label].unit}"


def _moved(case: Case) -> list[Check]:
    """How far the model's own parameters went when the effects entered."""
    if case.plain is None:
        return []
    before: Mapping[str, float] = dict(zip(case.plain.model.labels(), case.plain.vector.tolist(), strict=True))
    error = case.plain.covariance().diagonal().clamp_min(0).sqrt()
    told = []
    values = case.plain.values(), case.fit.values()
    for i, label in enumerate(case.plain.model.labels()):
        if "." in label or label not in case.fit.model.declared or float(error[i]) <= 0:
            continue
        now = float(case.fit.vector[case.fit.model.labels().index(label)])
        if abs(now - before[label]) > MOVED * float(error[i]):
            told.append(f"{label} from {values[0][label]:.3g} to {values[1][label]:.3g}")
    if not told:
        return []
    says = f"With what was found, {'; '.join(told)} {case.fit.model.declared[told[0].split()[0]].unit}."
    return [Check("parameters moved", PASS, None, None, says, decides=False)]
