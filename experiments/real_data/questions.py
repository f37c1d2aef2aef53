"""What each measured set is asked: which part is left out of the fit and predicted, by which models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

ANGLE = "fiber_misalignment"


@dataclass(frozen=True)
class Question:
    """What is predicted without having been seen.

    groups: columns whose values, rounded, make a part that is left out whole. models: effects of each. inputs: of the
    cubic polynomial. readings: what is predicted, by its place among the bed's two, its unit and factor from SI.
    published: what others left, and of what. largest: the largest error is told, not the root mean square. percent: of
    the largest reading.
    """

    recipe: str
    groups: tuple[str, ...]
    models: Sequence[tuple[str, ...]]
    inputs: tuple[str, ...]
    readings: Sequence[tuple[int, str, float]]
    published: str
    largest: bool = False
    percent: bool = True

    def parts(self, table: pd.DataFrame) -> pd.Series:
        """The part of each row, in words."""
        rounded = [
            table[name].round(1 if name == "elongation_mm" and len(self.groups) == 1 else 0) for name in self.groups
        ]
        words = [pd.Series([f"{v:g}" for v in each], index=table.index) for each in rounded]
        return words[0].str.cat(words[1:], sep=", ")


PRESSURES = ("pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa")
YIELDING = (ANGLE, "friction_hysteresis", "length_compliance")
QUESTIONS = (
    Question(
        "dmsp_20_300",
        ("elongation_mm",),
        (
            (),
            (ANGLE,),
            (ANGLE, "end_clamps", "second_invariant_log"),
            (ANGLE, "small_strain_stiffness", "end_taper"),
        ),
        ("elongation_mm", "pressure_kpa"),
        ((0, "force", 1.0),),
        "five coefficients, nothing left out: < 2.35",
        largest=True,
    ),
    Question(
        "festo_10mm",
        ("length_mm",),
        ((), (ANGLE,), YIELDING, (*YIELDING, "pressure_offset"), (*YIELDING, "pressure_offset", "fiber_tension_only")),
        ("length_mm", "elongation_mm", "pressure_kpa"),
        ((0, "force", 1.0),),
        "",
    ),
    Question(
        "parallel_3",
        ("elongation_mm", "twist_deg"),
        (
            (),
            ("pressure_gain", "sensor_crosstalk"),
            ("wall_thickness", "length_compliance", "sensor_crosstalk"),
            ("wall_thickness", "length_compliance", "sensor_crosstalk", "viscoelasticity"),
            ("pressure_gain", "length_compliance", "sensor_crosstalk", "viscoelasticity"),
        ),
        ("elongation_mm", "twist_deg", *PRESSURES),
        ((0, "N", 1.0), (1, "N·mm", 1e3)),
        "< 1.5 N",
        percent=False,
    ),
    Question(
        "torsion_4angles",
        ("gamma_deg",),
        ((), (ANGLE,), (ANGLE, "end_clamps"), ("force_offset", "end_clamps")),
        ("gamma_deg", "moment_nmm", "pressure_kpa"),
        ((1, "°", 180 / np.pi),),
        "",
        percent=False,
    ),
)
