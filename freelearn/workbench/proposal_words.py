"""What the page says of an effect that a search wrote, from discovery.json: the words of results.proposals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from freelearn.inference.proposals.unknown import Unknown
from freelearn.models.written.written import Constant, Written
from freelearn.results.formats import number, percent, sentence
from freelearn.results.proposal_curve import ProposalCurve

HINT = "Hint, not a finding: the largest part of it looks like "
INPUTS = {"direction": "direction of the pressure change", "severity": "severity of the state"}


def proposal_sentences(entry: Mapping[str, Any], written: Written) -> list[str]:
    """What it is, its constants, what it mends, what the data cannot tell from it, and what it resembles."""
    of = " and ".join(INPUTS.get(name, name) for name in written.inputs_named)
    pairs = zip(written.inputs, written.scales, strict=True)
    units = ", ".join(f"{i.symbol} in units of {number(s / i.factor, 4)} {i.shown}".rstrip() for i, s in pairs)
    constants = "; ".join(_constant(c, entry["parameters"][c.name]["stderr"]) for c in written.constants())
    before, after, floor = (percent(entry["error"][name], 3) for name in ("before", "after", "noise_floor"))
    said = [
        f"its constants: {constants}",
        f"the held-out error goes from {before} to {after} %, and measuring alone leaves {floor} %",
        *_twins(entry["twins"]),
    ]
    if alike := entry["resembles"]:
        share = percent(alike["share"], 0)
        said.append(f"of the library {alike['effect']} would explain most of the same: {share} % of it")
    first = f"{written.name}: the {written.place.changes} depends on the {of}: {written.formula}, {units}."
    return [first, *map(sentence, said)]


def _constant(constant: Constant, stderr: float | None) -> str:
    """With its standard error, in the units of tables."""
    error = None if stderr is None else abs(stderr / constant.factor)
    unit = f" {constant.shown}" if constant.shown else ""
    return f"{constant.symbol} = {number(constant.start / constant.factor, 4)} ± {number(error, 2)}{unit}"


def _twins(twins: list[dict[str, Any]]) -> list[str]:
    same = [t for t in twins if t["E_heldout"] is None]
    other = [f"{t['port']} ({t['where']}): {t['formula']}" for t in twins if t["E_heldout"] is not None]
    lines = [
        f"at the port {t['port']} ({t['where']}) the same function would show the very same loads" for t in same[:1]
    ]
    return [*lines, f"the data cannot tell it from {'; '.join(other)}"] if other else lines


def proposal_curve(table: pd.DataFrame, written: Written) -> ProposalCurve | None:
    """From the table beside a search's picture; None where it is of something else."""
    over = next((i for i in written.inputs if i.name == table.columns[0]), None)
    if over is None or [*table.columns[1:]] != ["form", "free", "low", "high"]:
        return None
    of, *others = (table[name].to_numpy(dtype=np.float64) for name in table)
    unit = written.place.factor
    return ProposalCurve.of(written, Unknown(over, of * over.factor, *(values * unit for values in others)))
