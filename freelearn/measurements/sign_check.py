"""Which loads rise with their own place, where a tube without pressure is a spring."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

# Share of the pressures' range that counts as hardly any, fewest rows there, and the slope of a load by its own place,
# in standard errors, that no spring has.
CALM, FEWEST_CALM, RISES = 0.1, 8, 4.0


def signs(used: pd.DataFrame) -> Iterator[str]:
    """A sentence for each load that rises: stretched, a spring pulls (F falls), and turned, it turns back (M falls)."""
    pressure = used["pressure_kpa"]
    calm = used[pressure <= pressure.min() + CALM * (pressure.max() - pressure.min())]
    calm = calm[calm["slack"] != 1] if "slack" in calm else calm
    places = [name for name in ("elongation_mm", "twist_deg") if name in calm and calm[name].nunique() >= 3]
    for load, place in (("force_n", "elongation_mm"), ("moment_nmm", "twist_deg")):
        if load not in calm or place not in places:
            continue
        rows = calm[[load, place, *(name for name in places if name != place), "sample"]].dropna()
        if len(rows) >= FEWEST_CALM and _rise(rows) > RISES:
            yield (
                f"{load} may have its sign turned: at the lowest pressures it rises with {place}, as if the tube drove "
                "itself on, where a spring would pull back."
            )


def _rise(rows: pd.DataFrame) -> float:
    """Slope of the first column by the second, the others held, in standard errors; each sample has its own level."""
    apart = rows.drop(columns="sample") - rows.groupby("sample").transform("mean")
    load, places = apart.iloc[:, 0].to_numpy(), apart.iloc[:, 1:].to_numpy()
    inverse = np.linalg.pinv(places.T @ places, hermitian=True)
    slope = inverse @ places.T @ load
    freedom = len(rows) - rows["sample"].nunique() - len(slope)
    left = float(((load - places @ slope) ** 2).sum()) / max(freedom, 1)
    error = (left * inverse[0, 0]) ** 0.5
    return float(slope[0] / error) if error > 0 else 0.0
