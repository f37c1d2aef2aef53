"""What braided muscles have beside an ideal tube: a bladder, ends that taper, threads that rub, pressure that is lost.

Written from the literature and apart from the package: volumes of cones and not their slopes, which complex steps give.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Effects = Mapping[str, Mapping[str, float]]
STEP = 1e-30
# Both only where the package's formulas are asked for: how far from rest, in outer radii, its cones are sharp, and the
# pressure [Pa] and power of the norm that round off its threshold.
BLUNT, ONSET, POWER = 0.01, 1e3, 12
THINNEST = 0.1


def liner_energy(
    length: Array, twist: Array, u: Array, reference: Array, inner: Array, stiffness: float
) -> Array | float:
    """Energy (N,) J of a thin neo-Hookean bladder on the bore, √u its radius; stiffness: shear modulus times thickness.

    A membrane with the deformation gradient (λz, 0; r φ/L, r/R) in (z, θ) that keeps its volume by becoming thinner.
    """
    if stiffness == 0:
        return 0.0
    along, around, slide = length / reference, u / inner**2, u * (twist / reference) ** 2
    first = along**2 + around + slide + 1 / (along**2 * around)
    return np.asarray(np.pi * inner * reference * stiffness * (first - 3))


def thread_radius(s: Mapping[str, Array], length: Array, twist: Array) -> Array:
    """Radius (N,) m at which threads that hardly stretch lie; length and twist (N,) may be complex.

    The squared stretch of a thread of each family is (l/B)² + u (t/B)², with B = L/cos Γ its length, t the angle that
    it winds, and u = r². Least squares of what these differ from one: of one family, none.
    """
    asked: Any = 0.0
    given: Any = 0.0
    for gamma in (s[name] for name in ("gamma", "gamma2") if name in s):
        there, angle = np.isfinite(gamma), np.nan_to_num(gamma, nan=1.0)
        thread = s["reference"] / np.cos(angle)
        wound = s["reference"] / s["outer"] * np.tan(angle) + twist
        slope, lacking = (wound / thread) ** 2, 1 - (length / thread) ** 2
        asked, given = asked + there * slope * lacking, given + there * slope**2
    square, least = asked / given, (THINNEST * s["outer"]) ** 2
    return np.asarray(np.sqrt(np.where(square.real > least, square, least)))


def lost_volume(radius: Array, rest: Array, ratio: float, blunt: float) -> Array:
    """What two cones between the fittings' radius `rest` and the tube's lack of a cylinder, (N,) m³.

    Each is ratio |r − R| long; blunt: share of R over which that begins from nothing, 0 for sharp cones.
    """
    swelling = radius - rest
    with np.errstate(invalid="ignore", divide="ignore"):
        size = swelling**2 / np.sqrt(swelling**2 + (blunt * rest) ** 2)
    cone = ratio * np.where(swelling == 0, 0.0, size)
    frustum = np.pi / 3 * cone * (radius**2 + radius * rest + rest**2)
    return np.asarray(2 * (np.pi * radius**2 * cone - frustum))


def tapered(s: Mapping[str, Array], fx: Effects, blunt: float = 0.0) -> Array | float:
    """Loads (N, 2) that tapered ends add: −P ∂V/∂(l, φ) of the fluid that they lack (Tondu & Lopez 2000)."""
    ratio = fx.get("end_taper", {}).get("ratio", 0.0)
    if ratio == 0:
        return 0.0

    def volume(length: Array, twist: Array) -> Array:
        return lost_volume(thread_radius(s, length, twist), s["outer"], ratio, blunt)

    longer = volume(s["length"] + 1j * STEP, s["twist"] + 0j).imag / STEP
    turned = volume(s["length"] + 0j, s["twist"] + 1j * STEP).imag / STEP
    return np.asarray(-s["pressure"][:, None] * np.stack([longer, turned], axis=1))


def jammed(s: Mapping[str, Array], fx: Effects, apart: bool = False) -> Array | float:
    """Loads (N, 2) of a braid whose strands touch (Davis & Caldwell 2006): −∂U/∂(l, φ), complex steps.

    A family's neighbors lie r cos α apart, but for a factor. apart: cos α is each family's own, as turned and stretched
    it lies, and U is their mean; else that of a strand that keeps its length.
    """
    p = fx.get("strand_jamming")
    if p is None:
        return 0.0
    gammas = [s[name] for name in ("gamma", "gamma2") if name in s]

    def energy(length: Array, twist: Array) -> Array:
        radius = thread_radius(s, length, twist)
        each: Any = 0.0
        count: Any = 0.0
        for gamma in gammas:
            there, angle = np.isfinite(gamma), np.nan_to_num(gamma, nan=1.0)
            strand = s["reference"] / np.cos(angle)
            wound = s["reference"] / s["outer"] * np.tan(angle) + twist
            lying = np.sqrt(length**2 + (radius * wound) ** 2) if apart else strand
            spacing = radius * (length / lying) / (s["outer"] * np.cos(angle))
            closed = (1 - p["room"]) / spacing - 1
            each = each + there * np.where(closed.real > 0, closed, 0) ** 2
            count = count + there
        return np.asarray(np.pi * s["outer"] * s["reference"] * p["stiffness"] * each / count)

    longer = energy(s["length"] + 1j * STEP, s["twist"] + 0j).imag / STEP
    turned = energy(s["length"] + 0j, s["twist"] + 1j * STEP).imag / STEP
    return np.asarray(-np.stack([longer, turned], axis=1))


def bent(loads: Array, s: Mapping[str, Array], fx: Effects, sharp: bool = False) -> Array:
    """Loads (N, 2) that reach the mount of tubes that bend aside under Euler's load. sharp: at once, where they come to
    it."""
    p = fx.get("buckling")
    if p is None:
        return loads
    euler = (2 * np.pi / s["reference"]) ** 2 / p["flexibility"]
    push = np.maximum(loads[:, 0], 0.0)
    held = np.minimum(push, euler) if sharp else euler * (1 - np.exp(-push / euler))
    return np.stack([np.where(loads[:, 0] > 0, held, loads[:, 0]), loads[:, 1]], axis=1)


def unfilled(s: Mapping[str, Array], fx: Effects) -> Array | float:
    """Loads (N, 2) of a bladder that does not fill its braid: −∂/∂(l, φ) of its energy and of the fluid that is not
    where it would be without it, at the radius of least potential, found by bisection up to the bore."""
    p = fx.get("bladder_slack")
    if p is None:
        return 0.0
    own = (1 - p["gap"]) * s["inner"]

    def bore(length: Array, twist: Array) -> Array:
        wall = (s["outer"] ** 2 - s["inner"] ** 2) * s["reference"] / length
        return np.asarray(thread_radius(s, length, twist) ** 2 - wall)

    def potential(length: Array, twist: Array, u: Array) -> Array:
        stored = liner_energy(length, twist, u, s["reference"], own, p["stiffness"])
        return np.asarray(stored - s["pressure"] * np.pi * (u - bore(length, twist)) * length)

    most = bore(s["length"], s["twist"])
    low, high = 1e-3 * own**2, most.copy()
    for _ in range(60):
        middle = (low + high) / 2
        above = potential(s["length"], s["twist"], middle + 1j * STEP * own**2).imag > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    touching = high >= most * (1 - 1e-9)

    def least(length: Array, twist: Array) -> Array:
        return potential(length, twist, np.where(touching, bore(length, twist), high))

    longer = least(s["length"] + 1j * STEP, s["twist"] + 0j).imag / STEP
    turned = least(s["length"] + 0j, s["twist"] + 1j * STEP).imag / STEP
    return np.asarray(-np.stack([longer, turned], axis=1))


def contact(s: Mapping[str, Array], fx: Effects, share: Array) -> Array | float:
    """Force and moment (N, 2) that rubbing threads take off: f S P of Tondu & Lopez (2000), S the tube's surface.

    share: of the friction that acts, (N,) in −1 … 1, positive against rising pressure.
    """
    p = fx.get("contact_friction")
    if p is None:
        return 0.0
    radius = thread_radius(s, s["length"], s["twist"])
    press = s["pressure"] * 2 * np.pi * radius * s["length"]
    return np.asarray((share * press)[:, None] * np.stack([0 * radius + p["force"], p["moment"] * radius], axis=1))


def beyond_threshold(s: dict[str, Array], fx: Effects, sharp: bool = False) -> dict[str, Array]:
    """States whose pressure is what presses on the braid: what exceeds the threshold (Chou & Hannaford 1996).

    sharp: nothing below it, as there; else rounded off as the package's is.
    """
    threshold = fx.get("threshold_pressure", {}).get("pressure", 0.0)
    if threshold == 0:
        return s
    pressure = s["pressure"]
    if sharp:
        return s | {"pressure": np.sign(pressure) * np.maximum(np.abs(pressure) - threshold, 0.0)}
    norm = (np.abs(pressure) ** POWER + threshold**POWER + ONSET**POWER) ** (1 / POWER)
    return s | {
        "pressure": pressure * (1 - threshold / norm / (1 + (ONSET / np.where(pressure == 0, 1e-9, pressure)) ** 2))
    }
