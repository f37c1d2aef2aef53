"""Measurement tables of the reference bed with something hidden in them, and a library that is searched quickly."""

from freelearn.physics.effects.registry import EFFECTS
from freelearn.testing.effect_page import in_library
from freelearn.testing.reference.total_energy import measure

NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
MATERIAL = 8e5, 2e7


def table(effects, seed=3, samples=(3, 6), extra=None, share=0.3):
    return measure(list(samples), *MATERIAL, effects, NOISE, seed, share, extra)


# Of each port an effect or two: where a test does not ask about the search itself, the rest is ruled out.
FEW = ("wall_stiffening", "end_clamps", "fiber_misalignment", "pressure_gain", "force_offset", "friction_hysteresis")


def among(*names):
    """The override with which a search looks at these effects of the library alone."""
    others = [name for name, effect in EFFECTS.items() if in_library(effect) and name not in names]
    return f"ruled_out=[{','.join(others)}]"


QUICK = among(*FEW)
