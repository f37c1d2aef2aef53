"""Numbers of a specimen table that look wrong."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.specimen_stresses import Stresses

# No rubber carries this much nominal stress [MPa]; soft silicones in kPa do exceed it.
LARGEST_MPA = 100.0
# Rubber tears before it is ten times its length.
LARGEST_STRETCH = 12.0
# Stresses beyond this share of the largest have a sign that noise does not turn.
CLEAR = 0.1
# Stretches that differ by less than this share are alike, and clear stresses that differ by more than this are not.
ALIKE = 0.01
UNLIKE = 0.1


def suspicions(table: pd.DataFrame) -> list[str]:
    """A sentence for each mode of a table whose numbers suggest another unit or sign; nothing is converted."""
    sentences = []
    for mode, rows in table.groupby("mode", sort=False):
        held = Stresses.of(rows)
        largest = np.abs(held.stress_mpa).max()
        if largest > LARGEST_MPA:
            unit, factor = ("Pa", 1e-6) if largest > 1e4 else ("kPa", 1e-3)
            sentences.append(
                f"stress_mpa of mode {mode} looks like {unit} (largest {largest:.4g}, more than rubber carries): "
                f"in MPa it would be {factor * largest:.4g}."
            )
        longest = max(held.along.max(), held.across.max())
        if longest > LARGEST_STRETCH:
            sentences.append(f"stretch of mode {mode} looks like percent (largest {longest:.4g}): at rest it is 1.")
        # A direction pulls where it is longer than the free one (the inequalities of Baker & Ericksen 1954).
        pulls = np.sign(held.along - 1 / (held.along * held.across))
        wrong = (pulls * held.stress_mpa < -CLEAR * largest).sum()
        if wrong:
            sentences.append(
                f"{wrong} stresses of mode {mode} pull where the specimen is stretched less than through its thickness "
                "or push where it is more: look whether stretch holds strains, or the stress has the other sign."
            )
        sentences += _uneven(rows, CLEAR * largest)
    return sentences


def _uneven(rows: pd.DataFrame, clear: float) -> list[str]:
    """A sentence if rows of one mode, stretched alike in both directions, carry stresses that are not."""
    one, two = rows["stress_mpa"].abs(), rows["stress_2_mpa"].abs()
    least, most = np.minimum(one, two), np.maximum(one, two)
    alike = (rows["stretch"] / rows["stretch_2"] - 1).abs() < ALIKE
    uneven = alike & (most > clear) & (most - least > UNLIKE * most)
    if not uneven.any():
        return []
    difference = 100 * (1 - least / most)[uneven].max()
    return [
        f"{uneven.sum()} rows of mode {rows['mode'].iloc[0]} are stretched alike in both directions, but their "
        f"stresses differ by up to {difference:.0f} %: look whether a column or a series is another's."
    ]
