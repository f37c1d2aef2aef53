"""The 27 nonlinear regression problems of the NIST Statistical Reference Datasets, from their .dat files.

Source: National Institute of Standards and Technology, StRD, https://www.itl.nist.gov/div898/strd/.
The files stand unchanged in `nist_strd` beside this one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor, exp

Model = Callable[[Tensor, Tensor], Tensor]


FOLDER = Path(__file__).parent / "nist_strd"


class Problem(NamedTuple):
    """One problem: response y (m,), predictors x (m,) or (m, 2), starts (2, p), certified values and RSS."""

    name: str
    y: Tensor
    x: Tensor
    starts: Tensor
    certified: Tensor
    rss: float

    def residual(self, b: Tensor) -> Tensor:
        """Residuals f(x, b) - y (m,); Nelson's response is the logarithm of y."""
        return MODELS[self.name](self.x, b) - self.y


def read(name: str) -> Problem:
    """Problem of this name, from `<name>.dat`."""
    text = (FOLDER / f"{name}.dat").read_text()
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?"
    row = rf"^\s*b\d+\s*=\s*({number})\s+({number})\s+({number})\s+{number}\s*$"
    values = torch.tensor([[float(v) for v in match] for match in re.findall(row, text, re.M)], dtype=torch.float64)
    rss = re.search(rf"Residual Sum of Squares:\s*({number})", text)
    span = re.search(r"Data\s+\(lines\s+(\d+)\s+to\s+(\d+)\)", text)
    if rss is None or span is None or not len(values):
        raise ValueError(f"{name}.dat is not a StRD nonlinear regression file")
    lines = text.splitlines()[int(span[1]) - 1 : int(span[2])]
    table = torch.tensor([[float(v) for v in line.split()] for line in lines], dtype=torch.float64)
    y, x = table[:, 0], table[:, 1:].squeeze(-1)
    return Problem(name, y.log() if name == "Nelson" else y, x, values[:, :2].T, values[:, 2], float(rss[1]))


def _decay(x: Tensor, b: Tensor) -> Tensor:
    return exp(-b[0] * x) / (b[1] + b[2] * x)


def _enso(x: Tensor, b: Tensor) -> Tensor:
    turn = 2 * math.pi * x
    year = b[1] * torch.cos(turn / 12) + b[2] * torch.sin(turn / 12)
    first = b[4] * torch.cos(turn / b[3]) + b[5] * torch.sin(turn / b[3])
    second = b[7] * torch.cos(turn / b[6]) + b[8] * torch.sin(turn / b[6])
    return b[0] + year + first + second


def _gauss(x: Tensor, b: Tensor) -> Tensor:
    first = b[2] * exp(-((x - b[3]) ** 2) / b[4] ** 2)
    second = b[5] * exp(-((x - b[6]) ** 2) / b[7] ** 2)
    return b[0] * exp(-b[1] * x) + first + second


def _cubic_ratio(x: Tensor, b: Tensor) -> Tensor:
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def _lanczos(x: Tensor, b: Tensor) -> Tensor:
    return b[0] * exp(-b[1] * x) + b[2] * exp(-b[3] * x) + b[4] * exp(-b[5] * x)


def _saturation(x: Tensor, b: Tensor) -> Tensor:
    return b[0] * (1 - exp(-b[1] * x))


MODELS: dict[str, Model] = {
    "Bennett5": lambda x, b: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": _saturation,
    "Chwirut1": _decay,
    "Chwirut2": _decay,
    "DanWood": lambda x, b: b[0] * x ** b[1],
    "ENSO": _enso,
    "Eckerle4": lambda x, b: b[0] / b[1] * exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": _gauss,
    "Gauss2": _gauss,
    "Gauss3": _gauss,
    "Hahn1": _cubic_ratio,
    "Kirby2": lambda x, b: (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2),
    "Lanczos1": _lanczos,
    "Lanczos2": _lanczos,
    "Lanczos3": _lanczos,
    "MGH09": lambda x, b: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda x, b: b[0] * exp(b[1] / (x + b[2])),
    "MGH17": lambda x, b: b[0] + b[1] * exp(-x * b[3]) + b[2] * exp(-x * b[4]),
    "Misra1a": _saturation,
    "Misra1b": lambda x, b: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda x, b: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda x, b: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda x, b: b[0] - b[1] * x[:, 0] * exp(-b[2] * x[:, 1]),
    "Rat42": lambda x, b: b[0] / (1 + exp(b[1] - b[2] * x)),
    "Rat43": lambda x, b: b[0] / (1 + exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda x, b: b[0] - b[1] * x - torch.atan(b[2] / (x - b[3])) / math.pi,
    "Thurber": _cubic_ratio,
}
