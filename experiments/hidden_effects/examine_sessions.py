"""Tables of samples that differ, searched as discover.py does; and what all of them add up to."""

from __future__ import annotations

import time
from typing import Any

import pandas as pd
import torch
from hidden_effects.examine_few import as_read, asked, said
from hidden_effects.make import NOISE
from hidden_effects.rates import answer, rate, rates_table, seconds
from hidden_effects.sessions import make
from rich.console import Console

from freelearn.data.columns import usable_rows
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.discovery.search.search import search


def examine_sessions(job: dict[str, Any]) -> dict[str, Any]:
    """Makes a table, searches it, and says what came out; all JSON."""
    torch.set_num_threads(1)
    table = as_read(make(job), "kinematic")
    question = asked(table[usable_rows(table)].reset_index(drop=True), NOISE, job["seed"])
    began = time.perf_counter()
    found = search(question)
    return job | said(found, []) | {"rows": len(question.rows), "seconds": time.perf_counter() - began}


def report_sessions(results: list[dict[str, Any]]) -> None:
    """Prints what is said of the tables, by what differs, and every answer that is not right."""
    console, frame = Console(width=120), pd.DataFrame(results)
    frame = frame.assign(wrong=[_wrong(r) for r in results], whole=[_whole(r) for r in results])
    rows = rate("claims of which part is not hidden", frame, frame["wrong"], "0")
    for (differs, kind), part in frame.groupby(["differs", "kind"], sort=False):
        beside = " and one effect" if kind == "beside" else ""
        rows += rate(f"{differs}{beside}: all of it in the answer, nothing else", part, part["whole"], "")
    console.print(rates_table(f"{len(frame)} tables, plan sessions", rows))
    for r in frame[~frame["whole"]].to_dict("records"):
        line = f"  {r['number']} {r['differs']}, {answer(r)}"
        console.print(line, markup=False, soft_wrap=True)
    console.print(seconds(frame))


def _wrong(result: dict[str, Any]) -> bool:
    """Whether something is claimed of which no member is hidden."""
    hidden = {*result["own"], *result["shared"], *result["hidden"]}
    return result["verdict"] in CLAIMS and any(not hidden & set(members) for members in result["classes"])


def _whole(result: dict[str, Any]) -> bool:
    """Whether all that is hidden is claimed, and nothing else."""
    hidden = {*result["own"], *result["hidden"]}
    there = all(any(name in members for members in result["classes"]) for name in hidden)
    return result["verdict"] in CLAIMS and there and not _wrong(result)
