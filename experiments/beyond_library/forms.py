"""Whether a form that was found is the one that was hidden, up to what no data of the box could tell apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product

import numpy as np
from beyond_library.kind import BOX, Array, Kind

# Correlation with the truth from which a family counts as able to be it.
ALIKE = 0.999
POINTS, STEP = 161, 1e-20
# Other words for the families.
WORDS = {
    **dict.fromkeys(("linear", "quadratic", "cubic", "line", "parabola", "monomial", "square"), "polynomial"),
    **dict.fromkeys(("sqrt", "square root", "root", "power law", "power_law"), "power"),
    **dict.fromkeys(("relu", "ramp", "kink", "piecewise linear", "piecewise_linear", "dead band"), "hinge"),
    **dict.fromkeys(("abs", "absolute", "absolute value"), "modulus"),
    **dict.fromkeys(("sin", "cos", "cosine", "ripple", "wave", "harmonic", "sinusoid"), "sine"),
    **dict.fromkeys(("exp", "decay"), "exponential"),
    **dict.fromkeys(("tanh", "sigmoid", "logistic", "saturating", "langevin"), "saturation"),
    **dict.fromkeys(("gaussian", "gauss", "peak", "lorentzian"), "bump"),
    **dict.fromkeys(("jump", "heaviside"), "step"),
    **dict.fromkeys(("bilinear", "separable"), "product"),
}

CENTERS, WIDTHS = np.linspace(-1, 1, 41), np.geomspace(0.02, 5, 30)
RATES = np.r_[-np.geomspace(0.2, 30, 40), np.geomspace(0.2, 30, 40)]
POWERS = np.linspace(0.2, 5, 97)


def family(word: str) -> str:
    """The family that a word names."""
    plain = word.strip().lower()
    return WORDS.get(plain, plain)


def equivalent(found: str, kind: Kind, shape: Mapping[str, float]) -> bool:
    """Whether the family that was found is the hidden one, or could be: at its best it correlates with the truth.

    A truth of two inputs is the family's if that is said, or if it is a polynomial of both.
    """
    word, inputs = family(found), [name for name in kind.inputs if name != "direction"]
    if word == kind.form:
        return True
    if len(inputs) == 2:
        return word == "polynomial" and best([_monomials(*_grid(inputs))], _truth(kind, shape, inputs)) >= ALIKE
    if word not in FAMILIES:
        return False
    low, high = BOX[inputs[0]]
    x = np.linspace(low, high, POINTS)
    return best(FAMILIES[word](x, low), _truth(kind, shape, inputs)) >= ALIKE


def best(bases: list[Array], truth: Array) -> float:
    """Largest correlation of the truth (N,) with a constant and any of these bases, each (N, k)."""
    centered = truth - truth.mean()
    whole, most = float(centered @ centered), 0.0
    for basis in bases:
        columns = basis - basis.mean(0)
        if not np.isfinite(columns).all():
            continue
        q, r = np.linalg.qr(columns)
        used = np.abs(np.diag(r)) > 1e-10
        most = max(most, float(((q[:, used].T @ centered) ** 2).sum()) / max(whole, 1e-300))
    return most**0.5


def _grid(inputs: list[str]) -> list[Array]:
    ends = [np.linspace(*BOX[name], 21) for name in inputs]
    return [each.ravel() for each in np.meshgrid(*ends, indexing="ij")]


def _truth(kind: Kind, shape: Mapping[str, float], inputs: list[str]) -> Array:
    """The hidden function over the box; of an energy its slope, which is what loads follow."""
    x = _grid(inputs) if len(inputs) == 2 else [np.linspace(*BOX[inputs[0]], POINTS)]
    if kind.port == "energy":
        return np.asarray(kind.function({inputs[0]: x[0] + 1j * STEP}, shape).imag / STEP)
    return np.asarray(kind.function(dict(zip(inputs, x, strict=True)), shape))


def _monomials(x: Array, y: Array) -> Array:
    return np.stack([x**i * y**j for i, j in product(range(4), repeat=2) if 0 < i + j <= 3], axis=1)


def _each(values: list[Array]) -> list[Array]:
    return [value[:, None] for value in values]


def _powers(x: Array, low: float) -> list[Array]:
    sides = [x - low, np.abs(x), np.maximum(x, 0)]
    signed = [np.sign(x) * np.abs(x) ** n for n in POWERS]
    return _each([side**n for side in sides for n in POWERS] + signed)


def _centers(x: Array) -> Array:
    return x.mean() + CENTERS * (x.max() - x.min()) / 2


# Of each family: a grid of its functions over x (N,), each with the columns that enter linearly.
FAMILIES: dict[str, Callable[[Array, float], list[Array]]] = {
    "polynomial": lambda x, low: [np.stack([x, x**2, x**3], axis=1)],
    "power": _powers,
    "hinge": lambda x, low: _each([np.maximum(side * (x - c), 0) for c in _centers(x) for side in (1, -1)]),
    "modulus": lambda x, low: _each([np.abs(x - c) for c in _centers(x)]),
    "sine": lambda x, low: [np.stack([np.sin(k * x), np.cos(k * x)], axis=1) for k in np.linspace(0.5, 20, 196)],
    "exponential": lambda x, low: _each([np.exp(k * x) for k in RATES]),
    "saturation": lambda x, low: _each([np.tanh((x - c) / w) for c in _centers(x) for w in WIDTHS]),
    "bump": lambda x, low: _each([np.exp(-(((x - c) / w) ** 2)) for c in _centers(x) for w in WIDTHS]),
    "step": lambda x, low: _each([(x > c) * 1.0 for c in np.linspace(low, x.max(), POINTS)[1:-1]]),
}
