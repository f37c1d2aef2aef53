"""Rates by how it was measured."""

from __future__ import annotations

import pandas as pd
from hidden_effects.rates import LARGE, slips_of

# Name → key of a laboratory's settings.
SETTINGS = {"tails": "tails", "slips": "slipped", "growing noise": "growth"}


def by_setting(frame: pd.DataFrame) -> list[list[str]]:
    """How it was measured → data sets, right at 15 σ, nothing named where nothing is, slips found, accused, intervals.

    A data set counts in each setting that it has; clean is one that has none."""
    how = frame["laboratory"].map(dict)
    settings = {name: how.map(lambda s, key=key: key in s) for name, key in SETTINGS.items()}
    settings["misstated to a third"] = how.map(lambda s: s.get("misstated", 1) < 1)
    settings["misstated threefold"] = how.map(lambda s: s.get("misstated", 1) > 1)
    settings |= {name: frame["protocol"] == name for name in ("short", "sorted")}
    odd = pd.concat(settings, axis=1).any(axis=1)
    rows = []
    for name, chosen in {"clean noise": ~odd, **settings, "all": frame["seed"] > 0}.items():
        part = frame[chosen & frame["possible"]]
        one, none = part[part["kind"].eq("one") & part["size"].eq(15)], part[part["kind"] == "none"]
        slips = slips_of(part)
        large = slips[slips["sensor_sigmas"] >= LARGE]["found"] if len(slips) else pd.Series(dtype=bool)
        good = part["good_rows"].sum() if "good_rows" in part else 0
        accused = f"{100 * part['accused'].sum() / good:.2f}" if good else ""
        hits = pd.Series([hit for c in part.get("covered", pd.Series(dtype=object)).dropna() for hit in c.values()])
        cells = (one["right"], ~none["effects"].map(bool), large)
        rows.append([name, str(len(part)), *map(_percent, cells), accused, _percent(hits)])
    return rows


def _percent(hits: pd.Series) -> str:
    return f"{100 * hits.astype(float).mean():.0f} ({len(hits)})" if len(hits) else ""
