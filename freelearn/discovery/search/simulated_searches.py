"""Wrong how often, on a table like this? The whole search on tables that are simulated from models of known truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import torch
from scipy.stats import beta

from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.search.search import search

# Probability that a rate lies within the limits that are told of it.
SURE = 0.95


@dataclass(frozen=True)
class Searched:
    """What a search said of one simulated table. hidden: the effects that the table has; effects, classes: the answer,
    as in Findings."""

    number: int
    hidden: list[str]
    verdict: str
    effects: list[str]
    classes: list[list[str]]

    @property
    def found(self) -> list[str]:
        """The hidden effects that are claimed, by name or in a class."""
        claimed = {name for members in self.classes for name in members} if self.claims else set()
        return [name for name in self.hidden if name in claimed]

    @property
    def wrong(self) -> bool:
        """Whether something is claimed that stands for no hidden effect."""
        return self.claims and any(not set(members) & set(self.hidden) for members in self.classes)

    @property
    def claims(self) -> bool:
        """Whether the verdict names anything."""
        return self.verdict in ("named", "class", "proposed")

    def plain(self) -> dict[str, Any]:
        """As referee.json holds it."""
        return asdict(self)


def simulated(fit: WhiteFit, rows: Rows, whiten: Whitener, seed: int) -> Rows:
    """The rows as a fitted model would show them, with the noise that was found: of every reading, and of the place
    that a state's rows share."""
    generator = torch.Generator().manual_seed(seed)
    noise = whiten.drawn(generator)
    shown = torch.where(rows.readings.present, fit.shown + noise, 0.0)
    # A tube that hangs loose carries nothing, whatever a model says.
    shown = torch.where(rows.readings.slack[:, None], rows.readings.value, shown)
    return replace(rows, readings=replace(rows.readings, value=shown))


def searched(question: Question, fit: WhiteFit, whiten: Whitener, hidden: Sequence[str], number: int) -> Searched:
    """What a search says of the question's rows as the fit would show them. hidden: the fit's effects that were not
    given; number: of the table, its seed."""
    rows = simulated(fit, question.rows, whiten, number)
    found = search(replace(question, rows=rows, seed=number))
    classes = [list(members) for members in found.classes]
    return Searched(number, list(hidden), found.verdict, found.effects, classes)


def tally(tables: Sequence[Searched]) -> dict[str, Any]:
    """How often a name was wrong, and how often each hidden effect was found: counts, rates and their limits."""
    wrong = sum(table.wrong for table in tables)
    names = list(dict.fromkeys(name for table in tables for name in table.hidden))
    found = {}
    for name in names:
        there = [table for table in tables if name in table.hidden]
        found[name] = rate(sum(name in table.found for table in there), len(there))
    return {"wrong": rate(wrong, len(tables)), "found": found}


def rate(count: int, of: int) -> dict[str, float]:
    """A rate with its count, of how many, and its 95 % limits (fractions), by Clopper & Pearson (1934)."""
    low = float(beta.ppf((1 - SURE) / 2, count, of - count + 1)) if count else 0.0
    high = float(beta.ppf(1 - (1 - SURE) / 2, count + 1, of - count)) if count < of else 1.0
    return {"count": count, "of": of, "rate": count / of if of else float(np.nan), "low": low, "high": high}


def sentences(result: dict[str, Any]) -> list[str]:
    """The tally in words."""
    wrong = result["wrong"]
    told = [
        f"A name this wrong in {wrong['count']} of {wrong['of']} such tables "
        f"({100 * wrong['low']:.0f} to {100 * wrong['high']:.0f} %)."
    ]
    for name, rate in result["found"].items():
        told.append(f"An effect like this {name} found in {rate['count']} of {rate['of']} such tables.")
    return told
