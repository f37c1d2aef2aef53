"""Same-sample errors of the three models on the virtual bed, beside the paper's on its own (real) samples.

Run it after changing the bed's truth: `python experiments/same_sample.py`. It prints the table that
docs/simulated_bed.md quotes.
"""

import torch
from rich.console import Console
from rich.progress import track
from rich.table import Table

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.fit_and_score import run
from freelearn.api.tasks.loaded_table import load_table
from freelearn.physics.models.build import build_model

# Mean of the heat maps' diagonals in the paper [%].
PAPER = {"linear": 21.4, "continuum": 16.87, "mlp": 5.51}


def main() -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    chosen = settings(TrainSettings)
    table = load_table(chosen.data).table
    shown = Table(title="E in %, trained and tested on the same sample")
    for heading in ("model", *(f"sample {n}" for n in range(1, 9)), "mean (simulated)", "mean (paper, real)"):
        shown.add_column(heading, justify="right")
    for name, published in PAPER.items():
        errors = []
        for number in track(range(1, 9), f"{name:<10}"):
            own = f"sample{number}"
            outcome = run(build_model(name), table, own, own, chosen.fit, chosen.seed)
            errors.append(100 * outcome.errors[own].E)
        shown.add_row(name, *(f"{e:.1f}" for e in errors), f"{sum(errors) / 8:.1f}", f"{published:.1f}")
    Console(width=160).print(shown)


if __name__ == "__main__":
    main()
