"""Which runs are not exported: those whose claim, or whose parameters, the data do not determine."""

from __future__ import annotations

import numpy as np

from freelearn.results.estimate import Estimate
from freelearn.results.fitted_model import FittedModel


def doubts(fitted: FittedModel) -> list[str]:
    """Why the model should not be relied on elsewhere, a sentence each; none where it may."""
    found, content = [], fitted.run.content
    if content.get("verdict") == "undecided":
        found.append("The verdict of the run is undecided: the table cannot tell what the actuator is.")
    variance, declared = np.diagonal(fitted.covariance), list(fitted.model.declared.items())
    entries = content.get("parameters") or {}
    untold = {n for n, entry in entries.items() if Estimate.from_plain(n, entry).untold}
    lost = [
        name
        for (name, p), v in zip(declared, variance, strict=True)
        if not p.fixed and (name in untold or not np.isfinite(v))
    ]
    if lost:
        nothing = len(lost) == len(declared)
        which = "Nothing was fitted to the data, or nothing of it is known" if nothing else "The data do not determine"
        found.append(f"{which}: {', '.join(lost)}." if nothing else f"{which} {', '.join(lost)}.")
    return found
