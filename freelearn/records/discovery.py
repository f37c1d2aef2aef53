"""discovery.json, and the verdict in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.common.formats import all_finite, error_percent
from freelearn.discovery.checks.table_check import TableCheck
from freelearn.discovery.fits.left_out import HELDOUT_IS
from freelearn.discovery.fits.step import Candidate, Step, parameter_covariance
from freelearn.discovery.noise.structure import ResidualTest
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.discovery.residuals.failures import Failure
from freelearn.discovery.residuals.residual_summary import ResidualSummary
from freelearn.discovery.search.measuring_order import DRIFT, unknown
from freelearn.discovery.search.next_states import NextState
from freelearn.discovery.search.search import Findings
from freelearn.fitting.uncertainty import quantile
from freelearn.records.estimates import Estimate, searched_estimates, searched_quantile
from freelearn.records.suspected_readings import SuspectedReading, flagged
from freelearn.records.verdict_words import measured_channels, verdict_in_words
from freelearn.records.written_effects import ProposalCurve, proposal_entry


@dataclass
class Discovery:
    """All that came out.

    predictions: the rows looked at, with the loads of the first model (before) and of the last one (after), in the
    columns of a run's predictions.csv; those with an answer are findings.kept. curves: of both models, at a few states.
    failed: regions where the base model fails. suspects: readings that slipped, perhaps, the worst first. unknowns: by
    the name of a written effect, what the data say of its function without a form."""

    findings: Findings
    predictions: Mapping[str, pd.DataFrame]
    curves: Sequence[tuple[pd.DataFrame, dict[str, pd.DataFrame]]]
    failed: list[Failure]
    splits: pd.DataFrame
    screens: list[ResidualTest]
    proposed: list[NextState]
    left: ResidualSummary | None
    notes: list[str]
    content: dict[str, Any]
    suspects: list[SuspectedReading]
    unknowns: Mapping[str, ProposalCurve]

    @cached_property
    def trusted(self) -> dict[str, pd.DataFrame]:
        """The predictions with the suspects' rows left out and marked (suspects.flagged): what pictures are drawn
        from."""
        return {when: flagged(table, self.findings.suspects) for when, table in self.predictions.items()}


def final_estimates(findings: Findings) -> list[Estimate]:
    """Parameters of the last model, with 95 % intervals that count each kinematic state once."""
    fit, states = findings.final.fit, len(np.unique(findings.rows.visits))
    return searched_estimates(fit.values(), stderr(findings.final), reach(findings.final, states), fit.model)


def reach(step: Step, states: int) -> dict[str, float]:
    """How far 95 % intervals of the physical parameters reach (SI), with so many kinematic states, each counted once.

    Few states hardly tell how large errors are, so Student's t takes the normal quantile's place: errors count for so
    much larger. What was known beforehand they do not make less."""
    wider = searched_quantile(step.fit.model, states) / quantile(math.inf)
    return {name: quantile(math.inf) * error for name, error in stderr(step, wider).items()}


def document(
    findings: Findings,
    failed: list[Failure],
    screens: list[ResidualTest],
    proposed: list[NextState],
    left: ResidualSummary | None,
    suspects: list[SuspectedReading],
    notes: list[str],
    untestable: list[Candidate],
    about: dict[str, Any],
    stopping: Sequence[TableCheck] = (),
) -> dict[str, Any]:
    """Everything in discovery.json, with the contract's fields first. Numbers that do not exist are null. stopping:
    checks of the table that failed and stop every claim."""
    first, last = findings.steps[0], findings.final
    pairs = zip([None, *findings.steps], findings.steps, strict=False)
    entries = [proposal_entry(p, findings.noise_floor) for p in findings.proposals]
    written, hinted = (entries, []) if findings.verdict == "proposed" else ([], entries)
    content = {
        "verdict": findings.verdict,
        "says": verdict_in_words(findings, classes_of(findings), stopping),
        "effects": findings.effects,
        "classes": classes_of(findings),
        "beside": findings.answer.beside if findings.answer else [],
        "models": [vars(model) for model in findings.models],
        "predicts_best": vars(findings.predicts_best) if findings.predicts_best else None,
        "shares": findings.answer.shares if findings.answer else {},
        "referee": [check.plain() for check in findings.referee.checks] if findings.referee else [],
        "refereed": findings.asked,
        "alternatives": [{name: _rebuilt(step) for name, step in members.items()} for members in findings.classes],
        "heldout_is": HELDOUT_IS,
        "error": {"before": first.E_heldout, "after": last.E_heldout, "noise_floor": findings.noise_floor},
        "parameters": {estimate.name: estimate.plain() for estimate in final_estimates(findings)},
        "trail": [_entry(step, previous) for previous, step in pairs],
        "candidates": [*(c for step in findings.steps for c in step.candidates), *untestable],
        "failures": [f.numbers() for f in failed],
        "proposals": written,
        "next_experiment": [vars(p) for p in proposed],
        "suspects": [s.plain() for s in suspects],
        "screens": [vars(s) for s in screens],
        "remainder": vars(left) if left else None,
        "hint": hinted[0] if hinted else None,
        "covariance": parameter_covariance(last).tolist(),
        "noise_scale": noise_scale(last),
        "structure_p_value": last.left.p_value,
        "notes": notes,
        **about,
    }
    finite: dict[str, Any] = all_finite(content)
    return finite


def classes_of(findings: Findings) -> list[list[str]]:
    """For each effect all that the data cannot tell from it, itself first; for a drift also an unknown function of what
    the states were measured in the order of."""
    others = [unknown(name) for name in findings.sorted_by]
    return [[*c, *(others if DRIFT in c else [])] for c in findings.classes]


def sigmas_heldout(step: Step) -> float:
    """Root mean square of the held-out residuals, each in standard deviations of its own noise as it was found to be:
    one is noise. E weighs the same residuals by the largest loads."""
    if step.whiten.doubt is None:
        return math.sqrt(float(step.heldout.white.square().sum()) / step.whiten.count)
    variance = step.whiten.scattered
    counts = variance > 0
    return math.sqrt(float((step.heldout.raw.square() / variance)[counts].mean())) if bool(counts.any()) else 0.0


def rise_notes(findings: Findings) -> list[str]:
    """A sentence if something is claimed with which the error in percent does not fall: where nearly all of it is how
    far off each state was set, an effect shows beside that alone."""
    first, last = findings.steps[0], findings.final
    sigmas = sigmas_heldout(first), sigmas_heldout(last)
    if findings.verdict not in CLAIMS or last.E_heldout < first.E_heldout or sigmas[1] >= sigmas[0]:
        return []
    before, after, floor = (error_percent(e) for e in (first.E_heldout, last.E_heldout, findings.noise_floor))
    return [
        f"the error of what was left out goes from {before} to {after} %, of which {floor} are measuring's: nearly all "
        "of it is what the readings of a state share, as places that were set otherwise do, and no effect takes that "
        f"off; beside it what is left falls from {sigmas[0]:.3g} to {sigmas[1]:.3g} standard deviations of the noise"
    ]


def unshown_notes(findings: Findings, unshown: Mapping[str, str]) -> list[str]:
    """A sentence for every effect in a class that these rows cannot show. unshown: effect → what rows it needs."""
    beside: dict[str, list[str]] = {}
    for members in findings.classes:
        first, *others = members
        for name in others:
            beside.setdefault(name, []).append(first)
    return [
        f"{name} would do as well as {' or '.join(firsts)}, and these rows cannot show it: it {unshown[name]}"
        for name, firsts in beside.items()
        if name in unshown
    ]


def noise_scale(step: Step) -> float:
    """How many times the stated noise is what scatters about a step's model, smooth structure and slips taken off: the
    geometric mean of force and moment, or of what else was measured."""
    found, measured = step.whiten.scatter, measured_channels(step)
    left = 1.0 if step.whiten.doubt is not None else step.left.scale
    return left * (float(found.deviations[measured].prod()) ** (1 / len(measured)) if found else 1.0)


def _entry(step: Step, previous: Step | None) -> dict[str, Any]:
    new = [e for e in step.effects if previous is None or e not in previous.effects]
    return {
        "effect": "+".join(new) or None,
        "effects": list(step.effects),
        "E_train": step.E_train,
        "E_heldout": step.E_heldout,
        "E_new_sample": step.E_new_sample,
        "sigmas_heldout": sigmas_heldout(step),
        "parameters": step.fit.values(),
        "stderr": stderr(step),
        "noise_floor": step.floor,
        "structure_p_value": step.left.p_value,
    }


def _rebuilt(step: Step) -> dict[str, Any]:
    """What builds the step's model again, with its raw parameters by label: each member of a class has a fit."""
    known = step.fit.model.description()
    vector = dict(zip(step.fit.model.labels(), step.fit.vector.tolist(), strict=True))
    return {name: known[name] for name in ("effects", "samples", "members")} | {"vector": vector}


def trail_numbers(content: dict[str, Any]) -> pd.DataFrame:
    """The staircase of a discovery.json: step (what was added), E_heldout, E_train, noise_floor (fractions), and
    sigmas_heldout."""
    shown = ["E_heldout", "E_train", "noise_floor", "sigmas_heldout"]
    table = pd.DataFrame(content["trail"])[["effect", *shown]]
    added = table["effect"].map(lambda effect: f"+ {effect.replace('+', ' + ')}", na_action="ignore")
    # A step without a new effect has fewer, where the model stays unexplained.
    counts = [len(step["effects"]) for step in content["trail"]]
    fewer = pd.Series([False, *(now < before for before, now in pairwise(counts))])
    names = added.fillna(fewer.map({True: "less what explains little", False: "exchanged"}))
    names.iloc[0] = "model alone" if pd.isna(table["effect"].iloc[0]) else f"model {added.iloc[0]}"
    return table.assign(step=names)[["step", *shown]]


def stderr(step: Step, wider: float = 1.0) -> dict[str, float]:
    """Standard errors of the physical parameters (SI), see parameter_covariance.

    NaN for a parameter that no reading depends on any more, such as a stiffness that has gone to zero.
    """
    errors = torch.diagonal(parameter_covariance(step, wider)).clamp_min(0).sqrt()
    depends = step.fit.jacobian.flatten(0, 1).abs().amax(0)
    moved = depends[len(depends) - len(errors) :] > 0
    return dict(zip(step.fit.model.declared, torch.where(moved, errors, torch.nan).tolist(), strict=True))
