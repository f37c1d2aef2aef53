"""The folder that a search leaves which wrote an effect itself."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np

from freelearn.discovery.proposals.proposal import Proposal, Twin
from freelearn.discovery.proposals.unknown_function import Unknown
from freelearn.physics.written.forms import ONE
from freelearn.physics.written.places import ELONGATION, PLACES
from freelearn.physics.written.written_effect import Written
from freelearn.records import written_effects
from freelearn.records.written_effects import ProposalCurve, proposal_lines

FORCE = next(place for place in PLACES if place.name == "parallel axial")
HINGE = next(form for form in ONE if form.word == "hinge")
# A cable that is taut beyond 2 mm.
CABLE = Written(FORCE, (ELONGATION,), (6e-3,), HINGE, {"amount": 3.0, "knee": 2e-3})
FLOOR = 0.0106


def proposal(written: Written = CABLE) -> Proposal:
    """As the search tells it, without the fits that it comes from."""
    twins = [
        Twin("measurement", "force", ["elongation"], "hinge", written.formula, None),
        Twin("parallel", "axial", ["elongation"], "exponential", "ΔF = a (exp(k Δl) − 1)", 0.0113),
    ]
    base, step = SimpleNamespace(E_heldout=0.046), SimpleNamespace(E_heldout=0.0101)
    return Proposal(written, base, step, twins, resembles=("length_offset", 0.29))  # type: ignore[arg-type]


def told(written: Written = CABLE) -> list[str]:
    """What terminal and report say of it."""
    with _errors():
        return proposal_lines(written_effects.proposal_entry(proposal(written), FLOOR), written)


def _errors():
    return mock.patch.object(written_effects, "_stderr", return_value={"amount": 0.0124, "knee": 1.02e-5})


def write_search(folder: Path, written: Written = CABLE, hint: bool = False) -> str:
    """Writes the files of a search that found nothing else; the effect's name. hint: where it stays unexplained."""
    folder.mkdir(parents=True, exist_ok=True)
    with _errors():
        entry = written_effects.proposal_entry(proposal(written), FLOOR)
        if not hint:
            written_effects.write_proposals([proposal(written)], "continuum", FLOOR, folder)
    content = {
        "verdict": "unexplained" if hint else "proposed",
        "says": "Unexplained." if hint else "Proposed: the search wrote it.",
        "effects": [] if hint else [written.name],
        "proposals": [] if hint else [entry],
        "hint": entry if hint else None,
        **{name: [] for name in ("given_effects", "classes", "screens", "next_experiment", "notes", "candidates")},
        "remainder": None,
        "error": {"before": 0.046, "after": 0.0101, "noise_floor": FLOOR},
        "parameters": {"C1": {"value": 1e6, "unit": "Pa"}},
        "trail": [
            {"effect": name, "effects": [name] if name else [], "E_heldout": error, "noise_floor": FLOOR}
            for name, error in ((None, 0.046), (written.name, 0.0101))
        ],
    }
    (folder / "discovery.json").write_text(json.dumps(content))
    at = np.linspace(-6e-3, 6e-3, 13)
    form = 3.0 * np.maximum(at - 2e-3, 0) / 6e-3
    curve = ProposalCurve.from_unknown(written, Unknown(ELONGATION, at, form, form + 0.01, form - 0.02, form + 0.04))
    curve.numbers.to_csv(folder / f"proposal_{written.name}.csv", index=False)
    return written.name
