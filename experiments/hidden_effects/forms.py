"""python experiments/hidden_effects/forms.py: how far the package's formulas are from the literature's forms.

On pairs of random actuators and the laboratory's standard protocol, without noise: which share of what an effect in the
literature's form changes, squared, in units of the load cells' noise and after refitting C1 and C2, the package's
formula leaves with its best parameters.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from freelearn.testing.reference.laboratory import Actuators, Laboratory, measure, random_actuators

MATERIAL = 1e6, 3e7
DEVIATION = {"force_n": 0.03, "moment_nmm": 0.6}
SILENT = dict.fromkeys(("elongation_mm", "twist_deg", "pressure_kpa", *DEVIATION), 0.0)
PAIRS = 8
Values = dict[str, float]


def compared() -> Iterator[tuple[str, str, Values, list[Values]]]:
    """What it is, the effect, its values in the literature's form, and those of the package to choose from."""
    times = [{"share": 0.02, "time": t} for t in (20.0, 30.0, 45.0, 60.0, 90.0)]
    yield "relaxation", "relaxation", {"share": 0.02, "time": 45.0}, times
    depths = [{"depth": 0.02, "severity": float(m)} for m in np.geomspace(1e-3, 1, 13)]
    for energy in (0.01, 0.05, 0.2):
        values = {"inverse_r": 0.02, "energy": energy}
        yield f"stress_softening, m = {energy:g} C1", "stress_softening", values, depths
    rub = {"force": 0.5, "moment": 5e-3}
    yield "friction_hysteresis", "friction_hysteresis", rub | {"sliding": 2e3}, [rub]
    carried = rub | {"sliding": 2e3, "carried": 1.0}
    yield "friction_hysteresis, not lost with the move to a state", "friction_hysteresis", carried, [rub]
    yield "twist_slack", "twist_slack", {"angle": 0.01, "stiffness": 1e3}, [{"angle": 0.01}]
    for time in (30.0, 60.0, 150.0):
        nearby = [{"share": 0.05, "time": time * factor} for factor in (0.5, 0.7, 1.0, 1.4, 2.0, 4.0)]
        yield f"viscoelasticity, τ = {time:g} s", "viscoelasticity", {"share": 0.05, "time": time}, nearby
    yield "end_taper, sharp cones", "end_taper", {"ratio": 2.0}, [{"ratio": 2.0}]
    for pressure in (500.0, 5e3):
        values = {"pressure": pressure}
        yield f"threshold_pressure, {pressure:g} Pa", "threshold_pressure", values, [values]
    press = {"force": 1e-3, "moment": 1e-3}
    yield "contact_friction", "contact_friction", press | {"sliding": 2e3}, [press]
    scatter = {"kappa": 0.01}
    yield "fiber_dispersion, mean of the squared stretch", "fiber_dispersion", scatter, [scatter]
    yield "fiber_dispersion, each fiber's energy", "fiber_dispersion", scatter | {"each_fiber": 1.0}, [scatter]


def left(actuators: Actuators, seed: int, effect: str, literature: Values, package: list[Values]) -> float:
    """Share of the squared change that the best of the package's values leave."""

    def loads(forms: str, fx: dict[str, Values], c1: float = 1.0, c2: float = 1.0) -> np.ndarray:
        stiffness = MATERIAL[0] * c1, MATERIAL[1] * c2
        table = measure(Laboratory(forms=forms), actuators, *stiffness, fx, SILENT, seed).table  # type: ignore[arg-type]
        return np.concatenate([table[name] / sd for name, sd in DEVIATION.items()])

    plain = loads("package", {})
    span = np.linalg.qr(np.stack([loads("package", {}, 1.001), loads("package", {}, 1.0, 1.001)], 1) - plain[:, None])[
        0
    ]

    def change(forms: str, values: Values) -> np.ndarray:
        raw = loads(forms, {effect: values}) - plain
        return raw - span @ (span.T @ raw)

    sought = change("literature", literature)
    shares = []
    for values in package:
        found = change("package", values)
        shares.append(1 - (sought @ found) ** 2 / (sought @ sought) / (found @ found))
    return max(float(min(shares)), 0.0)


def main() -> None:
    """Runs the command."""
    print(f"{'left by the package, % of the squared change':60} median  least  most")
    for what, effect, literature, package in compared():
        shares = []
        for seed in range(PAIRS):
            actuators = random_actuators(2, np.random.default_rng(seed))
            shares.append(100 * left(actuators, seed, effect, literature, package))
        print(f"{what:60} {np.median(shares):6.2f} {min(shares):6.2f} {max(shares):5.1f}")


if __name__ == "__main__":
    main()
