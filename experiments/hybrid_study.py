"""The hybrid model beside the network and the continuum model: ten training sets, each tested on ten sets.

python experiments/hybrid_study.py                              the study's own bed
python experiments/hybrid_study.py split=states                 tested on kinematic states that no fit has seen
python experiments/hybrid_study.py data.seed=1                  another noise; data.hidden=random: other physics

It prints what docs/hybrid.md quotes; words are overrides of train.py.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from rich.console import Console
from rich.progress import track
from rich.table import Table

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.fit_and_score import run
from freelearn.api.tasks.loaded_table import load_table
from freelearn.data.sets import overlap, set_names
from freelearn.physics.models.build import build_model

MODELS = ("continuum", "mlp", "hybrid")
# On its own set within this of the network; on samples never trained on no worse than the continuum but for this.
OWN, ROUNDING = 1.2, 1.005

# E by model, training set and test set.
Errors = dict[tuple[str, str, str], float]


@dataclass(frozen=True)
class Figures:
    """own: E of hybrid / E of mlp by training set. unseen: E of hybrid / E of continuum where training and test set
    share no sample, by the two. mixed: the same where they share some but are not one set."""

    own: dict[str, float]
    unseen: dict[tuple[str, str], float]
    mixed: dict[tuple[str, str], float]


def errors_of(chosen: TrainSettings, table: pd.DataFrame, sets: list[str]) -> tuple[Errors, float]:
    """Every cell, and the longest fit of the hybrid model [s]."""
    found: Errors = {}
    longest = 0.0
    shares = (chosen.split.train, chosen.split.validation)
    for name in MODELS:
        for train in track(sets, f"{name:<10}", console=Console(stderr=True)):
            outcome = run(
                build_model(name),
                table,
                train,
                "every",
                chosen.fit,
                chosen.seed,
                by_states=chosen.split.by_states,
                shares=shares,
            )
            found |= {(name, train, test): error.E for test, error in outcome.errors.items()}
            longest = max(longest, outcome.fit_seconds if name == "hybrid" else 0.0)
    return found, longest


def figures(errors: Errors, sets: list[str]) -> Figures:
    """The ratios that count."""
    ratio = {(a, b): errors["hybrid", a, b] / errors["continuum", a, b] for a in sets for b in sets}
    own = {name: errors["hybrid", name, name] / errors["mlp", name, name] for name in sets}
    unseen = {pair: r for pair, r in ratio.items() if not overlap(*pair)}
    return Figures(own, unseen, {(a, b): r for (a, b), r in ratio.items() if a != b and (a, b) not in unseen})


def show(errors: Errors, sets: list[str], longest: float, console: Console) -> None:
    """The tables."""
    own = Table(title="E in %, trained and tested on the same set")
    for heading in ("model", *sets):
        own.add_column(heading, justify="right")
    for name in MODELS:
        own.add_row(name, *(f"{100 * errors[name, s, s]:.2f}" for s in sets))
    told = figures(errors, sets)
    own.add_row("hybrid / mlp", *(f"{told.own[s]:.3f}" for s in sets))
    console.print(own)
    cells = Table(title="E of hybrid / E of continuum; · where the test set holds a sample that was trained on")
    for heading in ("trained on", *sets):
        cells.add_column(heading, justify="right")
    for a in sets:
        cells.add_row(
            a, *(f"{told.unseen[a, b]:.3f}" if (a, b) in told.unseen else f"·{_ratio(errors, a, b):.3f}" for b in sets)
        )
    console.print(cells)
    unseen = np.array(list(told.unseen.values()))
    worst = max(told.unseen, key=told.unseen.__getitem__)
    most = max(told.own, key=told.own.__getitem__)
    mixed = np.array([_ratio(errors, *pair) for pair in told.mixed])
    console.print(f"own set: hybrid / mlp at most {told.own[most]:.3f} ({most}); target ≤ {OWN}")
    console.print(
        f"samples never trained on: {len(unseen)} cells, {int((unseen > ROUNDING).sum())} worse than the continuum "
        f"model (by more than {100 * (ROUNDING - 1):.1f} %), worst {unseen.max():.4f} ({worst[0]} → {worst[1]}), "
        f"median {np.median(unseen):.3f}; better in {int((unseen < 1).sum())}"
    )
    console.print(f"sets that share samples with the training set: {len(mixed)} cells, worst {mixed.max():.3f}")
    console.print(f"longest fit of the hybrid model: {longest:.1f} s")


def _ratio(errors: Errors, train: str, test: str) -> float:
    return errors["hybrid", train, test] / errors["continuum", train, test]


def main() -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    chosen = settings(TrainSettings, sys.argv[1:])
    table = load_table(chosen.data).table
    sets = set_names(table["sample"].to_numpy())
    errors, longest = errors_of(chosen, table, sets)
    show(errors, sets, longest, Console(width=170))


if __name__ == "__main__":
    main()
