"""An effect that a search wrote, in words: from its entry of discovery.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from freelearn.models.written.written import Constant, Written
from freelearn.results.formats import number, percent

INPUTS = {"direction": "direction of the pressure change", "severity": "severity of the state"}


def proposal_lines(entry: Mapping[str, Any], written: Written) -> list[str]:
    """What it is, its constants, what it mends, what the data cannot tell from it, and what it resembles.

    written: with its constants as the entry has them."""
    of = " and ".join(INPUTS.get(name, name) for name in written.inputs_named)
    before, after, floor = (percent(entry["error"][name], 3) for name in ("before", "after", "noise_floor"))
    lines = [
        f"{written.name}: the {written.place.changes} depends on the {of}: {written.formula}, {units_told(written)}",
        f"its constants: {'; '.join(constants_told(entry, written))}",
        f"the held-out error goes from {before} to {after} %, and measuring alone leaves {floor} %",
        *_chance(entry["places"]),
        *_twins(entry["twins"]),
    ]
    if alike := entry["resembles"]:
        share = percent(alike["share"], 0)
        lines.append(f"of the library {alike['effect']} would explain most of the same: {share} % of it")
    return lines


def constants_told(entry: Mapping[str, Any], written: Written) -> list[str]:
    """Each constant with its standard error, in the units of tables: a = 10.2 ± 0.1 N·mm."""
    return [_constant(c, entry["parameters"][c.name]["stderr"]) for c in written.constants()]


def units_told(written: Written) -> str:
    """What the inputs are told in: φ in units of 115 °."""
    pairs = zip(written.inputs, written.scales, strict=True)
    return ", ".join(f"{i.symbol} in units of {number(s / i.factor, 4)} {i.shown}".rstrip() for i, s in pairs)


def _constant(constant: Constant, stderr: float | None) -> str:
    error = None if stderr is None else abs(stderr / constant.factor)
    unit = f" {constant.shown}" if constant.shown else ""
    return f"{constant.symbol} = {number(constant.start / constant.factor, 4)} ± {number(error, 2)}{unit}"


def _chance(places: list[dict[str, Any]]) -> list[str]:
    # A search of former times does not know it.
    least = min((place["p_value"] for place in places if "p_value" in place), default=None)
    if least is None:
        return []
    told = "the chance that noise alone would promise as much in some form somewhere"
    return [f"{told} is {percent(least, 1)} % at most"]


def _twins(twins: list[dict[str, Any]]) -> list[str]:
    same = [t for t in twins if t["E_heldout"] is None]
    other = [f"{t['port']} ({t['where']}): {t['formula']}" for t in twins if t["E_heldout"] is not None]
    lines = [
        f"at the port {t['port']} ({t['where']}) the same function would show the very same loads" for t in same[:1]
    ]
    return [*lines, f"the data cannot tell it from {'; '.join(other)}"] if other else lines
