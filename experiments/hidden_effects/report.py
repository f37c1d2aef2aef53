"""What the benchmark's results add up to, in words and pictures."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from hidden_effects import pictures
from hidden_effects.rates import (
    REACHED,
    by_setting,
    of_braids,
    of_clean,
    of_directions,
    of_laboratory,
    of_moves,
    of_unknown,
    rates_table,
    right,
    seconds,
    slips_of,
    table,
)
from rich.console import Console

from freelearn.testing.reference.truths import MOVED


def report(results: list[dict], plan: str, out: Path, beside: list[dict]) -> None:
    """Prints the rates against their targets, and what went wrong, and draws the pictures.

    beside: results of the plan `clean`, to be drawn beside those of another."""
    console = Console(width=120)
    frame = pd.DataFrame(results)
    frame["right"] = [right(r) for r in results]
    frame["possible"] = [possible(r) for r in results]
    rates = {
        "laboratory": of_laboratory, "braids": of_braids, "moves": of_moves, "unknown": of_unknown,
        "directions": of_directions,
    }  # fmt: skip
    console.print(rates_table(f"{len(results)} data sets, plan {plan}", rates.get(plan, of_clean)(frame)))
    if plan == "laboratory":
        headings = ["measured with", "sets", "right at 15 σ", "nothing named", "slips found", "accused %", "intervals"]
        title = "By how it was measured: rates in %, in brackets of how many"
        console.print(table(title, headings, by_setting(frame)))
    if "seconds" in frame:
        console.print(seconds(frame))
    for line in missed(frame):
        console.print(f"  {line}", markup=False, soft_wrap=True)
    if plan in ("unknown", "directions"):
        return
    one = _one(results)
    if plan == "laboratory":
        standard = one[one["protocol"] == "standard"]
        normal = standard["laboratory"].map(lambda s: not s)
        series = {"as laboratories measure": standard, "of these, clean noise": standard[normal]}
        pictures.recovery({"the paper's protocol, clean noise": _one(beside)} | series, out)
        pictures.detection(slips_of(frame), out)
    elif plan == "braids":
        groups = one.groupby(["tubes", "bed"], sort=False)
        pictures.recovery({f"{tubes}, {bed} bed": part for (tubes, bed), part in groups}, out)
    elif plan == "moves":
        pictures.recovery({f"{name} hidden": one[one["hidden"].map(lambda h, n=name: h == [n])] for name in MOVED}, out)
    else:
        pictures.recovery({"the paper's protocol, clean noise": one}, out)
    pictures.confusion(one[one["size"] >= 8], out)
    console.print(f"files: {out}", soft_wrap=True)


def report_wrong(results: list[dict]) -> None:
    """Prints in how many tables the fault itself is said, by kind, and of how many anything is claimed."""
    console, frame = Console(width=160), pd.DataFrame(results)
    rows = []
    for kind, part in [*frame.groupby("kind", sort=False), ("all", frame)]:
        said, claims = f"{100 * part['said'].mean():.0f}", str(int(part["claim"].astype(bool).sum()))
        rows.append([str(kind), str(len(part)), said, str(int(part["refused"].sum())), claims])
    headings = ["mapped wrongly", "tables", "fault said %", "refused", "claims"]
    console.print(table(f"{len(results)} data sets, plan wrong (targets: ≥ 85 % said, no claim)", headings, rows))
    console.print(seconds(frame))
    for _, r in frame[~frame["said"]].iterrows():
        line = f"  not said {r['number']}: {r['fault']} ({r['kind']}, {r['source']}) → {r['sentences'] or 'nothing'}"
        console.print(line, markup=False, soft_wrap=True)


def _one(results: list[dict]) -> pd.DataFrame:
    """Those of the results with one hidden effect."""
    chosen = [r | {"right": right(r)} for r in results if r["kind"] == "one" and possible(r)]
    return (
        pd.DataFrame(chosen) if chosen else pd.DataFrame(columns=["size", "right", "protocol", "laboratory", "hidden"])
    )


def possible(result: dict) -> bool:
    """Whether what is hidden can be tested on its rows, and is about as large as it was to be."""
    sizes = result.get("reached", [])
    return result.get("testable", True) and all(size >= REACHED * result["size"] for size in sizes)


def missed(frame: pd.DataFrame) -> list[str]:
    """Data sets with the wrong answer, in words."""
    hidden = frame["kind"].isin(["one", "pair", "triple"]) & (frame["size"] >= 8)
    named = frame["kind"].eq("none") & frame["effects"].map(bool)
    lines = []
    for _, r in frame[(hidden & ~frame["right"] & frame["possible"]) | named].iterrows():
        how = r.get("laboratory")
        told = f" ({r['protocol']}, {how})" if isinstance(how, dict) else ""
        if "tubes" in r:
            told = f" ({r['tubes']}, {r['bed']} bed)"
        what = f"{'+'.join(r['hidden']) or 'nothing'} at {r['size']} σ{told}"
        lines.append(f"missed {r['number']}: {what} → {r['verdict']} {r['classes'] or r.get('reason', '')}")
    return lines
