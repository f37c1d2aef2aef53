"""Where in the chain an unknown function may enter, what it may depend on, and what it changes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

from torch import Tensor

from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.data.states import States

# What an effect that nobody wrote may depend on.


@dataclass(frozen=True)
class Input:
    """A quantity of a row. code: how an effect reads it from its `states` and `loads`; unit: SI; shown, factor: the
    unit of tables, and from that to SI; symbol: in formulas."""

    name: str
    symbol: str
    code: str
    unit: str
    shown: str
    factor: float

    @property
    def of_loads(self) -> bool:
        """Whether it is one of the loads, and not of the state."""
        return self.code.startswith("loads")

    def read(self, states: States, loads: Tensor) -> Tensor:
        """Its values at N states that carry loads (N, 2): (N,) SI."""
        read = READ[self.name]
        return read(states, loads)


ELONGATION = Input("elongation", "Δl", "states.length - states.reference_length", "m", "mm", MM)
TWIST = Input("twist", "φ", "states.twist", "rad", "°", DEG)
PRESSURE = Input("pressure", "P", "states.pressure", "Pa", "kPa", KPA)
FORCE = Input("force", "F", "loads[..., 0]", "N", "N", 1.0)
MOMENT = Input("moment", "M", "loads[..., 1]", "N·m", "N·mm", NMM)
TIME = Input("time", "t", "states.clock", "s", "s", 1.0)
SEVERITY = Input("severity", "S", "states.severity", "1", "", 1.0)
# Invariants of the strain, from where they are at rest.
I1 = Input("i1", "I₁ − 3", "invariants[0] - 3", "1", "", 1.0)
I2 = Input("i2", "I₂ − 3", "invariants[0] - 3", "1", "", 1.0)
I4 = Input("i4", "I₄ − 1", "invariants[0] - 1", "1", "", 1.0)

READ: dict[str, Callable[[States, Tensor], Tensor]] = {
    "elongation": lambda states, loads: states.length - states.reference_length,
    "twist": lambda states, loads: states.twist,
    "pressure": lambda states, loads: states.pressure,
    "force": lambda states, loads: loads[..., 0],
    "moment": lambda states, loads: loads[..., 1],
    "time": lambda states, loads: states.clock,
    "severity": lambda states, loads: states.severity,
}


def round_scale(values: Tensor) -> float:
    """A number of one digit about as large as the largest of the values (…): what they are told in.

    >>> import torch
    >>> round_scale(torch.tensor([-0.0043, 0.0041]))
    0.004
    """
    largest = float(values.abs().max())
    return float(f"{largest:.0e}") if largest > 0 else 1.0


# Where in the chain an unknown function may enter: the base class, its method, and what the function changes.

STATE, LOADS = (ELONGATION, TWIST, PRESSURE), (FORCE, MOMENT)


@dataclass(frozen=True)
class Place:
    """port: of effect.PORTS, or "parallel" for an element beside the actuator; where: what of it. base: class of
    ports; unit, shown and factor: of the function, SI and in tables; changes: what it does to it, for readers;
    symbol: of what it changes. inputs: what it may depend on. body: the method's last lines, with {value} for the
    function."""

    port: str
    where: str
    base: str
    unit: str
    shown: str
    factor: float
    symbol: str
    changes: str
    inputs: tuple[Input, ...]
    body: str
    # Which of the inputs no proposal has alone: another place has them.
    alone: tuple[Input, ...] = ()

    @property
    def name(self) -> str:
        """Of port and where."""
        return f"{self.port} {self.where}"

    @property
    def short(self) -> str:
        """As effects are named by."""
        before = {"energy": "energy_", "parallel": "parallel_", "dissipation": "friction_"}.get(self.port, "")
        return (
            "wall" if self.where == "wall" else f"{before}{self.where}{'_cell' if self.port == 'measurement' else ''}"
        )

    @property
    def rubs(self) -> bool:
        """Whether the function works against the direction of the pressure change."""
        return self.port == "dissipation" and self.where != "wall"

    @property
    def potential(self) -> bool:
        """Whether the function is a potential, of which the loads are derivatives."""
        return self.where == "both"

    @property
    def energy(self) -> bool:
        """Whether the function is a strain energy."""
        return self.port == "energy"


def _boundary(where: str, unit: str, shown: str, factor: float, symbol: str, changes: str) -> Place:
    body = f"return states.replace({where}=states.{where} + {{value}})"
    # A mount gives way in length and twist alone.
    inputs = (*STATE, TIME) if where == "pressure" else (*STATE, *LOADS, TIME)
    return Place("boundary", where, "BoundaryEffect", unit, shown, factor, symbol, changes, inputs, body)


def _geometry(where: str, unit: str, shown: str, factor: float, symbol: str, changes: str, body: str = "") -> Place:
    body = body or f"return states.replace({where}=states.{where} + {{value}})"
    return Place("geometry", where, "GeometryEffect", unit, shown, factor, symbol, changes, (*STATE, TIME), body)


def _loads(where: str, value: str) -> str:
    pair = f"{value}, torch.zeros_like(states.length)" if where in ("force", "axial") else (
        f"torch.zeros_like(states.length), {value}"
    )  # fmt: skip
    return f"return loads + columns({pair})"


def _along(port: str, where: str, base: str, changes: str, inputs: tuple[Input, ...], value: str = "{value}") -> Place:
    axial = where in ("force", "axial")
    unit, shown, factor, symbol = ("N", "N", 1.0, "F") if axial else ("N·m", "N·mm", 1e-3, "M")
    return Place(port, where, base, unit, shown, factor, symbol, changes, inputs, _loads(where, value))


MM_M, DEG_RAD = 1e-3, 0.017453292519943295
RUBBED = "-states.direction * ({value})"
POTENTIAL = """
        def potential(length: Tensor, twist: Tensor) -> Tensor:
            {value}
            return value.sum()

        by_length, by_twist = torch.func.grad(potential, argnums=(0, 1))(states.length, states.twist)
        return loads - columns(by_length, by_twist)"""
PLACES: tuple[Place, ...] = (
    _boundary("length", "m", "mm", MM_M, "l", "length really imposed"),
    _boundary("twist", "rad", "°", DEG_RAD, "φ", "twist really imposed"),
    _boundary("pressure", "Pa", "kPa", 1e3, "P", "pressure really inside"),
    _geometry("fiber_angle", "rad", "°", DEG_RAD, "Γ", "fiber angle"),
    _geometry("outer_radius", "m", "mm", MM_M, "R_o", "outer radius of the wall"),
    _geometry("reference_length", "m", "mm", MM_M, "L", "length at rest"),
    _geometry(
        "active_length",
        "m",
        "mm",
        MM_M,
        "L, l",
        "length that takes part",
        "return states.replace(reference_length=states.reference_length + {value}, length=states.length + {value})",
    ),
    *(
        Place(
            "energy", name, "EnergyEffect", "Pa", "kPa", 1e3, "Ψ", "strain energy of the wall", (i,), "return {value}"
        )
        for name, i in (("i1", I1), ("i2", I2), ("i4", I4))
    ),
    _along("parallel", "axial", "EndEffect", "force of an element beside the actuator", (ELONGATION, PRESSURE)),
    _along("parallel", "torsional", "EndEffect", "moment of an element beside the actuator", (TWIST, PRESSURE)),
    Place(
        "parallel",
        "both",
        "EndEffect",
        "J",
        "mJ",
        1e-3,
        "V",
        "potential of an element beside the actuator",
        (ELONGATION, TWIST),
        POTENTIAL,
        alone=(ELONGATION, TWIST),
    ),
    _along("dissipation", "force", "DissipationEffect", "force lost", (*STATE, *LOADS), RUBBED),
    _along("dissipation", "moment", "DissipationEffect", "moment lost", (*STATE, *LOADS), RUBBED),
    Place(
        "dissipation",
        "wall",
        "WallEffect",
        "1",
        "",
        1.0,
        "s",
        "share of the wall's stresses",
        (TIME, SEVERITY),
        "return (1 + {value}).clamp_min(0.05)",
    ),
    _along("measurement", "force", "MeasurementEffect", "force shown", (*STATE, *LOADS, TIME)),
    _along("measurement", "moment", "MeasurementEffect", "moment shown", (*STATE, *LOADS, TIME)),
)


def same_as(place: Place, inputs: Collection[Input]) -> str:
    """The other place at which a function of these inputs changes the loads alike, where there is one: "" otherwise.

    What a load cell shows too much in dependence of the elongation, an element beside the actuator may carry."""
    return next((f"{b.port} {b.where}" for a, b in _alike(inputs) if a is place), "")


def told_elsewhere(place: Place, inputs: Collection[Input]) -> bool:
    """Whether an element beside the actuator stands for it too."""
    return place.port == "measurement" and any(b is place for _, b in _alike(inputs))


def _alike(inputs: Collection[Input]) -> list[tuple[Place, Place]]:
    """Elements beside the actuator that may depend on these inputs, and the load cell that would show the same."""
    by = {(p.port, p.where): p for p in PLACES}
    pairs = (("axial", "force"), ("torsional", "moment"))
    alike = [(by["parallel", element], by["measurement", load]) for element, load in pairs]
    return [(element, load) for element, load in alike if set(inputs) <= set(element.inputs)]
