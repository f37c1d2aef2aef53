"""What came out of the closed loop, as a table."""

from __future__ import annotations

import numpy as np

from freelearn.common.display import DisplayTable

GRIDS = ("in order", "at random")
FEWER = 5


def report(results: list[dict]) -> str:
    """Rates, rows, and what was expected beside what happened."""
    told = [r for r in results if r["usable"]]
    rows = [
        ["first looks", f"{len(results)}"],
        ["classes of two with the truth", f"{sum('rival' in r for r in results)}"],
        ["of them twins within reach", f"{sum(r.get('twins', False) for r in results)}"],
        ["classes measured", f"{len(told)}"],
    ]
    if not told:
        return DisplayTable.from_rows(["what"], ["how many"], rows).text()
    rows.append(["split by planned rows", _share([r["split"] for r in told])])
    rows.append(["of these for the true effect", _share([r["right"] for r in told if r["split"]])])
    rows.append(
        ["planned rows, median and most", f"{np.median([r['rows'] for r in told]):.0f}, {max(r['rows'] for r in told)}"]
    )
    for order in GRIDS:
        grid = [r[order] for r in told]
        ratio = np.array([g["rows"] / r["rows"] for g, r in zip(grid, told, strict=True)])
        rows.append([f"grid {order}: rows, median", f"{np.median([g['rows'] for g in grid]):.0f}"])
        rows.append(
            [
                f"grid {order}: split, and for the true effect",
                f"{_share([g['split'] for g in grid])}, {_share([g['right'] for g in grid if g['split']])}",
            ]
        )
        rows.append([f"grid {order}: times as many rows, median", f"{np.median(ratio):.1f}"])
        rows.append([f"grid {order}: at least {FEWER} times as many", _share(list(ratio >= FEWER))])
    # A grid's first mounting may do: it has five rows, of which a plan's share may be two.
    hard = [r for r in told if r["at random"]["rows"] > 5 and r["in order"]["rows"] > 5]
    for order in GRIDS:
        fewer = [r[order]["rows"] >= FEWER * r["rows"] for r in hard]
        rows.append([f"of classes that no grid's first mounting splits, {order}", _share(fewer)])
    every = [one for r in told for one in r["rounds"]]
    for name, rounds in (("first plan", [r["rounds"][0] for r in told]), ("all plans", every)):
        expected, realized = (np.array([one[key] for one in rounds]) for key in ("expected", "realized"))
        rows.append([f"{name}: realized over expected, of summed χ²", f"{realized.sum() / expected.sum():.2f}"])
        signed = np.sign(realized) * np.sqrt(np.abs(realized))
        rows.append([f"{name}: realized over expected, mean σ", f"{signed.mean() / np.sqrt(expected).mean():.2f}"])
        rows.append([f"{name}: expected σ, median", f"{np.median(np.sqrt(expected)):.1f}"])
    rows.append(
        [
            "efficiency, least and median",
            f"{min(o['efficiency'] for o in every):.2f}, {np.median([o['efficiency'] for o in every]):.2f}",
        ]
    )
    rows.append(
        [
            "seconds a plan, median and most",
            f"{np.median([o['seconds'] for o in every]):.1f}, {max(o['seconds'] for o in every):.1f}",
        ]
    )
    again = [r for r in told if "again" in r]
    named = [r["again"] == "named" and r["again_classes"] == [[r["hidden"]]] for r in again]
    rows.append(["whole search afterwards: the true effect alone", _share(named)])
    return DisplayTable.from_rows(["what"], ["how many"], rows).text()


def _share(hits: list) -> str:
    return f"{100 * np.mean(hits):.0f} % of {len(hits)}" if hits else "–"
