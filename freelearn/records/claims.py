"""What the referee says of a claim: its file, and how sure the claim is as tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.files import write_text
from freelearn.common.formats import all_finite, error_percent, number, percent
from freelearn.discovery.referee.case import Check
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.discovery.search.search import Findings

# How sure a claim is, as tables: the checks of the referee, the sets of effects that are as good, and the
# probability of each effect.

# How a result is told; what was no part of the claim is told as it is, and not counted.
RESULTS = {"pass": "pass", "fail": "fail", "cannot_tell": "cannot tell"}
# Effects less probable than this are not told.
LEAST = 0.005


def checks_table(
    checks: Sequence[Mapping[str, Any]], says: bool = True, asked: Sequence[str] = ()
) -> DisplayTable | None:
    """The checks of a referee.json, those that stand against the claim first; None where there are none. says: with
    their sentences. asked: effects of the model that was looked at, where it is not the last one.

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
    caption = f"Asked of the model with {' + '.join(asked)}; the last model keeps what of it stands." if asked else ""
    last = ["says"] if says else []
    return DisplayTable.from_rows(
        ["check", "result"], ["figure", "threshold"], rows, "Does the claim stand", caption, last=last
    )


def check_lines(checks: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the checks say that a claim needs and did not get."""
    return [
        f"{c['name']}, {RESULTS.get(c['result'], c['result'])}: {c['says']}"
        for c in by_weight(checks)
        if c["result"] != "pass" and c.get("decides", True)
    ]


def passed_beyond(checks: Sequence[Mapping[str, Any]]) -> list[str]:
    """What checks say whose figure lies beyond the threshold and that pass all the same.

    >>> check = {"name": "accuracy of the force", "result": "pass", "figure": 3.3, "threshold": 1.5, "says": "Noise."}
    >>> passed_beyond([check, {**check, "figure": 1.2}])
    ['accuracy of the force, pass: Noise.']
    """
    known = [c for c in checks if c["result"] == "pass" and None not in (c["figure"], c["threshold"])]
    return [f"{c['name']}, pass: {c['says']}" for c in known if c["figure"] > c["threshold"] > 1]


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
    return DisplayTable.from_rows(
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
    return DisplayTable.from_rows(
        ["effect"], ["probability %"], [[name, percent(share, 1)] for name, share in told],
        title="How probable each effect is",
        caption="The sum over all sets that have it: of several that look alike each has its part.",
    )  # fmt: skip


REFEREE = "referee.json"


def write_referee(findings: Findings, folder: Path) -> None:
    """What was claimed, what of it stands, and every check with its figure and threshold. Nothing where none was
    made."""
    if findings.referee is None:
        (folder / REFEREE).unlink(missing_ok=True)
        return
    checks = [check.plain() for check in findings.referee.checks]
    content = {"claimed": findings.claimed, "verdict": findings.verdict, "checks": checks}
    write_text(folder / REFEREE, json.dumps(all_finite(content), indent=2, allow_nan=False) + "\n")


# What the referee says of a run that has ended, and its file.


@dataclass(frozen=True)
class RefereedRun:
    """claimed: what the run's search would claim, empty for a run of train; verdict: what stands of it. visible: by
    effect and parameter, the smallest size (SI) that such a table would show. simulated: the tally of searches of
    simulated tables, empty where none were asked for; told: the same in words."""

    folder: Path
    claimed: str
    verdict: str
    checks: Sequence[Check]
    visible: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    simulated: Mapping[str, Any] = field(default_factory=dict)
    told: Sequence[str] = ()

    def frame(self) -> pd.DataFrame:
        """The checks: each with its result, figure, threshold and what it says."""
        return pd.DataFrame([check.plain() for check in self.checks])

    def stands(self) -> str:
        """What of the claim does, in a sentence."""
        if self.claimed not in CLAIMS:
            return f"Nothing was claimed ({self.verdict})." if self.verdict else "Nothing was claimed."
        if self.claimed == self.verdict:
            return f"What was claimed ({self.claimed}) stands."
        return f"What was claimed ({self.claimed}) does not stand: {self.verdict}."

    def summary(self) -> str:
        """What stands, and what the checks say that did not pass."""
        return "\n".join([self.stands(), *check_lines([check.plain() for check in self.checks]), *self.told])

    def _repr_html_(self) -> str:
        said = escape(self.summary().split("\n")[0])
        return f"<p>{said}</p>{self.frame()[['name', 'result', 'says']].to_html(index=False, border=0)}"

    def write(self) -> None:
        """referee.json in the run's folder."""
        checks = [check.plain() for check in self.checks]
        content: dict[str, Any] = {
            "claimed": self.claimed,
            "verdict": self.verdict,
            "checks": checks,
            "visible": self.visible,
        }
        if self.simulated:
            content["simulated"] = {**self.simulated, "says": list(self.told)}
        write_text(self.folder / REFEREE, json.dumps(all_finite(content), indent=2, allow_nan=False) + "\n")
