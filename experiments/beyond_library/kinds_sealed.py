"""The other half of the kinds, for the one look at the end: whoever writes the search does not open this file."""

from __future__ import annotations

import numpy as np
from beyond_library.kind import Kind, over

KINDS = (
    # A clamp that creeps off the tube once it is pulled.
    Kind(
        *("creeping_clamp", "boundary", "length", ("elongation",), "hinge", "Δl = a max(ê − c, 0)"),
        lambda x, p: over(x["elongation"], p["c"]),
        {"c": (-0.2, 0.4)},
    ),
    # A spindle whose lead errs periodically.
    Kind(
        *("spindle_lead", "boundary", "length", ("elongation",), "sine", "Δl = a sin(k ê + θ)"),
        lambda x, p: np.sin(p["k"] * x["elongation"] + p["theta"]),
        {"k": (4.0, 8.0), "theta": (-3.1, 3.1)},
    ),
    # A thread on the shaft: it turns with the carriage, the more the farther it is wound.
    Kind(
        *("threaded_shaft", "boundary", "twist", ("elongation", "twist"), "product", "Δφ = a ê φ̂"),
        lambda x, p: x["elongation"] * x["twist"],
    ),
    # A coupling that winds up until it meets its stop.
    Kind(
        *("soft_coupling", "boundary", "twist", ("twist",), "saturation", "Δφ = a tanh(φ̂/w)"),
        lambda x, p: np.tanh(x["twist"] / p["w"]),
        {"w": (0.15, 0.35)},
    ),
    # A supply hose that is pinched as the block turns.
    Kind(
        *("pinched_hose", "boundary", "pressure", ("pressure", "twist"), "product", "ΔP = a P̂ sin(k φ̂ + θ)"),
        lambda x, p: x["pressure"] * np.sin(p["k"] * x["twist"] + p["theta"]),
        {"k": (2.5, 4.5), "theta": (-3.1, 3.1)},
    ),
    # A valve that leaks ever more.
    Kind(
        *("leaking_valve", "boundary", "pressure", ("pressure",), "exponential", "ΔP = a (exp(k P̂) − 1)"),
        lambda x, p: np.expm1(p["k"] * x["pressure"]),
        {"k": (2.5, 4.5)},
    ),
    # Threads that slip on the wall when the tube is stretched or pushed together.
    Kind(
        *("slipping_threads", "geometry", "fiber_angle", ("elongation",), "polynomial", "ΔΓ = a ê²"),
        lambda x, p: x["elongation"] ** 2,
    ),
    # Ends that take up length of the tube as they are turned.
    Kind(
        *("gathering_ends", "geometry", "reference_length", ("twist",), "modulus", "ΔL = a |φ̂ − c|"),
        lambda x, p: np.abs(x["twist"] - p["c"]),
        {"c": (-0.4, 0.4)},
    ),
    # A rubber whose chains stiffen late.
    Kind(
        *("late_chains", "energy", "i1", ("i1",), "power", "Ψ = a Î₁ⁿ, Î₁ = (I₁ − 3)/0.1"),
        lambda x, p: over(x["i1"]) ** p["n"],
        {"n": (2.8, 3.8)},
    ),
    # Fibers in a glue that yields: their stress saturates.
    Kind(
        *("yielding_glue", "energy", "i4", ("i4",), "saturation", "Ψ = a w ln cosh(Î₄/w), Î₄ = (I₄ − 1)/0.05"),
        lambda x, p: p["w"] * np.log(np.cosh(x["i4"] / p["w"])),
        {"w": (0.12, 0.3)},
    ),
    # A bellows along the tube that locks as it is stretched.
    Kind(
        *("locking_bellows", "parallel", "axial", ("elongation",), "exponential", "F = −a (exp(k ê) − 1)"),
        lambda x, p: -np.expm1(p["k"] * x["elongation"]),
        {"k": (1.5, 3.0)},
    ),
    # A magnet that the carriage passes.
    Kind(
        *("passing_magnet", "parallel", "axial", ("elongation",), "bump", "F = a exp(−((ê − c)/w)²)"),
        lambda x, p: np.exp(-(((x["elongation"] - p["c"]) / p["w"]) ** 2)),
        {"c": (-0.4, 0.4), "w": (0.2, 0.4)},
    ),
    # A seal that grips once its rod is out.
    Kind(
        *("gripping_seal", "dissipation", "force", ("elongation", "direction"), "hinge", "F lags by a max(ê − c, 0)"),
        lambda x, p: over(x["elongation"], p["c"]),
        {"c": (-0.5, 0.2)},
    ),
    # Threads that rub where the tube is twisted, either way.
    Kind(
        *("twisted_threads", "dissipation", "moment", ("twist", "direction"), "modulus", "M lags by a |φ̂ − c|"),
        lambda x, p: np.abs(x["twist"] - p["c"]),
        {"c": (-0.3, 0.3)},
    ),
    # A load cell whose gain drifts.
    Kind(
        *("drifting_gain", "measurement", "force", ("force", "time"), "product", "F shown = F + a F̂ t̂"),
        lambda x, p: x["force"] * x["time"],
    ),
    # A load cell that warms up after it was switched on.
    Kind(
        *("warming_cell", "measurement", "force", ("time",), "exponential", "F shown = F + a exp(−t̂/τ)"),
        lambda x, p: np.exp(-x["time"] / p["tau"]),
        {"tau": (0.08, 0.25)},
    ),
    # A moment cell that is pinched by large pushes.
    Kind(
        *("pinched_cell", "measurement", "moment", ("force",), "hinge", "M shown = M + a max(F̂ − c, 0)"),
        lambda x, p: over(x["force"], p["c"]),
        {"c": (-0.3, 0.3)},
    ),
    # A moment cell that tips over with the load's sign.
    Kind(
        *("tipping_cell", "measurement", "moment", ("force",), "saturation", "M shown = M + a tanh(F̂/w)"),
        lambda x, p: np.tanh(x["force"] / p["w"]),
        {"w": (0.1, 0.3)},
    ),
)
