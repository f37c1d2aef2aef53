"""The paper's error metric."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.data.rows import Readings, Rows

# Share of the loads that `usual_scale` takes for nearly all, and its smallest value.
NEARLY_ALL, SMALLEST = 0.95, 1e-300


class Error(NamedTuple):
    """E = √(Σ E_part²), each part a share of the largest measured value of its quantity in the set; n rows scored.

    parts: of the bed's two quantities, by name; NaN for one that was measured in no row. of: rows that were to be
    scored; the model has no answer at the others."""

    E: float
    parts: tuple[tuple[str, float], tuple[str, float]]
    n: int
    of: int = 0

    @property
    def tells(self) -> bool:
        """Whether it tells anything: of the rows that it was to be scored on the model answers half or more."""
        return 2 * self.n >= self.of

    def part(self, name: str) -> float:
        """Of one quantity; NaN where the bed does not measure it."""
        return dict(self.parts).get(name, float("nan"))

    def plain(self) -> dict[str, float | int | None]:
        """For files: E, E_force, E_moment, n, of, and E_… of what else the bed measures; None for NaN."""
        parts = dict.fromkeys(("E_force", "E_moment"), float("nan"))
        parts |= {f"E_{name.replace(' ', '_')}": value for name, value in self.parts}
        plain: dict[str, float | int | None] = {"E": self.E, **parts}
        return {name: None if value != value else value for name, value in plain.items()} | {"n": self.n, "of": self.of}


def load_scale(measured: Tensor) -> Tensor:
    """Largest |force| and |moment| of a set, (2,) N, N·m (or of what its bed measures): what E is normalized by. Zero
    loads, and those of no rows, scale by one."""
    if not len(measured):
        return measured.new_ones(measured.shape[1])
    largest = measured.abs().amax(0)
    return torch.where(largest > 0, largest, 1.0)


def usual_scale(readings: Readings) -> Tensor:
    """Size below which nearly all readings of either channel are, (2,) SI: the largest of them may have slipped. Never
    zero, also of readings that are."""
    sizes = [value[there].abs() for value, there in zip(readings.value.T, readings.present.T, strict=True)]
    each = [size.quantile(NEARLY_ALL) if len(size) else torch.ones((), dtype=torch.float64) for size in sizes]
    return torch.stack(each).clamp_min(SMALLEST)


def set_error(rows: Rows, predicted: Tensor, usable: Tensor) -> Error:
    """Error of predictions (N, 2) on the rows marked usable; the largest readings are those of all N rows.

    E = sqrt(mean(((F − F̂)/max|F|)² + ((M − M̂)/max|M|)²)) (the paper's Eq. errorObj), each mean over the readings that
    there are. NaN without usable rows.
    """
    readings = rows.readings
    squares = (readings.missed(predicted) / load_scale(readings.value)).square()[usable]
    present = readings.present[usable]
    means = squares.sum(0) / present.sum(0)  # NaN of a channel without readings
    total = float(means.nansum()) if bool(present.any()) else float("nan")
    names = [quantity.name for quantity in rows.states.bed.readings]
    parts = tuple((name, mean**0.5) for name, mean in zip(names, means.tolist(), strict=True))
    return Error(total**0.5, (parts[0], parts[1]), int(usable.sum()), len(usable))


def common(*usable: Tensor) -> Tensor:
    """Rows marked usable by every one of several models, (N,) bool: only on these may their errors be compared.

    Each model's own error leaves out the rows that it cannot answer, often its worst ones.

    >>> common(torch.tensor([True, True, False]), torch.tensor([True, False, True])).tolist()
    [True, False, False]
    """
    return torch.stack(usable).all(0)
