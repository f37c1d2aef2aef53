"""What is told of an export: how far it is from the model, where it holds, what it was made of."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freelearn.common.files import write_text
from freelearn.export.actuator import Actuator
from freelearn.export.export_options import Options, versions
from freelearn.export.round_trip import Difference, Written
from freelearn.records.provenance import with_digests

CERTIFICATE, PAGE = "export.json", "export.html"


@dataclass(frozen=True)
class Certificate:
    """content: of export.json. folder: where it lies. difference: of the round trip, None where nothing here could run
    the export."""

    folder: Path
    content: dict[str, Any]
    difference: Difference | None

    @property
    def held(self) -> bool | None:
        """Whether the round trip held; None where there was none."""
        return None if self.difference is None else bool(self.content["round_trip"]["held"])

    @property
    def files(self) -> list[Path]:
        """What was written, the file to use first."""
        return [self.folder / name for name in self.content["files"]]

    def summary(self) -> str:
        """In a few lines."""
        c = self.content
        lines = [f"{c['title']} → {', '.join(c['files'])}", *c["warnings"]]
        if self.difference is None:
            return "\n".join([*lines, "not run here: no round trip"])
        trip = c["round_trip"]
        worst = ", ".join(f"{name} {share:.1e}" for name, share in trip["largest_difference"].items())
        verdict = "held" if trip["held"] else "NOT HELD"
        lines.append(
            f"round trip over {trip['states']} states: largest difference {worst} of the range "
            f"(allowed {trip['limit']:g}): {verdict}"
        )
        return "\n".join([*lines, f"beyond the data: {100 * trip['outside']['flagged']:g} % of states flagged"])


def certificate(
    actuator: Actuator,
    folder: Path,
    options: Options,
    written: Written,
    difference: Difference | None,
    doubts: list[str],
) -> Certificate:
    """Writes export.json to the folder."""
    fitted = actuator.fitted
    content: dict[str, Any] = {
        "name": options.name,
        "to": options.to,
        "title": fitted.title,
        "actuator": _design(actuator),
        "parameters": {n: {"value": v, "unit": fitted.model.declared[n].unit} for n, v in fitted.parameters.items()},
        "domain": {
            p.name: {"least": low, "most": high, "unit": p.unit}
            for p, (low, high) in zip(actuator.imposed, actuator.domain, strict=True)
        },
        "functions": []
        if options.to in ("table", "mujoco")
        else [
            {
                "name": f.name,
                "about": f.about,
                "inputs": [vars(p) for p in f.inputs],
                "outputs": [vars(p) for p in f.outputs],
                "operations": f.operations,
            }
            for f in actuator.functions
        ],
        "outside": written.outside,
        "round_trip": _trip(difference, written) if difference else None,
        "forced": bool(doubts),
        "warnings": doubts,
        "notes": written.notes,
        "data": _data(actuator, options),
        "versions": versions(options.to),
        **written.more,
    }
    names = [path.name for path in written.files]
    whole = with_digests(content, folder, names)
    write_text(folder / CERTIFICATE, json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    return Certificate(folder, whole, difference)


def _design(actuator: Actuator) -> dict[str, Any]:
    design = actuator.fitted.design
    row = design if actuator.states.members else design[design["sample"] == actuator.sample]
    plain = row.iloc[0].to_dict()
    return {str(k): float(v) for k, v in plain.items() if isinstance(v, int | float) and math.isfinite(v)}


def _trip(difference: Difference, written: Written) -> dict[str, Any]:
    finite = {n: v if math.isfinite(v) else -1.0 for n, v in difference.largest.items()}
    return {
        "states": difference.states,
        "on_edge": difference.on_edge,
        "settled": difference.settled,
        "largest_difference": finite,
        "ranges": difference.ranges,
        "worst_state": difference.worst,
        "statuses_that_differ": difference.statuses,
        "limit": written.limit,
        "held": difference.most <= written.limit and difference.statuses == 0 and difference.flagged == 1.0,
        "outside": {"states": difference.outside, "flagged": difference.flagged},
    }


def _data(actuator: Actuator, options: Options) -> dict[str, Any]:
    content = actuator.fitted.run.content
    table = actuator.fitted.run.table
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
