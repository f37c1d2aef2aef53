"""How sure a claim is, as tables: the checks of the referee, the sets of effects that are as good, and the probability
of each effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.results.formats import error_percent, number, percent
from freelearn.results.tables import DisplayTable

# How a result is told; what was no part of the claim is told as it is, and not counted.
RESULTS = {"pass": "pass", "fail": "fail", "cannot_tell": "cannot tell"}
# Effects less probable than this are not told.
LEAST = 0.005


def checks_table(checks: Sequence[Mapping[str, Any]], says: bool = True) -> DisplayTable | None:
    """The checks of a referee.json, those that stand against the claim first; None where there are none. says: with
    their sentences.

    >>> check = {"name": "bands", "result": "fail", "figure": 0.7, "threshold": 0.85, "says": "70 % hold."}
    >>> print(checks_table([check]).text())
    check  result  figure  threshold  says
    bands  fail       0.7       0.85  70 % hold.
    """
    if not checks:
        return None
    rows = [
        [
            *(c["name"], RESULTS.get(c["result"], c["result"]), number(c["figure"], 3), number(c["threshold"], 3)),
            *([c["says"]] if says else []),
        ]
        for c in by_weight(checks)
    ]
    return DisplayTable.of(
        ["check", "result"], ["figure", "threshold"], rows, title="Does the claim stand", last=["says"] if says else []
    )


def check_lines(checks: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the checks say that a claim needs and did not get."""
    return [
        f"{c['name']}, {RESULTS.get(c['result'], c['result'])}: {c['says']}"
        for c in by_weight(checks)
        if c["result"] != "pass" and c.get("decides", True)
    ]


def by_weight(checks: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Those that refute a claim first, then those that it would need, then all others, each in their own order."""
    order = {"fail": 0, "cannot_tell": 1}
    return sorted(checks, key=lambda c: order.get(c["result"], 2) if c.get("decides", True) else 2)


def models_table(models: Sequence[Mapping[str, Any]]) -> DisplayTable | None:
    """The sets of effects of a discovery.json that fit as well as the best, the most probable first; None for none.

    >>> model = {"effects": [], "probability": 0.75, "E_heldout": 0.0123}
    >>> print(models_table([model]).text())
    effects    probability %  E held-out %
    no effect           75.0         1.230
    """
    if not models:
        return None
    rows = [
        [" + ".join(m["effects"]) or "no effect", percent(m["probability"], 1), error_percent(m["E_heldout"], 3)]
        for m in models
    ]
    return DisplayTable.of(
        ["effects"], ["probability %", "E held-out %"], rows, title="Sets of effects that fit as well as the best",
        caption="Probability among all sets that the search looked at.",
    )  # fmt: skip


def shares_table(shares: Mapping[str, float]) -> DisplayTable | None:
    """How probable each effect is to be part of what is missing; None where none is.

    >>> print(shares_table({"end_clamps": 0.98, "force_gain": 1e-9}).text())
    effect      probability %
    end_clamps           98.0
    """
    told = sorted(((name, share) for name, share in shares.items() if share >= LEAST), key=lambda pair: -pair[1])
    if not told:
        return None
    return DisplayTable.of(
        ["effect"], ["probability %"], [[name, percent(share, 1)] for name, share in told],
        title="How probable each effect is",
        caption="The sum over all sets that have it: of several that look alike each has its part.",
    )  # fmt: skip
