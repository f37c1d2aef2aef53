"""What tells the poses of a free block on three actuators (docs/real_data.md), and from where its fit begins."""

MEMBERS = 3
# Effects of which each actuator has a value of its own; the others have one for all three.
OF_EACH = ("threshold_pressure",)
LEANING = ("off_axis", "fiber_tension_only", "threshold_pressure")
# The same where each actuator has a rubber of its own and the dead band is one for all; then with ends that taper and
# a zero of each actuator's twist.
RUBBERS = (*LEANING, "wall_modulus")
BUILT = (*RUBBERS, "end_taper", "twist_offset")
BUILT_EACH = ("wall_modulus", "twist_offset")
# Threads that pull and hardly push, or else a fit ends with fibers as soft as rubber.
START = {
    "C1": 5e5,
    "C2": 3e7,
    "off_axis.squared_distance": 5e-4,
    "fiber_tension_only.share": 0.8,
    "block_tilt.compliance": 1e-5,
    "threshold_pressure.pressure": 2e4,
    **{f"threshold_pressure.pressure[{n}]": 2e4 for n in range(1, MEMBERS + 1)},
}
