"""Measurement tables of the reference bed with something hidden in them."""

from freelearn.testing.reference.bed import measure

NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
MATERIAL = 8e5, 2e7


def table(effects, seed=3, samples=(3, 6), extra=None, share=0.3):
    return measure(list(samples), *MATERIAL, effects, NOISE, seed, share, extra)
