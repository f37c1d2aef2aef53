"""Every form with every choice of its shapes, as columns: what each term is in every row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.models.written.forms import Form

# Of a form and one choice of its shapes, the values of its terms.
Evaluate = Callable[[Form, dict[str, float]], Sequence[Tensor]]


@dataclass(frozen=True)
class Terms:
    """forms: those tried; of: number of each trial's form, (t,); shapes: each trial's; first, second: places of its
    columns, (t,), the second's that of the first where it has one term alone. values: the columns, (…, k)."""

    forms: Sequence[Form]
    of: np.ndarray
    shapes: list[dict[str, float]]
    first: np.ndarray
    second: np.ndarray
    values: Tensor

    @classmethod
    def of_forms(cls, forms: Sequence[Form], signed: bool, evaluate: Evaluate) -> Terms:
        """All trials of some forms. signed: whether every input has values of both signs."""
        usable = [form for form in forms if signed or not form.signed]
        of, shapes, first, second = list[int](), list[dict[str, float]](), list[int](), list[int]()
        columns: list[Tensor] = []
        for number, form in enumerate(usable):
            for choice in form.grid():
                of.append(number)
                shapes.append(choice)
                first.append(len(columns))
                columns += evaluate(form, choice)
                second.append(len(columns) - 1)
        return cls(usable, np.array(of), shapes, np.array(first), np.array(second), torch.stack(columns, dim=-1))

    def gains(self, gram: Gram) -> tuple[np.ndarray, np.ndarray]:
        """Reduction of the sum of squares by each trial, (t,), and its amounts, (t, 2), the second zero where there is
        none. A trial that can hardly be seen, or whose terms are one,
        promises nothing."""
        a, b = gram.square[self.first], gram.square[self.second]
        two = self.first != self.second
        c = np.where(two, gram.product(self.first, self.second), 0.0)
        u, v = gram.slopes[self.first], np.where(two, gram.slopes[self.second], 0.0)
        det = a * b - c**2
        seen = gram.seen[self.first] & gram.seen[self.second] & (~two | (det > 1e-9 * a * b))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = np.where(two, (b * u - c * v) / det, u / a)
            y = np.where(two, (a * v - c * u) / det, 0.0)
            gain = np.where(seen, x * u + y * v, -np.inf)
        return gain, -np.stack([x, y], axis=1)

    def best(self, worth: np.ndarray) -> Iterator[tuple[Form, int]]:
        """Of each form its most worthy trial. worth: (t,)."""
        for number, form in enumerate(self.forms):
            own = np.flatnonzero(self.of == number)
            one = int(own[np.argmax(worth[own])])
            if np.isfinite(worth[one]):
                yield form, one


@dataclass(frozen=True)
class Gram:
    """What least squares need of whitened columns (2N, k), cleared of what the fit absorbs: their squared lengths and
    their products with the residuals, (k,) each; whether enough of each is left, (k,) bool."""

    columns: Tensor
    square: np.ndarray
    slopes: np.ndarray
    seen: np.ndarray

    def product(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Products of pairs of columns, (t,); only of those that differ."""
        out = np.zeros(len(first))
        pairs = np.flatnonzero(first != second)
        if len(pairs):
            a, b = self.columns[:, first[pairs]], self.columns[:, second[pairs]]
            out[pairs] = (a * b).sum(0).numpy()
        return out
