"""What the plan `few` adds up to: rates, and every table with its answer, printed and as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from hidden_effects.rates import Row, rate, rates_table
from rich.console import Console

from freelearn.common.csv_text import csv_text
from freelearn.common.files import write_text
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.discovery.thresholds import TIES

# σ and states from which on an effect has to be found; floors between the states at which an answer is right, or wrong.
LARGE, STATES = 15.0, 5
# Of effects that are hidden together, what the others cannot do in one's place, in σ: from, up to.
ALONE = ((0.0, 4.0), (4.0, 8.0), (8.0, 15.0), (15.0, float("inf")))
RIGHT, REFUTED = 1.3, 2.0


def report_few(results: list[dict[str, Any]], out: Path) -> None:
    """Prints the rates and what every answer was, and writes both: rates.md, tables.csv."""
    console, frame = Console(width=120), told(results)
    rows = rates(frame)
    title = f"{len(results)} tables, plan few"
    console.print(rates_table(title, rows))
    for line in lines(frame):
        console.print(f"  {line}", markup=False, soft_wrap=True)
    write_text(out / "rates.md", markdown(title, rows))
    cells = frame.assign(classes=frame["classes"].map(lambda groups: ["/".join(group) for group in groups]))
    cells = cells.drop(columns=["sizes", "values", "formulas", "alone"]).map(
        lambda c: "; ".join(map(str, c)) if isinstance(c, list) else c
    )
    write_text(out / "tables.csv", csv_text(cells))
    console.print(f"files: {out}", soft_wrap=True)


def told(results: list[dict[str, Any]]) -> pd.DataFrame:
    """The results, with what follows of each: what is claimed and listed, found, wrong, and refuted."""
    each = []
    for r in results:
        hidden, groups = set(r["hidden"]), [set(group) for group in r["classes"]]
        claims = r["verdict"] in CLAIMS
        listed = hidden & set().union(*groups)
        each.append(r | {
            "reason": r.get("reason", ""), "claims": claims, "banded": r.get("banded"), "ahead": r.get("ahead"),
            "listed": len(listed), "found": len(listed) if claims else 0,
            "names": claims and bool(groups), "wrong": claims and any(not group & hidden for group in groups),
            "fresh": float("nan") if r["fresh"] is None else r["fresh"],
            "together": float("nan") if r["fresh_together"] is None else r["fresh_together"],
            "size": min(r["sizes"].values(), default=0.0),
        })  # fmt: skip
    return pd.DataFrame(each)


def rates(frame: pd.DataFrame) -> list[Row]:
    """Rows of the report."""
    none, one, unknown, several = (frame[frame["kind"] == k] for k in ("none", "one", "unknown", "several"))
    large = one[(one["size"] >= LARGE) & (one["states"] >= STATES)]
    claims = frame[frame["claims"]]
    rows = rate("nothing hidden: nothing named", none, ~none["names"].astype(bool), "≥ 97")
    rows += rate("nothing hidden: called adequate", none, none["verdict"] == "adequate", "")
    what = f"one effect, ≥ {LARGE:g} σ, ≥ {STATES} states: in the answer"
    rows += rate(what, large, large["found"] == 1, "≥ 80") or [(what, 0, "–", "≥ 80")]
    enough = one[one["size"] >= LARGE]
    rows += rate(f"one effect, ≥ {LARGE:g} σ: in the answer", enough, enough["found"] == 1, "")
    rows += rate("one effect, of any size, in any table: in the answer", one, one["found"] == 1, "")
    rows += rate("one effect: listed, claimed or not", one, one["listed"] == 1, "")
    rows += rate("unknown: an effect of the library named", unknown, unknown["names"] & ~_written(unknown), "")
    if len(several):
        hidden = int(several["hidden"].map(len).sum())
        rows.append(("three or four: effects in the answer", hidden, _share(several["found"].sum(), hidden), "≥ 70"))
        rows.append(
            ("three or four: effects listed, claimed or not", hidden, _share(several["listed"].sum(), hidden), "")
        )
    rows += _by_size(several)
    looked = several[several["ahead"].notna()]
    what = "three or four: what was hidden is more probable than all that is told (odds of 20 to 1)"
    rows += rate(what, looked, looked["ahead"].astype(float) > TIES, "0")
    rows += rate("three or four: tables with nothing wrong named", several, ~several["wrong"].astype(bool), "≥ 90")
    rows += rate(f"three or four: between the states ≤ {RIGHT:g} floors", several, several["fresh"] <= RIGHT, "≥ 85")
    words = "… predicted by all sets that are as good (average=true)"
    rows += rate(words, several, several["together"] <= RIGHT, "≥ 85")
    rows += rate(f"all: between the states ≤ {RIGHT:g} floors", frame, frame["fresh"] <= RIGHT, "")
    rows += rate(words, frame, frame["together"] <= RIGHT, "")
    what = f"claims that states in between refute (> {REFUTED:g} floors)"
    rows += rate(what, claims, ~(claims["fresh"] <= REFUTED), "≤ 2")
    bands = frame["banded"].dropna()
    if len(bands):
        inside, wide = (100 * bands.str[0]), bands.str[1]
        told = f"{inside.mean():.1f}, {inside.median():.1f}"
        rows.append(("a new measurement in between within the bands: mean, median", len(bands), told, "95"))
        rows.append(("… their σ over what is missed: median (not %)", len(bands), f"{wide.median():.2f}", "1"))
    for verdict in ("unexplained", "undecided", "failed"):
        rows += rate(verdict, frame, frame["verdict"] == verdict, "0" if verdict == "failed" else "")
    kept = frame.loc[frame["verdict"] == "unexplained", "effects"].map(len)
    if len(kept):
        told = f"{kept.median():g}, {kept.max():g}"
        rows.append(("effects kept where unexplained: median, most (not %)", len(kept), told, "0, ≤ 2"))
    seconds = frame["seconds"]
    told = f"{seconds.median():.0f}, {seconds.max():.0f}"
    return [*rows, ("seconds a table: median, most (not %)", len(frame), told, "")]


def lines(frame: pd.DataFrame) -> list[str]:
    """Every table in words: what is hidden, what is said, and the error between the states in floors."""
    found = []
    for r in frame.to_dict("records"):
        sizes = [f"{name} {size:.0f} σ" for name, size in r["sizes"].items()]
        hidden = ", ".join(sizes) or r["unknown"] or "nothing"
        answer = "; ".join("/".join(group) for group in r["classes"]) or r["reason"] or "nothing"
        stopped = f" (stopped by {', '.join(r['stopped'])})" if r["stopped"] else ""
        found.append(
            f"{r['number']} {r['tubes']}, {r['states']} states, stated × {r['misstated']:.2g}: {hidden} → "
            f"{r['verdict']}: {answer}{stopped}; {r['fresh']:.2f} floors, {r['seconds']:.0f} s"
        )
    return found


def markdown(title: str, rows: list[Row]) -> str:
    """The rates as a table of Markdown."""
    cells = [f"| {what} | {count} | {value} | {target} |" for what, count, value, target in rows]
    return "\n".join([f"| {title} | of | rate % | target |", "|---|---|---|---|", *cells, ""])


def _by_size(several: pd.DataFrame) -> list[Row]:
    """Rows of the report: effects that are hidden together, by what the others cannot do in their place."""
    effects = pd.DataFrame([
        {"alone": alone, "found": each["claims"] and any(name in group for group in each["classes"])}
        for each in several.to_dict("records") for name, alone in each["alone"].items()
    ], columns=["alone", "found"])  # fmt: skip
    rows: list[Row] = []
    for least, most in ALONE:
        part = effects[(effects["alone"] >= least) & (effects["alone"] < most)]
        between = f"≥ {least:g} σ" if most == float("inf") else f"{least:g} to {most:g} σ"
        rows += rate(f"… that the others cannot stand in for by {between}: in the answer", part, part["found"], "")
    return rows


def _written(frame: pd.DataFrame) -> pd.Series:
    """Whether the answer has a form that the search wrote itself."""
    return frame["verdict"] == "proposed"


def _share(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.1f}"
