"""The half of the kinds that whoever writes the search may look at.

Of four kinds at each of nine places two were drawn: numpy.random.default_rng(20260).permutation(4)[:2] for boundary
length, twist and pressure, geometry, energy, parallel, dissipation, force cell and moment cell in turn.
"""

from __future__ import annotations

import numpy as np
from beyond_library.kind import Kind, over

KINDS = (
    # A cable wound on the shaft lifts the carriage, whichever way it turns from where it hangs straight.
    Kind(
        *("carriage_lifts", "boundary", "length", ("twist",), "modulus", "Δl = a |φ̂ − c|"),
        lambda x, p: np.abs(x["twist"] - p["c"]),
        {"c": (-0.4, 0.4)},
    ),
    # The frame bows under the pressure's thrust, more and more.
    Kind(
        *("frame_bows", "boundary", "length", ("pressure",), "polynomial", "Δl = a P̂²"),
        lambda x, p: x["pressure"] ** 2,
    ),
    # A shaft that its seal winds up: quick at first.
    Kind(
        *("shaft_winds", "boundary", "twist", ("pressure",), "power", "Δφ = a P̂ⁿ"),
        lambda x, p: np.abs(x["pressure"]) ** p["n"],
        {"n": (0.35, 0.6)},
    ),
    # An encoder's disk that sits beside its axis, behind a gear.
    Kind(
        *("eccentric_disk", "boundary", "twist", ("twist",), "sine", "Δφ = a sin(k φ̂ + θ)"),
        lambda x, p: np.sin(p["k"] * x["twist"] + p["theta"]),
        {"k": (3.2, 6.5), "theta": (-3.1, 3.1)},
    ),
    # A gauge that follows no longer beyond some pressure.
    Kind(
        *("gauge_saturates", "boundary", "pressure", ("pressure",), "hinge", "ΔP = a max(P̂ − c, 0)"),
        lambda x, p: over(x["pressure"], p["c"]),
        {"c": (0.35, 0.65)},
    ),
    # A gauge whose membrane bends.
    Kind(
        *("gauge_bends", "boundary", "pressure", ("pressure",), "polynomial", "ΔP = a P̂²"),
        lambda x, p: x["pressure"] ** 2,
    ),
    # A wall that the pressure squeezes.
    Kind(
        *("wall_squeezed", "geometry", "outer_radius", ("pressure",), "power", "ΔR_o = a P̂ⁿ"),
        lambda x, p: np.abs(x["pressure"]) ** p["n"],
        {"n": (1.4, 1.7)},
    ),
    # Fibers that settle in their bed as soon as some pressure presses on them.
    Kind(
        *("fibers_settle", "geometry", "fiber_angle", ("pressure",), "saturation", "ΔΓ = a tanh(P̂/w)"),
        lambda x, p: np.tanh(x["pressure"] / p["w"]),
        {"w": (0.2, 0.45)},
    ),
    # A second winding that is slack until the first has stretched.
    Kind(
        *("second_winding", "energy", "i4", ("i4",), "hinge", "Ψ = a max(Î₄ − c, 0)², Î₄ = (I₄ − 1)/0.05"),
        lambda x, p: over(x["i4"], p["c"]) ** 2,
        {"c": (0.05, 0.25)},
    ),
    # A gel between the threads that stiffens exponentially.
    Kind(
        *("stiffening_gel", "energy", "i2", ("i2",), "exponential", "Ψ = a (exp(k Î₂) − 1), Î₂ = (I₂ − 3)/0.1"),
        lambda x, p: np.expm1(p["k"] * x["i2"]),
        {"k": (0.9, 1.6)},
    ),
    # A cord that leaves the axis as the block turns.
    Kind(
        *("leaning_cord", "parallel", "both", ("elongation", "twist"), "product", "V = a ê φ̂²"),
        lambda x, p: x["elongation"] * x["twist"] ** 2,
    ),
    # A coiled supply hose: the pressure makes it a spring in twist.
    Kind(
        *("coiled_hose", "parallel", "torsional", ("pressure", "twist"), "product", "M = a P̂ sin(k φ̂ + θ)"),
        lambda x, p: x["pressure"] * np.sin(p["k"] * x["twist"] + p["theta"]),
        {"k": (2.5, 4.5), "theta": (-3.1, 3.1)},
    ),
    # Threads that stick to each other once they are pressed hard.
    Kind(
        *("sticking_threads", "dissipation", "force", ("pressure", "direction"), "polynomial", "F lags by a P̂³"),
        lambda x, p: x["pressure"] ** 3,
    ),
    # A bearing with one rough place.
    Kind(
        *("rough_bearing", "dissipation", "moment", ("twist", "direction"), "bump", "M lags by a exp(−((φ̂ − c)/w)²)"),
        lambda x, p: np.exp(-(((x["twist"] - p["c"]) / p["w"]) ** 2)),
        {"c": (-0.5, 0.5), "w": (0.2, 0.45)},
    ),
    # A load cell that bends, both ways alike.
    Kind(
        *("cubic_cell", "measurement", "force", ("force",), "polynomial", "F shown = F + a F̂³"),
        lambda x, p: x["force"] ** 3,
    ),
    # A load cell with one gain for push and another for pull.
    Kind(
        *("two_gains", "measurement", "force", ("force",), "modulus", "F shown = F + a |F̂|"),
        lambda x, p: np.abs(x["force"]),
    ),
    # A moment cell whose gain ripples as its flange turns.
    Kind(
        *("rippling_gain", "measurement", "moment", ("moment", "twist"), "product", "M shown = M + a M̂ sin(k φ̂ + θ)"),
        lambda x, p: x["moment"] * np.sin(p["k"] * x["twist"] + p["theta"]),
        {"k": (2.5, 5.0), "theta": (-3.1, 3.1)},
    ),
    # A moment cell whose zero jumps once.
    Kind(
        *("jumping_zero", "measurement", "moment", ("time",), "step", "M shown = M + a [t̂ > c]"),
        lambda x, p: (x["time"] > p["c"]) * 1.0,
        {"c": (0.3, 0.7)},
    ),
)
