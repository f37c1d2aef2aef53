"""The material of the continuum model, and shear moduli of materials by name."""

from __future__ import annotations

import re
from dataclasses import dataclass

from torch import Tensor

from freelearn.common.errors import unknown
from freelearn.physics.chain.parameters import Parameters, Prior, parameter

# Logarithms: what holds pressure is made of silicone of 10 kPa to natural rubber and polyurethane of some MPa, and its
# fiber, spread over the wall, may be a few sewing threads or a braid of aramid.
RUBBER = Prior(2.2e5, 1.25, "silicones (Marechal et al. 2021), latex and TPU: 0.01 to 5 MPa")
FIBERS = Prior(3e7, 2.3, "cotton to aramid thread, 1 to 100 GPa, at 0.1 to 10 % of the wall")


class Material(Parameters):
    """C1: shear modulus of the wall [Pa]; C2: stiffness of the fiber per wall volume [Pa]; both fitted as logs."""

    C1: Tensor = parameter("C₁", "Pa", start=1e5, lower=0.0, log=True, source="Sedal et al. 2018", prior=RUBBER)
    C2: Tensor = parameter("C₂", "Pa", start=1e6, lower=0.0, log=True, source="Sedal et al. 2018", prior=FIBERS)


# What tubes are made of: shear moduli of materials by name, for the prior of C1.


@dataclass(frozen=True)
class Stock:
    """A material that one can buy, or that grows. C1: shear modulus [Pa]. deviation: of its natural logarithm: batches,
    mixing, curing and age, and how far a neo-Hookean rubber is from it. source: of the modulus. fiber: what is known of
    C2, where the material brings its fibers."""

    C1: float
    deviation: float
    source: str
    fiber: Prior | None = None

    @property
    def prior(self) -> Prior:
        """Of C1."""
        return Prior(self.C1, self.deviation, self.source)


def _measured(C1: float, deviation: float = 0.4) -> Stock:
    """Fitted here to a curve of the Soft Robotics Materials Database, stretches up to 2: nominal stress C1 (λ − λ⁻²).
    Data sheets tell up to twice as much."""
    return Stock(C1, deviation, "tension up to 100 %: Marechal et al. (2021), Soft Robotics 8(3)")


def _stated(stress: float, sheet: str, deviation: float = 0.3) -> Stock:
    """stress: at 100 % elongation [Pa], as a data sheet tells it: C1 (2 − 2⁻²)."""
    return Stock(round(stress / 1.75, -3), deviation, f"stress at 100 %: {sheet}")


# Of the nineteen measured ones no row is here, but one number of each. They contain information from the Soft Robotics
# Materials Database (github.com/LucMarechal/Soft-Robotics-Materials-Database), made available under the Open Database
# License 1.0.
MATERIALS: dict[str, Stock] = {
    "bodydouble_silk": _measured(1.34e5),
    "dragon_skin_10": _measured(5.6e4),
    "dragon_skin_20": _measured(1.60e5),
    "dragon_skin_30": _measured(2.23e5),
    "dragon_skin_fx_pro": _measured(3.3e4),
    "dragon_skin_fx_pro_slacker": _measured(2.7e3),
    "ecoflex_00_10": _measured(8.0e3, 0.5),
    "ecoflex_00_30": _measured(1.6e4, 0.5),
    "ecoflex_00_35_fast": _measured(3.0e4, 0.5),
    "ecoflex_00_50": _measured(2.2e4, 0.5),
    "mold_star_16_fast": _measured(9.6e4),
    "mold_star_20t": _measured(1.25e5),
    "platsil_gel_10": _measured(7.2e4),
    "psycho_paint": _measured(1.33e5),
    "rebound_25": _measured(1.19e5),
    "rtv615": _measured(4.0e5),
    "soloplast_150318": _measured(7.6e4),
    "sorta_clear_40": _measured(3.0e5),
    "wagnersil_20_nf": _measured(1.54e5),
    "smooth_sil_950": _stated(1.88e6, "Smooth-On's sheet, 272 psi"),
    "latex": _stated(7.0e5, "sheets of latex tubing, Shore 35 A, at most 125 psi"),
    "natural_rubber": Stock(3.9e5, 0.3, "unfilled, 8 % of sulfur: Treloar (1944)"),
    "sylgard_184": Stock(6.0e5, 0.4, "E/3, by curing temperature: Johnston et al. (2014)"),
    "silicone_50a": Stock(8.5e5, 0.4, "Shore 50 A by Gent (1958): E = 2.5 MPa"),
    "tpu_ninjaflex": Stock(4.0e6, 0.4, "E/3 of NinjaTek's sheet: E = 12 MPa"),
    "tpu_cheetah": Stock(8.7e6, 0.4, "E/3 of NinjaTek's sheet: E = 26 MPa"),
    # The moduli are 0.3 to 8 kPa, those of the collagen 0.6 kPa to 1 MPa, before it stiffens.
    "artery": Stock(
        4e3,
        1.2,
        "layers of arteries: Holzapfel et al. (2000), Gasser et al. (2006)",
        Prior(2.5e4, 1.6, "collagen in layers of arteries: Holzapfel et al. (2000), Gasser et al. (2006)"),
    ),
}


def material(name: str) -> Stock:
    """The material of this name, however it is spaced. Raises UserError.

    >>> material("Ecoflex 00-30").C1, material("ecoflex_00_30").C1
    (16000.0, 16000.0)
    """
    known = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    if known not in MATERIALS:
        raise unknown("material", known or name, MATERIALS)
    return MATERIALS[known]
