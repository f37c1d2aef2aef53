"""Effects that a search wrote, as plain values, and as files of their own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from textwrap import wrap
from typing import Any

from freelearn.files import write_text
from freelearn.inference.covariance import parameter_covariance
from freelearn.inference.proposals.proposal import Proposal, Twin
from freelearn.inference.search import Findings
from freelearn.models.effects.registry import lent
from freelearn.models.written.source import effect_class, source
from freelearn.results.proposal_words import proposal_lines

PROPOSED = "proposed"


def file_of(proposal: Proposal) -> str:
    """Name of the effect's file in the run's folder."""
    return f"{PROPOSED}_{proposal.written.name}.py"


@contextmanager
def known(findings: Findings) -> Iterator[None]:
    """The effects that the search wrote are known by their names: models with them can be built."""
    with lent(effect_class(p.written) for p in findings.proposals):
        yield


def proposal_entry(proposal: Proposal, floor: float) -> dict[str, Any]:
    """As in discovery.json. floor: the error of a perfect model. Parameters in SI."""
    written, errors = proposal.written, _stderr(proposal)
    return {
        "name": written.name,
        "file": file_of(proposal),
        "port": written.place.port,
        "where": written.place.where,
        "inputs": written.inputs_named,
        "form": written.form.family,
        "formula": written.formula,
        "in_units_of": {
            i.name: {"value": s, "unit": i.unit} for i, s in zip(written.inputs, written.scales, strict=True)
        },
        "parameters": {
            c.name: {"value": c.start, "stderr": errors.get(c.name), "unit": c.unit, "symbol": c.symbol}
            for c in written.constants()
        },
        "error": {"before": proposal.base.E_heldout, "after": proposal.step.E_heldout, "noise_floor": floor},
        "twins": [_twin(t) for t in proposal.twins],
        "places": [
            {
                "port": g.place.port,
                "where": g.place.where,
                "inputs": g.written().inputs_named,
                "formula": g.written().formula,
                "sigmas": math.sqrt(max(g.gain, 0.0)),
                "p_value": g.p_value,
            }
            for g in proposal.places
        ],
        "resembles": (
            {"effect": proposal.resembles[0], "share": proposal.resembles[1]} if proposal.resembles else None
        ),
    }


def _twin(twin: Twin) -> dict[str, Any]:
    return {
        "port": twin.port,
        "where": twin.where,
        "inputs": list(twin.inputs),
        "form": twin.family,
        "formula": twin.formula,
        "E_heldout": twin.E_heldout,
    }


def _stderr(proposal: Proposal) -> dict[str, float]:
    """Standard errors of its constants, SI."""
    step = proposal.step
    errors = parameter_covariance(step).diagonal().clamp_min(0).sqrt().tolist()
    whole = dict(zip(step.fit.model.declared, errors, strict=True))
    names = {c.name: f"{proposal.written.name}.{c.name}" for c in proposal.written.constants()}
    return {name: whole[label] for name, label in names.items() if label in whole}


def proposal_source(proposal: Proposal, model: str, floor: float) -> str:
    """The text of its file, the evidence in its docstring."""
    # Its name keeps its small letters.
    first, *rest = proposal_lines(proposal_entry(proposal, floor), proposal.written)
    lines = [f"{first}.", *(f"{line[0].upper()}{line[1:]}." for line in rest)]
    wrapped = [part for line in lines for part in _wrapped(line)]
    use = f"Use it like an effect of your own: FREELEARN_EFFECTS={file_of(proposal)} python train.py model={model} "
    return source(
        replace(proposal.written, lines=(*wrapped, "", *_wrapped(use + f"effects=[{proposal.written.name}]")))
    )


def _wrapped(line: str) -> list[str]:
    return wrap(line, 116, break_long_words=False, break_on_hyphens=False)


def write_proposals(proposals: list[Proposal], model: str, floor: float, folder: Path) -> None:
    """Writes proposed_NAME.py for each."""
    for proposal in proposals:
        write_text(folder / file_of(proposal), proposal_source(proposal, model, floor))
