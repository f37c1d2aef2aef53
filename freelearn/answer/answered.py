"""What became of rows with blanks."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from freelearn.answer.roots import Roots


@dataclass(frozen=True)
class Answered:
    """Answers of N rows, SI.

    x (N, m), y (N, 2): inputs and outputs with every blank filled, NaN where there is no answer. x_half, y_half: half
    of the 95 % band of what was filled, NaN elsewhere. solutions (N,): how many were found within the span looked
    through. status: of each row. extrapolated (N,) bool: beyond what was measured. why: a few words, "" where there is
    nothing to say. every: all solutions of rows with several."""

    x: Tensor
    y: Tensor
    x_half: Tensor
    y_half: Tensor
    solutions: Tensor
    status: list[str]
    extrapolated: Tensor
    why: list[str]
    every: Roots
