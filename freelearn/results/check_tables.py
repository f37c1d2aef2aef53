"""The look at a table before a search, as a table and as sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.inference.checks.check import CANNOT, FAIL, PASS, TableCheck
from freelearn.results.formats import number
from freelearn.results.tables import DisplayTable

WORDS = {PASS: "pass", FAIL: "FAIL", CANNOT: "cannot tell"}


def check_table(checks: Sequence[Mapping[str, Any]]) -> DisplayTable:
    """checks: as discovery.json holds them."""
    rows = [
        [
            *(check["name"], WORDS[check["status"]]),
            *("" if check[name] is None else number(check[name], 3) for name in ("figure", "threshold")),
            TableCheck(**check).sentence,
        ]
        for check in checks
    ]
    return DisplayTable.of(
        ["looked at", "result"], ["figure", "threshold"], rows, title="A look at the table, before any search",
        last=["what it says"],
    )  # fmt: skip


def check_lines(checks: Sequence[TableCheck], overruled: bool) -> list[str]:
    """Those that failed with what to do, and how many there were. overruled: by checks=off."""
    failed = [check for check in checks if check.status == FAIL]
    lines = [check.sentence for check in failed]
    if lines:
        what = "overruled by checks=off" if overruled else "nothing will be claimed; checks=off overrules them"
        lines.append(f"{len(failed)} of {len(checks)} checks of the table failed: {what}.")
    return lines
