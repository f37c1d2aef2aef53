"""Whether the model answers the rows, and comes anywhere near them."""

from __future__ import annotations

import numpy as np

from freelearn.inference.checks.check import FAIL, PASS, TableCheck
from freelearn.inference.checks.plain import Plain
from freelearn.measurements.beds import bed_of

FEWEST, MOST = 0.9, 0.5


def answers(plain: Plain) -> TableCheck:
    """Share of the rows that have loads at all."""
    share = plain.itself.answered
    if share >= FEWEST:
        return TableCheck("rows answered", PASS, share, FEWEST, "The plain model answers nearly all rows.")
    says = (
        f"The plain model has loads for {100 * share:.0f} % of the rows only: the others ask for a state that no such "
        "tube has; look at the length, the radii, the angle and the units of what is imposed."
    )
    return TableCheck("rows answered", FAIL, share, FEWEST, says)


def leaves(plain: Plain) -> TableCheck:
    """What the plain model leaves of the readings' range."""
    shares = {
        quantity.name: channel
        for quantity, channel in zip(bed_of(plain.table).readings, plain.channels, strict=True)
        if np.isfinite(channel)
    }
    name, worst = max(shares.items(), key=lambda each: each[1], default=("", 0.0))
    if worst <= MOST:
        return TableCheck("range left", PASS, worst, MOST, "The plain model follows the readings roughly.")
    says = (
        f"The plain model misses the {name} by {100 * worst:.0f} % of its range: no effect mends as much; look at "
        "what the column holds, its sign and its unit."
    )
    return TableCheck("range left", FAIL, worst, MOST, says)
