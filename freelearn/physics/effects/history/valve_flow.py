"""A valve that fills and empties the actuator: at first at the speed of sound, whatever is missing, and then slower."""

import math

import torch
from torch import Tensor

from freelearn.data.recordings import Recording, followed
from freelearn.data.states import States
from freelearn.physics.chain.lags import lag
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect

# Of the air around, and what no gas is nearer to nothing than [Pa].
ATMOSPHERE, THINNEST = 101_325.0, 1e3
# Share of a ratio that is kept off its end, where a slope is infinite.
EDGE = 1e-12
# Share of a step's change, behind which by less a pressure comes to a command that stays within the step.
QUICK = 0.25
# Parts of a step in which a command counts as staying, one after the other.
PARTS = 2
# Time of the lag that the search begins from, in units of r V.
GUESSED = 0.35


class Valve(Parameters):
    """squared_resistance: of one over the valve's sonic conductance times 1 bar; critical: ratio of the pressures
    behind and before the valve up to which the flow is that of sound."""

    squared_resistance: Tensor = parameter(
        "r²",
        "s²/m⁶",
        start=1e8,
        lower=0.0,
        upper=1e14,
        none=0.0,
        scale=4e9,
        prior=Prior(0.0, 1e9, "small valves and their lines pass 0.03 to 2 Nl/s at 1 bar: data sheets"),
    )
    critical: Tensor = parameter(
        "b",
        "1",
        start=0.3,
        lower=0.02,
        upper=0.48,
        scale=0.1,
        prior=Prior(0.3, 0.1, "0.2 to 0.5: ISO 6358-1 (2013)"),
    )


class ValveFlow(HistoryEffect[Valve]):
    """r V P' = p₁ ψ(p₂/p₁), from the higher p₁ of command and actuator to the lower p₂ (absolute).

    ψ = 1 up to p₂/p₁ = b, and beyond √(1 − ((p₂/p₁ − b)/(1 − b))²); 1/r is the sonic conductance times 1 bar. The gas
    keeps its temperature, and V is the bore's at rest. Exact where the command stays through each step: filled,
    (p/p₁ − b)/(1 − b) grows evenly up to 0, and is a sine from there; emptied, p falls exponentially, and from p₂/b on
    as an integral tells. A command that moves within a step counts as PARTS that stay, at the values at which a
    pressure that follows an even ramp ends as far behind as it began. Each recording begins at the command.
    """

    name = "valve_flow"
    place = 2
    acts_on = "supply"
    suspect = "The pressure follows large steps of its command late and at an even rate, and small ones at once."
    source = "ISO 6358-1 (2013); Sanville (1971), A new method of specifying the flow capacity of pneumatic equipment"
    parameter_class = Valve
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Valve) -> Tensor:
        """As HistoryEffect.carry."""
        states, critical = recording.states, p.critical
        volume = math.pi * states.inner_radius**2 * states.reference_length
        command = (signal[:, 0] + ATMOSPHERE).clamp_min(THINNEST)
        change = recording.change(command)
        step = torch.where(recording.first, 1.0, recording.step)
        # Squared flow that an even ramp needs, as a share of the most that there is, and how far behind the pressure
        # follows it then, as a share of what the command changes by in a part of the step.
        flow = p.squared_resistance * (volume * change / (step * command)) ** 2
        settled = 1 + (1 - flow.clamp_max(1 - EDGE)).sqrt()
        quadratic = (1 - critical) * p.squared_resistance * (volume / step) ** 2
        behind = PARTS * quadratic * change.abs() / (command * settled)
        short = change / PARTS
        mean = command - short * ramped(behind)
        there = p.squared_resistance > 0
        root = torch.where(there, p.squared_resistance, 1.0).sqrt() * volume

        # A lag of its speed, from which no sample has come to its command yet.
        slow = lag(command[:, None], recording, (GUESSED * root)[:, None])
        known = mean, short, step / (PARTS * root), critical
        reached = followed(_after, known, recording.first, command, command - slow[:, 0])
        return torch.where(there, reached - ATMOSPHERE, signal[:, 0] + (mean - command))[:, None]


def ramped(behind: Tensor) -> Tensor:
    """How far from its end a command's even change counts, as a share of it, (N,): of half a change where the pressure
    follows slowly, and as far as it is behind in the end where it is quick.

    behind: how far the pressure is behind in the end, as a share of a step's change, (N,). With so little missing as
    that, d, the flow is as √d, and what is missing of a command that stays is gone as a square is: exact for that."""
    slow = 0.5 - 1 / (16 * behind.clamp_min(QUICK))
    return torch.where(behind > QUICK, slow, behind)


def _after(before: Tensor, mean: Tensor, short: Tensor, span: Tensor, critical: Tensor) -> Tensor:
    """Absolute pressure (N,) after PARTS time spans (N,), in units of r V, in the last of which the command has this
    mean, and in each by so much more than in the one before."""
    held = before
    for left in reversed(range(PARTS)):
        held = _reached(held, mean - left * short, span, critical)
    return held


def _reached(before: Tensor, mean: Tensor, span: Tensor, critical: Tensor) -> Tensor:
    """Absolute pressure (N,) after a time span (N,), in units of r V, whose command has this mean."""
    held = before.clamp_min(THINNEST)
    return torch.where(held < mean, filled(held, mean, span, critical), emptied(held, mean, span, critical))


def filled(held: Tensor, source: Tensor, span: Tensor, critical: Tensor) -> Tensor:
    """Absolute pressure (N,) after a time span (N,), in units of r V, from a lower one, at a source's."""
    along = (torch.minimum(held / source, torch.ones_like(held)) - critical) / (1 - critical)
    phase = torch.where(along > 0, torch.asin(along.clamp(0.0, 1 - EDGE)), along) + span / (1 - critical)
    after = torch.where(phase > 0, torch.sin(phase.clamp(0.0, math.pi / 2)), phase)
    return source * (critical + (1 - critical) * after)


def emptied(held: Tensor, sink: Tensor, span: Tensor, critical: Tensor) -> Tensor:
    """The same from a higher one, at a sink's: the phase θ, sin θ = (r − b)/(1 − b), r = p₂/p, grows as
    θ' = (b + (1 − b) sin θ)/(1 − b), whose integral has the tangent of θ/2 in it."""
    c, w = 1 - critical, (1 - 2 * critical).sqrt()
    ratio = torch.minimum(sink / held, torch.ones_like(held))
    # Time until the flow is no longer that of sound.
    sonic = torch.where(ratio < critical, (critical / ratio).clamp_min(1.0).log(), torch.zeros_like(held))
    left = (span - sonic).clamp_min(0.0)
    half = torch.tan(torch.asin(((ratio - critical) / c).clamp(0.0, 1 - EDGE)) / 2)
    quotient = (critical * half + c - w) / (critical * half + c + w) * torch.exp((w * left / c).clamp_max(100.0))
    quotient = torch.minimum(quotient, (critical + c - w) / (critical + c + w))
    tangent = ((w * (1 + quotient) / (1 - quotient) - c) / critical).clamp(0.0, 1.0)
    after = critical + c * 2 * tangent / (1 + tangent**2)
    return torch.where(span < sonic, held * torch.exp(-torch.minimum(span, sonic)), sink / after)
