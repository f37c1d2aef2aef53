"""One table of a regular protocol, searched as discover.py does; and what all of them add up to."""

from __future__ import annotations

import time
from typing import Any

import pandas as pd
import torch
from hidden_effects.examine_few import as_read, asked, said
from hidden_effects.rates import answer, rate, rates_table, seconds
from hidden_effects.regular import PROTOCOLS, make
from rich.console import Console

from freelearn.data.columns import usable_rows
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.discovery.search.search import search


def examine_regular(job: dict[str, Any]) -> dict[str, Any]:
    """Makes a table, searches it, and says what came out; all JSON."""
    torch.set_num_threads(1)
    made, accuracy = make(job)
    table = as_read(made, PROTOCOLS[job["protocol"]].bed)
    question = asked(table[usable_rows(table)].reset_index(drop=True), accuracy, job["seed"])
    began = time.perf_counter()
    found = search(question)
    return job | said(found, []) | {"rows": len(question.rows), "seconds": time.perf_counter() - began}


def report_regular(results: list[dict[str, Any]]) -> None:
    """Prints what is said of the tables, by gauge, and every answer that is not right."""
    console, frame = Console(width=120), pd.DataFrame(results)
    frame = frame.assign(
        names=frame["classes"].map(bool) & frame["verdict"].isin(CLAIMS),
        right=[_right(result) for result in results],
    )
    none, one = (frame[frame["kind"] == kind] for kind in ("none", "one"))
    rows = rate("nothing hidden: nothing named", none, ~none["names"], "≥ 97")
    for (visits, gauge), part in none.groupby(["visits", "gauge"]):
        what = f"nothing hidden, gauge of {100 * gauge:g} %{', three visits' * (visits > 1)}: adequate"
        rows += rate(what, part, part["right"], "")
    for visits, part in one.groupby("visits"):
        rows += rate(f"one effect{', three visits' * (visits > 1)}: in the answer", part, part["right"], "")
    console.print(rates_table(f"{len(frame)} tables, plan regular", rows))
    for r in frame[~frame["right"]].to_dict("records"):
        line = f"  {r['number']} {r['protocol']} × {r['visits']}, gauge {100 * r['gauge']:g} %: {answer(r)}"
        console.print(line, markup=False, soft_wrap=True)
    console.print(seconds(frame))


def _right(result: dict[str, Any]) -> bool:
    """Whether the effect that is hidden is in the answer, or none is looked for where none is hidden."""
    if not result["hidden"]:
        return result["verdict"] == "adequate"
    return result["verdict"] in ("named", "class") and any(result["hidden"][0] in c for c in result["classes"])
