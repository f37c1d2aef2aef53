"""A bladder smaller than the bore of its braid: pressure is spent on swelling it before it presses on the threads."""

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EndEffect, columns
from freelearn.physics.mechanics.inextensible import helix

# A bore does not become narrower than this share of its radius.
THINNEST = 0.1


class Slack(Parameters):
    """stiffness: of the bladder, shear modulus times thickness. gap: share of the bore's radius at rest by which the
    bladder's own is smaller."""

    stiffness: Tensor = parameter(
        "h",
        "N/m",
        start=100.0,
        lower=0.0,
        upper=1e5,
        none=0.0,
        scale=500.0,
        prior=Prior(0.0, 1e3, "latex bladders: 1 MPa at up to 1 mm"),
    )
    gap: Tensor = parameter(
        "γ",
        "1",
        start=0.1,
        lower=0.0,
        upper=0.7,
        scale=0.1,
        prior=Prior(0.15, 0.1, "bladders that slip into their sleeve: Sangian et al. (2015)"),
    )


class BladderSlack(EndEffect[Slack]):
    """τ shown = τ − ∂ΔΠ/∂q, ΔΠ the least W(r_b) − P π r_b² l of all r_b ≤ r_i, plus P π r_i² l.

    W = π R_b L h (I₁ − 3) of a thin neo-Hookean tube of radius R_b = (1 − γ) R_i and the actuator's length and twist;
    r_i is the bore inside inextensible fibers, R_b the bladder's radius at rest. It carries all up to the pressure at
    which it reaches the bore, h/(R_b λ) (1 + ψ² − 1/(λ² q²)) with q = (r_i/R_b)² and ψ = R_b φ/L; above, it keeps that
    to itself, the more the braid swells: threshold_pressure is the same at every length, bladder_stiffness is a bladder
    without a gap. A search asks it of braids alone.
    """

    name = "bladder_slack"
    place = 5
    suspect = (
        "A braid pulls only beyond some pressure, and that is higher the shorter the muscle: its bladder is slack."
    )
    source = "Klute & Hannaford (2000); Sangian et al. (2015), pressure to bring the bladder to its sleeve"
    parameter_class = Slack
    # Few are slack enough to tell, and threshold_pressure says nearly the same.
    odds = 0.02

    def dissipate(self, loads: Tensor, states: States, p: Slack) -> Tensor:
        """As EndEffect.dissipate."""
        fibers, length, pressure = helix(states), states.length, states.pressure
        inner2 = states.inner_radius**2
        wall = (states.outer_radius**2 - inner2) * states.reference_length / length
        bore = torch.maximum(fibers.radius2 - wall, THINNEST**2 * inner2)
        by_length = (fibers.by_length - fibers.radius2 + wall) / length
        by_twist = fibers.by_twist / length
        own = (1 - p.gap) * states.inner_radius
        along, turned = length / states.reference_length, states.twist / states.reference_length
        sheared = 1 + (own * turned) ** 2

        # q = (r_b/R_b)², of the bladder at the bore, and where it hangs free.
        full = bore / own**2
        touching = pressure.abs() > p.stiffness / (own * along) * (sheared - 1 / (full * along) ** 2)
        firm = torch.where(p.stiffness > 0, p.stiffness, 1.0)
        left = torch.where(touching, 1.0, sheared - pressure * own * along / firm)
        square = torch.where(touching, full, 1 / (along * left.sqrt()))

        size = math.pi * own * p.stiffness
        pull = 2 * (along - 1 / (square * along**3))
        shear = 2 * square * own**2 * turned
        spread = size * states.reference_length * (sheared - 1 / (square * along) ** 2) / own**2
        kept = torch.where(touching, spread, math.pi * pressure * length)
        thrust = torch.where(touching, 0.0, math.pi * pressure * (own**2 * square - bore))
        return loads - columns(size * pull + kept * by_length - thrust, size * shear + kept * by_twist)
