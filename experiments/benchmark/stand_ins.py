"""Two published systems with hysteresis that are no physics of ours, integrated by SciPy: the scan and the optimizer.

The nonlinear benchmark sets themselves are not at hand, so these stand in for them. A displacement (a multisine of its
own for what is fitted and what is asked) gives a force: the spring and the hysteresis of the Bouc–Wen benchmark (Noël &
Schoukens 2016, its table), and friction after LuGre (Canudas de Wit, Olsson, Åström & Lischinsky 1995, its table).
Against them stand elements that stick and slip (`stopped`), fitted by the package's Levenberg–Marquardt.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from benchmark.common import Report
from benchmark.narx import Array, Narx
from festo_logs import creeps, plays
from scipy.integrate import solve_ivp
from torch import Tensor

from freelearn.data.recordings import recurred, stopped
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt

COUNT = 4000
# Half widths of the linear peer's plays, of the largest displacement, and its times of creep [rows].
PLAYS, CREEPS = (0.02, 0.05, 0.1, 0.2, 0.4), (5.0, 50.0)
ELEMENTS = 5


@dataclass(frozen=True)
class System:
    """rate: rows a second. band: of the multisine [Hz]; size: root mean square of the displacement [m]. force: time,
    displacement and speed as functions of time → force at the times (n,)."""

    name: str
    rate: float
    band: tuple[float, float]
    size: float
    force: Callable[[Array, Callable[[float], tuple[float, float]]], Array]

    def series(self, seed: int) -> tuple[Array, Array, Array]:
        """Displacement [m], speed [m/s] and force [N] at COUNT rows, (n,) each."""
        generator, lasts = np.random.default_rng(seed), COUNT / self.rate
        wave = 2 * np.pi * np.arange(np.ceil(self.band[0] * lasts), self.band[1] * lasts) / lasts
        phase = generator.uniform(0, 2 * np.pi, len(wave))
        high = self.size * np.sqrt(2 / len(wave))

        def moved(t: float) -> tuple[float, float]:
            return float(high * np.sin(wave * t + phase).sum()), float(high * (wave * np.cos(wave * t + phase)).sum())

        at = np.arange(COUNT) / self.rate
        place = np.array([moved(t) for t in at])
        return place[:, 0], place[:, 1], self.force(at, moved)


def bouc_wen(at: Array, moved: Callable[[float], tuple[float, float]]) -> Array:
    """k x + z, z' = α x' − β (γ |x'| z + δ x' |z|) with ν = 1, of Noël & Schoukens' table."""
    k, alpha, beta, gamma, delta = 5e4, 5e4, 1e3, 0.8, -1.1

    def slope(t: float, z: Array) -> Array:
        speed = moved(t)[1]
        return alpha * speed - beta * (gamma * abs(speed) * z + delta * speed * np.abs(z))

    z = solve_ivp(slope, (0.0, at[-1]), [0.0], t_eval=at, rtol=1e-6, atol=1e-6, max_step=at[1]).y[0]
    return k * np.array([moved(t)[0] for t in at]) + z


def lugre(at: Array, moved: Callable[[float], tuple[float, float]]) -> Array:
    """σ₀ z + σ₁ z' + σ₂ v, z' = v − σ₀ |v| z/g(v), g = F_C + (F_S − F_C) e^−(v/v_s)², of Canudas de Wit's table."""
    stiff, damped, viscous, slides, sticks, slow = 1e5, 1e5**0.5, 0.4, 1.0, 1.5, 1e-3

    def slope(t: float, z: Array) -> Array:
        speed = moved(t)[1]
        return speed - stiff * abs(speed) * z / (slides + (sticks - slides) * np.exp(-((speed / slow) ** 2)))

    z = solve_ivp(slope, (0.0, at[-1]), [0.0], "LSODA", t_eval=at, rtol=1e-6, atol=1e-10, max_step=at[1]).y[0]
    rate = np.array([slope(t, each) for t, each in zip(at, z, strict=True)])
    return stiff * z + damped * rate + viscous * np.array([moved(t)[1] for t in at])


SYSTEMS = (
    System("Bouc–Wen", 750.0, (0.5, 20.0), 4e-4, bouc_wen),
    System("LuGre", 500.0, (0.05, 2.0), 1e-4, lugre),
)


def stand_ins(report: Report) -> None:
    """Each system beside its peers: the force that is missed on another multisine, run freely, of its rms."""
    for system in SYSTEMS:
        seen, asked = system.series(1), system.series(2)
        for name, found in (("cubic", _cubic), ("cubic + plays + creep", _linear), ("NARX (SysIdentPy)", _narx),
                            (f"{ELEMENTS} slips and 2 lags, scanned, by Levenberg–Marquardt", _slips)):  # fmt: skip
            began = time.perf_counter()
            missed = found(seen, asked, system.rate) - asked[2]
            there = np.isfinite(missed)
            share = np.sqrt(np.mean(missed[there] ** 2) / np.mean(asked[2] ** 2))
            gone = "" if there.all() else f"runs away after {int(np.argmin(there))} rows, "
            took = f"{gone}{time.perf_counter() - began:.1f} s"
            report(f"simulated {system.name} (stand-in), {name}", f"{share:.1%}", "", took)


Series = tuple[Array, Array, Array]


def _cubic(seen: Series, asked: Series, rate: float) -> Array:
    return _by_columns(lambda x: [x**k for k in range(4)], seen, asked)


def _linear(seen: Series, asked: Series, rate: float) -> Array:
    clock = np.arange(COUNT, dtype=float)
    return _by_columns(
        lambda x: [*(x**k for k in range(4)), *plays(x, PLAYS), *creeps(x, clock, CREEPS)], seen, asked
    )  # fmt: skip


def _by_columns(columns: Callable[[Array], list[Array]], seen: Series, asked: Series) -> Array:
    unit = np.abs(seen[0]).max()
    fitted, wanted = (np.stack(columns(each[0] / unit), axis=1) for each in (seen, asked))
    found: Array = wanted @ np.linalg.lstsq(fitted, seen[2], rcond=None)[0]
    return found


def _narx(seen: Series, asked: Series, rate: float) -> Array:
    return Narx([(seen[0][:, None], seen[2])], lags=(1, 2))(asked[0][:, None], asked[2])


def _slips(seen: Series, asked: Series, rate: float) -> Array:
    """F = p(x) + c v + Σ wᵢ stopᵢ(x) + Σ gⱼ lagⱼ(x), p a cubic, thresholds rᵢ (1 + s e^−(v/v₀)²) and times free: what
    the linear peer has, and elements that slip later where it moves slowly."""
    unit, speed, size = (float(np.abs(each).max()) for each in seen)

    def of(series: Series) -> tuple[Tensor, Tensor, Tensor]:
        x, v, force = (torch.as_tensor(each) for each in series)
        return x / unit, v / speed, force / size

    def columns(p: Tensor, x: Tensor, v: Tensor) -> Tensor:
        bound = (1 + p[0] * torch.exp(-((v * p[1].exp()) ** 2)))[:, None] * p[2 : 2 + ELEMENTS].exp()
        bound = torch.cat([torch.zeros_like(bound[:1]), bound[1:]])
        held = stopped(x[:, None].expand(-1, ELEMENTS), -bound, bound)
        left = torch.exp(-1 / p[2 + ELEMENTS :].exp()).expand(len(x), -1)
        left = torch.cat([torch.zeros_like(left[:1]), left[1:]])
        late = recurred(left, (1 - left) * x[:, None])
        return torch.cat([torch.stack([x**0, x, x**2, x**3, v], dim=1), held, late], dim=1)

    x, v, force = of(seen)
    begin = torch.tensor([0.0, 2.0, *np.linspace(-4, -0.5, ELEMENTS), *np.log(CREEPS)]).double()
    # The weights at first by least squares, then everything.
    weights = torch.linalg.lstsq(columns(begin, x, v), force).solution
    count = len(begin)

    def residual(p: Tensor) -> Tensor:
        return columns(p[:count], x, v) @ p[count:] - force

    found = LevenbergMarquardt(residual, max_iterations=200, ftol=1e-8).solve(torch.cat([begin, weights])).x
    x, v, _ = of(asked)
    return (columns(found[:count], x, v) @ found[count:] * size).numpy()
