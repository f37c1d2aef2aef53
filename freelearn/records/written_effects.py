"""Effects that a search wrote: as plain values, in words, as files, and as curves beside what the data say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import Any

import pandas as pd

from freelearn.common.files import write_text
from freelearn.common.formats import number, percent, sentence
from freelearn.discovery.fits.step import parameter_covariance
from freelearn.discovery.proposals.proposal import Proposal, Twin
from freelearn.discovery.proposals.unknown_function import Unknown
from freelearn.discovery.search.search import Findings
from freelearn.physics.effects.registry import lent
from freelearn.physics.written.places import Input
from freelearn.physics.written.source import effect_class, source
from freelearn.physics.written.written_effect import Constant, Written

# An effect that a search wrote, in words: from its entry of discovery.json.

INPUTS = {"direction": "direction of the pressure change", "severity": "severity of the state"}


def proposal_lines(entry: Mapping[str, Any], written: Written) -> list[str]:
    """What it is, its constants, what it mends, what the data cannot tell from it, and what it resembles.

    written: with its constants as the entry has them."""
    of = " and ".join(INPUTS.get(name, name) for name in written.inputs_named)
    before, after, floor = (percent(entry["error"][name], 3) for name in ("before", "after", "noise_floor"))
    lines = [
        f"{written.name}: the {written.place.changes} depends on the {of}: {written.formula}, {units_told(written)}",
        f"its constants: {'; '.join(constants_told(entry, written))}",
        f"the held-out error goes from {before} to {after} %, and measuring alone leaves {floor} %",
        *_chance(entry["places"]),
        *_twins(entry["twins"]),
    ]
    if alike := entry["resembles"]:
        share = percent(alike["share"], 0)
        lines.append(f"of the library {alike['effect']} would explain most of the same: {share} % of it")
    return lines


def constants_told(entry: Mapping[str, Any], written: Written) -> list[str]:
    """Each constant with its standard error, in the units of tables: a = 10.2 ± 0.1 N·mm."""
    return [_constant(c, entry["parameters"][c.name]["stderr"]) for c in written.constants()]


def units_told(written: Written) -> str:
    """What the inputs are told in: φ in units of 115 °."""
    pairs = zip(written.inputs, written.scales, strict=True)
    return ", ".join(f"{i.symbol} in units of {number(s / i.factor, 4)} {i.shown}".rstrip() for i, s in pairs)


def _constant(constant: Constant, stderr: float | None) -> str:
    error = None if stderr is None else abs(stderr / constant.factor)
    unit = f" {constant.shown}" if constant.shown else ""
    return f"{constant.symbol} = {number(constant.start / constant.factor, 4)} ± {number(error, 2)}{unit}"


def _chance(places: list[dict[str, Any]]) -> list[str]:
    # A search of former times does not know it.
    least = min((place["p_value"] for place in places if "p_value" in place), default=None)
    if least is None:
        return []
    told = "the chance that noise alone would promise as much in some form somewhere"
    return [f"{told} is {percent(least, 1)} % at most"]


def _twins(twins: list[dict[str, Any]]) -> list[str]:
    same = [t for t in twins if t["E_heldout"] is None]
    other = [f"{t['port']} ({t['where']}): {t['formula']}" for t in twins if t["E_heldout"] is not None]
    lines = [
        f"at the port {t['port']} ({t['where']}) the same function would show the very same loads" for t in same[:1]
    ]
    return [*lines, f"the data cannot tell it from {'; '.join(other)}"] if other else lines


# Effects that a search wrote, as plain values, and as files of their own.

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


# The function that a proposal says beside what the data say without a form: a table in engineering units.

CURVES = ("form", "free", "low", "high")


@dataclass(frozen=True)
class ProposalCurve:
    """numbers: the input, then form, free, low and high, in the units of x and y. title: what it is."""

    title: str
    x: str
    y: str
    numbers: pd.DataFrame

    @classmethod
    def from_unknown(cls, written: Written, found: Unknown) -> ProposalCurve:
        """From what was found, in SI."""
        shown = {name: getattr(found, name) / written.place.factor for name in CURVES}
        table = pd.DataFrame({found.over.name: found.at / found.over.factor, **shown})
        return cls._of(written, found.over, table)

    @classmethod
    def from_table(cls, written: Written, table: pd.DataFrame) -> ProposalCurve | None:
        """From the table that a search wrote beside its picture; None where it is of something else."""
        over = next((i for i in written.inputs if i.name == table.columns[0]), None)
        return cls._of(written, over, table) if over is not None and [*table.columns[1:]] == [*CURVES] else None

    @classmethod
    def _of(cls, written: Written, over: Input, table: pd.DataFrame) -> ProposalCurve:
        place = written.place
        unit = f" [{over.shown}]" if over.shown else ""
        y = f"{'lost' if place.rubs else 'Δ'} {place.symbol}{f' [{place.shown}]' if place.shown else ''}".replace(
            "Δ ", "Δ"
        )
        return cls(sentence(written.formula).rstrip("."), f"{over.name} {over.symbol}{unit}", y, table)
