"""What is told of an export: how far it is from the model, where it holds, what it was made of."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freelearn.common.files import write_text
from freelearn.export.actuator_functions import Functions
from freelearn.export.checks import Checks
from freelearn.export.export_options import Options, versions
from freelearn.export.round_trip import Written
from freelearn.records.provenance import with_digests

CERTIFICATE, PAGE = "export.json", "export.html"


@dataclass(frozen=True)
class Certificate:
    """content: of export.json. folder: where it lies. checks: of every function, None where nothing here could run the
    export."""

    folder: Path
    content: dict[str, Any]
    checks: Checks | None

    @property
    def held(self) -> bool | None:
        """Whether the round trip held; None where there was none."""
        return None if self.checks is None else bool(self.content["round_trip"]["held"])

    @property
    def files(self) -> list[Path]:
        """What was written, the file to use first."""
        return [self.folder / name for name in self.content["files"]]

    def __repr__(self) -> str:
        """The same as the summary: the content is a file's."""
        return self.summary()

    def summary(self) -> str:
        """In a few lines."""
        c = self.content
        lines = [f"{c['title']} → {', '.join(c['files'])}", *c["warnings"]]
        if self.checks is None:
            return "\n".join([*lines, "not run here: no round trip"])
        trip = c["round_trip"]
        what = "samples of recordings, and states," if "step" in trip["functions"] else "states,"
        lines.append(f"round trip over {trip['states']} {what} largest difference as a share of the range:")
        for check in self.checks.every.values():
            told = "; ".join(f"{what} {share:.1e}" for what, share in _gathered(check.largest))
            wrong = "".join(f"; {n} wrong {count} times" for n, count in check.wrong.items() if count)
            lines.append(f"  {check.function}: {told}{wrong}")
        lines += c["broken"]
        verdict = "held" if trip["held"] else "NOT HELD"
        lines.append(f"allowed {trip['limit']:g}: {verdict}")
        return "\n".join([*lines, f"beyond the data: {100 * trip['outside']['flagged']:g} % of states flagged"])


def _gathered(largest: dict[str, float]) -> list[tuple[str, float]]:
    """Differences by output, derivatives and bands together."""
    kinds = {
        "derivatives": [n for n in largest if n.startswith("d_")],
        "bands": [n for n in largest if "_half_band" in n],
    }
    among = [n for some in kinds.values() for n in some]
    alone = [(n, v) for n, v in largest.items() if n not in among]
    return [*alone, *((kind, max(largest[n] for n in some)) for kind, some in kinds.items() if some)]


def certificate(
    functions: Functions,
    folder: Path,
    options: Options,
    written: Written,
    checks: Checks | None,
    doubts: list[str],
) -> Certificate:
    """Writes export.json to the folder."""
    fitted = functions.actuator.fitted
    content: dict[str, Any] = {
        "name": options.name,
        "to": options.to,
        "title": fitted.title,
        "actuator": _design(functions),
        "parameters": {n: {"value": v, "unit": fitted.model.declared[n].unit} for n, v in fitted.parameters.items()},
        "domain": {
            p.name: {"least": low, "most": high, "unit": p.unit}
            for view in functions.views
            for p, (low, high) in zip(view.actuator.imposed, view.actuator.domain, strict=True)
        },
        "functions": [
            {
                "name": f.name,
                "about": f.about,
                "inputs": [vars(p) for p in f.given],
                "outputs": [vars(p) for p in f.answered],
                **({"state": [vars(p) | {"initial": 0.0} for p in f.state]} if f.carried else {}),
                "operations": f.operations,
            }
            for f in (functions.every if options.to not in ("table", "mujoco") else [])
        ],
        "outside": written.outside,
        "round_trip": _trip(checks, written) if checks else None,
        "broken": written.broken,
        "forced": bool(doubts),
        "warnings": doubts,
        "notes": [*written.notes, *functions.lacks],
        "data": _data(functions, options),
        "versions": versions(options.to),
        **written.more,
    }
    names = [path.name for path in written.files]
    whole = with_digests(content, folder, names)
    write_text(folder / CERTIFICATE, json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    return Certificate(folder, whole, checks)


def _design(functions: Functions) -> dict[str, Any]:
    actuator = functions.actuator
    design = actuator.fitted.design
    row = design if actuator.states.members else design[design["sample"] == actuator.sample]
    plain = row.iloc[0].to_dict()
    return {str(k): float(v) for k, v in plain.items() if isinstance(v, int | float) and math.isfinite(v)}


def _trip(checks: Checks, written: Written) -> dict[str, Any]:
    """What is asked first at the top, and every function by its name."""
    first = checks.first.plain
    held = checks.held and not written.broken
    outside = {"states": checks.outside, "flagged": checks.flagged}
    every = {name: check.plain for name, check in checks.every.items()}
    return first | {"held": held, "outside": outside, "functions": every}


def _data(functions: Functions, options: Options) -> dict[str, Any]:
    run = functions.actuator.fitted.run
    content, table = run.content, run.table
    # Of the numbers that were measured and imposed, whatever file they came from.
    shown = table[[c for c in table if "_pred" not in str(c) and c not in ("status", "split")]]
    digest = hashlib.sha256(shown.to_csv(index=False).encode()).hexdigest()
    return {
        "name": content.get("data", {}).get("name"),
        "simulated": bool(content.get("data", {}).get("simulated", False)),
        "train": content.get("train"),
        "rows": len(shown),
        "digest": digest,
        "run": content.get("digest"),
        "license": options.license,
    }
