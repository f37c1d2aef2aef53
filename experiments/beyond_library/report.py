"""What the results add up to, beside the targets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from freelearn.discovery.referee.referee import CLAIMS

# Targets: fresh error over the floor and how often, extrapolated error, and seconds.
GOAL, EXTRAPOLATED, SECONDS = 1.2, 2.0, 60.0
# Times the floor beyond which fresh states refute a claim.
REFUTED = 2.0


def report(results: list[dict], half: str) -> None:
    """Prints rates by place and size, overall beside the targets, on the control sets, and, of the open half, what was
    answered for what."""
    console = Console(width=160)
    frame = pd.DataFrame([_flat(r) for r in results])
    if frame.empty:
        console.print("no data sets")
        return
    hidden = frame[frame["kind"].notna() & frame["possible"]]
    if len(hidden):
        console.print(_by_group(hidden, half))
    console.print(_overall(frame, hidden, half))
    failed = frame[frame["verdict"] == "failed"]
    for reason, part in failed.groupby("reason"):
        console.print(f"failed ({len(part)}): {reason}", markup=False)
    if half == "open":
        for line in _answers(results):
            console.print(line, markup=False, soft_wrap=True)


def report_pairs(results: list[dict]) -> None:
    """Prints how often both parts of what is hidden were found, and what claims are worth on fresh states."""
    console = Console(width=160)
    possible = [r for r in results if r["possible"]]
    if not possible:
        console.print("no data sets")
        return
    table = _table(f"{len(possible)} data sets, two at once", ["what", "of", "rate %", "target"])

    def row(what: str, good: list[bool], target: str = "") -> None:
        if good:
            table.add_row(what, str(len(good)), f"{100 * np.mean(good):.0f}", target)

    twice, beside = ([r for r in possible if r[name]] for name in ("beside", "effect"))
    for name, chosen in {"two kinds": twice, "a kind beside an effect": beside, "all": possible}.items():
        row(f"{name}: both parts found", [all(r["parts"].values()) for r in chosen], "≥ 60")
        row(f"{name}: one part at least", [any(r["parts"].values()) for r in chosen])
        row(f"{name}: fresh error ≤ {GOAL} × floor", [_ratio(r) <= GOAL for r in chosen])
        claims = [r for r in chosen if r["verdict"] in CLAIMS]
        refuted = [_ratio(r) > REFUTED for r in claims]
        row(f"{name}: claims that fresh states refute (> {REFUTED:g} × floor)", refuted, "0")
    row("the effect, by its name or in a class", [r["parts"][r["effect"]] for r in beside])
    for verdict in (*CLAIMS, "undecided", "unexplained", "failed"):
        row(f"verdict {verdict}", [r["verdict"] == verdict for r in possible])
    console.print(table)
    for r in possible:
        told = [f"{p.get('where')} {p.get('form')} of {', '.join(p.get('inputs') or ())}" for p in r["proposals"]]
        found = ", ".join(f"{name} {'✓' if right else '✗'}" for name, right in r["parts"].items())
        said = f"{r['verdict']}: " + "; ".join(["/".join(group) for group in r["classes"]] + told)
        console.print(f"  {r['key']}: {found} → {said}, {_ratio(r):.2f} floors", markup=False, soft_wrap=True)


def _ratio(r: dict) -> float:
    value = r.get("fresh", {}).get("ratio")
    return np.inf if value is None else float(value)


def _flat(r: dict) -> dict:
    """What the tables need of a result."""
    flat: dict[str, Any] = {
        name: r.get(name) for name in ("key", "kind", "effect", "size", "group", "possible", "verdict", "reason")
    }
    flat |= {name: bool(r.get(name)) for name in ("port_right", "inputs_right", "form_right", "form_same")}
    for where in ("fresh", "fresh_before", "beyond", "beyond_before"):
        for name in ("ratio", "strict", "own"):
            value = r.get(where, {}).get(name)
            flat[f"{where}_{name}"] = np.inf if value is None else value
    proposed = r["verdict"] == "proposed" or bool(r.get("proposals"))
    # What is left of what was missing, root mean square beside sensors and pressure.
    before = flat["fresh_before_own"]
    left = flat["fresh_own"] / before if np.isfinite(before) and before > 0 else np.nan
    return flat | {"seconds": r["seconds"], "proposed": proposed, "left": left}


def _by_group(hidden: pd.DataFrame, half: str) -> Table:
    headings = ["place", "σ", "sets", "proposed %", "fresh", f"≤ {GOAL} %", "strict", f"≤ {GOAL} %", "left %"]
    headings += ["port %", "inputs %", "form %", "beyond", "s"]
    title = f"{len(hidden)} data sets, half {half}; error over floor before → after, what is left and seconds: medians"
    table = _table(title, headings)
    last = None
    groups = [
        *hidden.groupby(["group", "size"], sort=False),
        *((("all", size), p) for size, p in hidden.groupby("size")),
    ]
    for (group, size), part in groups:
        if last not in (None, group):
            table.add_section()
        cells = [_percent(part["proposed"])]
        for name in ("ratio", "strict"):
            cells.append(f"{_median(part[f'fresh_before_{name}'])} → {_median(part[f'fresh_{name}'])}")
            cells.append(_percent(part[f"fresh_{name}"] <= GOAL))
        cells.append(f"{100 * part['left'].median():.0f}")
        cells += [_percent(part[name]) for name in ("port_right", "inputs_right", "form_right")]
        cells += [_median(part["beyond_ratio"]), f"{part['seconds'].median():.0f}"]
        table.add_row(group if group != last else "", str(size), str(len(part)), *cells)
        last = group
    return table


def _overall(frame: pd.DataFrame, hidden: pd.DataFrame, half: str) -> Table:
    table = _table(f"overall, half {half}", ["what", "of", "rate %", "target"])

    def row(what: str, part: pd.DataFrame, good: Callable[[pd.DataFrame], pd.Series], target: str) -> None:
        if len(part):
            table.add_row(what, str(len(part)), _percent(good(part), 1), target)

    large = hidden[hidden["size"] >= 15]
    row(f"fresh error ≤ {GOAL} × floor", hidden, lambda p: p["fresh_ratio"] <= GOAL, "≥ 85")
    row("… before anything was added", hidden, lambda p: p["fresh_before_ratio"] <= GOAL, "")
    what = f"fresh error ≤ {GOAL} × the floor of sensors and pressure alone (strict)"
    row(what, hidden, lambda p: p["fresh_strict"] <= GOAL, "")
    row("… before anything was added", hidden, lambda p: p["fresh_before_strict"] <= GOAL, "")
    row("less than half of what was missing is left, 15 σ and more", large, lambda p: p["left"] < 0.5, "")
    for size, part in hidden.groupby("size"):
        row(f"proposed, {size} σ", part, lambda p: p["proposed"], "")
        row(f"port right, {size} σ", part, lambda p: p["port_right"], "≥ 90" if size >= 15 else "")
        row(f"inputs right, {size} σ", part, lambda p: p["inputs_right"], "≥ 90" if size >= 15 else "")
        target = "≥ 70" if size >= 30 else "≥ 50" if size >= 15 else ""
        row(f"form right, {size} σ", part, lambda p: p["form_right"], target)
        row(f"… and has its name, {size} σ", part, lambda p: p["form_same"], "")
    formed = hidden[hidden["form_right"]]
    row(
        f"≤ {EXTRAPOLATED:g} × floor beyond the box, form right",
        formed,
        lambda p: p["beyond_ratio"] <= EXTRAPOLATED,
        "",
    )
    controls = frame[frame["kind"].isna()]
    row("proposed where nothing is hidden", controls[controls["effect"].isna()], lambda p: p["proposed"], "≤ 2")
    row("proposed where one library effect is", controls[controls["effect"].notna()], lambda p: p["proposed"], "≤ 5")
    row(f"within {SECONDS:g} s", frame, lambda p: p["seconds"] <= SECONDS, "100")
    row("failed", frame, lambda p: p["verdict"] == "failed", "0")
    small = frame[~frame["possible"].astype(bool)]
    row("left out: a bound keeps it small", small, lambda p: ~p["possible"].astype(bool), "")
    return table


def _answers(results: list[dict]) -> list[str]:
    """What was answered for what, where it is not right."""
    lines = []
    for r in results:
        if r["kind"] is None and not r.get("proposals"):
            continue
        if r.get("form_right"):
            continue
        said = "; ".join(
            f"{p.get('port')}/{p.get('where')} {p.get('form')} of {', '.join(p.get('inputs') or ())}"
            for p in r.get("proposals") or []
        )
        lines.append(f"  {r['key']} → {r['verdict']} {r['effects'] or ''} {said}".rstrip())
    return lines


def _table(title: str, headings: list[str]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in headings:
        table.add_column(heading, justify="left" if heading in ("place", "what") else "right")
    return table


def _percent(hits: pd.Series, digits: int = 0) -> str:
    return f"{100 * hits.astype(float).mean():.{digits}f}"


def _median(values: pd.Series) -> str:
    return f"{values.median():.2f}"
