"""States: what the bed imposed on which actuator, as SI tensors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, DEG, KINEMATIC, KPA, MM, NMM, Bed, bed_of
from freelearn.data.columns import DESIGN, RISEN, SECOND, design_column, members_in, pressure_column
from freelearn.data.flicker import settled, stood
from freelearn.data.logs import is_log, run_numbers, session_clock
from freelearn.data.recordings import Recording, stopped
from freelearn.data.warm_start import Near

# Time from one row to the next where the table has no time_s: the paper averages 20 readings at 1 Hz.
SECONDS_PER_ROW = 20.0
# Shear modulus of the wall [Pa] and C2 / C1, by which severities weigh pressure and fibers against stretch and twist.
# Nominal: their orders of magnitude are enough (of Ogden and Roxburgh's softening, severities of a third or of three
# times these fibers leave 2 % unexplained, these 1 %; without fibers it would be 30 %).
SHEAR_MODULUS, STIFFER = 1e6, 30.0
# Share of the range of pressures below which they have not changed their direction: readings flicker.
NOISE_BAND = 0.01
# Share of a length at rest that counts as a large elongation.
LENGTH_SHARE = 0.05
# Share of the largest pressure above which an actuator was filled.
AT_REST = 0.02
# Squares of hoop stretches that are looked at; beyond, a tube has burst.
LEAST_HOOP, MOST_HOOP, HOOP_ITERATIONS = 0.05, 9.0, 40

# Rows that severities are computed of at once: all of most tables.
BLOCK = 1_000_000

# What a row remembers of those before it.
MEMORY = ("clock", "dwell", "moved_length", "moved_twist", "severity", "past_severity")


class Memory:
    """What N rows remember, made when somebody first asks: few effects do, and it takes more than all else together."""

    def __init__(self, make: Callable[[], Mapping[str, Tensor]]) -> None:
        """make: every quantity of MEMORY by name, each (N,)."""
        self._make = make
        self._made: Mapping[str, Tensor] | None = None

    def __getitem__(self, name: str) -> Tensor:
        if self._made is None:
            self._made = self._make()
        return self._made[name]

    def changed(self, change: Callable[[Tensor], Tensor]) -> Memory:
        """The same with every tensor changed, once it is asked for."""
        return Memory(lambda: {name: change(self[name]) for name in MEMORY})


def _none() -> Any:
    return None


@dataclass(frozen=True)
class States:
    """N configurations of actuators: design, kinematic state and pressure. All tensors are (N,), float64.

    fiber_angle Γ [rad], reference_length L [m], inner_radius R_i [m], outer_radius R_o [m]: the unloaded design.
    second_angle Γ₂ [rad] and second_share, 1 in rows whose actuator has a second family of fibers and 0 in others: None
    where no row has one.
    length l [m], twist φ [rad], pressure P [Pa gauge]: the imposed state q = (l, φ) and the fluid's pressure.
    force F [N], moment M [N·m]: imposed under a dead load, where length and twist are what a search begins from.
    bed: what is imposed and what is measured. members: the same rows for each of several actuators in parallel on one
    end block, whose own pressure is then the members' mean. near: where a search for an equilibrium may begin.
    sample: the actuator's number (int64). direction: +1 where the pressure rose to reach the row, −1 where it
    fell, 0 for the first step of a kinematic state.

    What a row remembers, so that effects with a memory need nothing but the row itself: clock [s] since the sample's
    first row (of a log see logs.session_clock); dwell [s] since the first row of the kinematic state; moved_length [m]
    and moved_twist [rad], by which the bed had moved from the sample's last kinematic state to this one; severity of
    the row (see `severity`) and past_severity, the largest among the sample's rows so far, itself included. All zero
    unless given. memory: where those come from that are not given.

    recording: of a log, all rows of its recordings as they were measured; place: each row's place in it (int64). None
    of any other table.
    """

    fiber_angle: Tensor
    reference_length: Tensor
    inner_radius: Tensor
    outer_radius: Tensor
    length: Tensor
    twist: Tensor
    pressure: Tensor
    sample: Tensor
    direction: Tensor
    clock: Tensor = field(default_factory=_none)
    dwell: Tensor = field(default_factory=_none)
    moved_length: Tensor = field(default_factory=_none)
    moved_twist: Tensor = field(default_factory=_none)
    severity: Tensor = field(default_factory=_none)
    past_severity: Tensor = field(default_factory=_none)
    force: Tensor = None  # type: ignore[assignment]
    moment: Tensor = None  # type: ignore[assignment]
    second_angle: Tensor | None = None
    second_share: Tensor | None = None
    bed: Bed = KINEMATIC
    members: tuple[States, ...] = ()
    near: Near | None = None
    memory: Memory | None = None
    recording: Recording[States] | None = None
    place: Tensor | None = None

    def __post_init__(self) -> None:
        for name in ("force", "moment"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, _zeros(self.length))
        for name in MEMORY:
            if getattr(self, name) is None:
                # Not there until somebody asks.
                object.__delattr__(self, name)

    def __getattr__(self, name: str) -> Tensor:
        if name not in MEMORY:
            raise AttributeError(name)
        value = _zeros(self.length) if self.memory is None else self.memory[name]
        object.__setattr__(self, name, value)
        return value

    def __len__(self) -> int:
        return self.length.shape[0]

    def __getitem__(self, rows: Tensor | slice) -> States:
        return self._each(lambda tensor: _picked(tensor, rows))

    def replace(self, **changes: Any) -> States:
        """The same states with some fields exchanged: tensors (N,), or others."""
        return States(**vars(self) | changes)

    def on_the_way(self) -> States:
        """The same states for the way to an equilibrium, where each step begins at what was found in the one before;
        as they are where nothing is remembered."""
        return self if self.near is None else self.replace(near=self.near.along())

    @property
    def doubled(self) -> int:
        """Of how many blocks of rows, one of each member side by side, each is the same rows twice; 0 of other rows."""
        rows = 0 if self.near is None else self.near.doubled
        return len(self) // rows if rows and len(self) % rows == 0 else 0

    def some(self, rows: Tensor) -> States:
        """Some rows, on a way of their own: what is remembered is of all."""
        picked = self[rows]
        return picked if picked.near is None else picked.replace(near=Near().along())

    def detach(self) -> States:
        """The same states, cut from every derivative."""
        return self._each(Tensor.detach)

    def to(self, device: torch.device | str) -> States:
        """The same states on a device."""
        moved = self._each(lambda tensor: tensor.to(device))
        return moved if self.recording is None else moved.replace(recording=self.recording.to(device))

    def _each(self, change: Callable[[Tensor], Tensor]) -> States:
        """The same states with every tensor changed."""
        changed = {name: change(value) for name, value in vars(self).items() if isinstance(value, Tensor)}
        members = tuple(member._each(change) for member in self.members)
        memory = None if self.memory is None else self.memory.changed(change)
        return self.replace(members=members, memory=memory, **changed)

    def tensors(self) -> Iterator[tuple[str, Tensor]]:
        """Every tensor by name, the members' too."""
        for f in fields(self):
            if isinstance(value := getattr(self, f.name), Tensor):
                yield f.name, value
        for i, member in enumerate(self.members, start=1):
            yield from ((f"{name}[{i}]", value) for name, value in member.tensors())

    def side_by_side(self) -> States:
        """All rows of the first of k members, then of the next, at the end block's elongation and twist: (k N,)."""
        if self.near is None:
            return self._side_by_side()
        near, fixed = self.near, [tensor for _, tensor in self.tensors()]
        return near.once("side by side", fixed, self._side_by_side).replace(near=near)

    def _side_by_side(self) -> States:
        elongation = self.length - self.reference_length
        each = [m.replace(length=m.reference_length + elongation, twist=self.twist) for m in self.members]
        if any(m.second_angle is not None for m in each):
            none = torch.zeros_like(self.length)
            each = [m if m.second_angle is not None else m.replace(second_angle=none, second_share=none) for m in each]
        joined = {
            f.name: torch.cat([getattr(m, f.name) for m in each])
            for f in fields(self)
            if isinstance(getattr(each[0], f.name), Tensor)
        }
        return each[0].replace(**joined)

    def inputs(self) -> list[Tensor]:
        """What the bed imposes, (N,) each: the two quantities of a kinematic state, and each actuator's pressure."""
        state = [getattr(self, quantity.field) for quantity in self.bed.state]
        return [*state, *([m.pressure for m in self.members] or [self.pressure])]

    def with_inputs(self, inputs: Sequence[Tensor]) -> States:
        """The same states with other inputs, in the order of `inputs`."""
        state = {q.field: value for q, value in zip(self.bed.state, inputs[:2], strict=True)}
        if not self.members:
            return self.replace(pressure=inputs[2], **state)
        members = tuple(m.replace(pressure=p) for m, p in zip(self.members, inputs[2:], strict=True))
        return self.replace(members=members, pressure=torch.stack(list(inputs[2:])).mean(0), **state)

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> States:
        """From a measurement table in engineering units, one row per configuration in the order of measuring.

        The memory (direction and all of MEMORY) is that of all rows given, buckled and left-out ones too.
        """

        def column(name: str, factor: float = 1.0) -> Tensor:
            return torch.as_tensor(table[name].to_numpy(dtype=np.float64) * factor)

        def imposed(name: str, factor: float = 1.0, size: float = 0.0) -> Tensor:
            values = table[name].to_numpy(dtype=np.float64)
            return torch.as_tensor(settled(values, state, name, size) * factor)

        state = kinematic_state(table)
        bed, reference = bed_of(table), column("length_mm", MM)
        longest = LENGTH_SHARE * float(table["length_mm"].max()) if len(table) else 0.0
        resting = _zeros(reference)
        hung = bed is DEAD_LOAD
        second = column(SECOND, DEG) if SECOND in table else None
        some = second is not None and bool(second.isfinite().any())
        states = cls(
            fiber_angle=column("gamma_deg", DEG),
            reference_length=reference,
            inner_radius=column("inner_radius_mm", MM),
            outer_radius=column("outer_radius_mm", MM),
            length=reference + (resting if hung else imposed("elongation_mm", MM, longest)),
            twist=resting if hung else imposed("twist_deg", DEG),
            pressure=column("pressure_kpa", KPA),
            sample=torch.tensor(table["sample"].to_numpy(dtype=np.int64)),
            direction=torch.as_tensor(pressure_direction(table, state)),
            force=imposed("force_n") if hung else resting,
            moment=imposed("moment_nmm", NMM) if hung else resting,
            second_angle=second.nan_to_num(nan=0.0) if some and second is not None else None,
            second_share=second.isfinite().double() if some and second is not None else None,
            bed=bed,
            members=tuple(_member(table, number) for number in members_in(table.columns)),
            memory=Memory(lambda: {name: torch.as_tensor(value) for name, value in _memory(table).items()}),
        )
        if not is_log(table):
            return states
        return states.replace(recording=Recording.from_table(table, states), place=torch.arange(len(table)))


def _zeros(like: Tensor) -> Tensor:
    """As many zeros, in the memory of one."""
    return like.new_zeros(1).expand(like.shape[:1]) if len(like) else torch.zeros_like(like)


def _picked(tensor: Tensor, rows: Tensor | slice) -> Tensor:
    """Some rows of a tensor (N,)."""
    if isinstance(rows, Tensor) and tensor.stride() == (0,):
        # All are one number, which need not be copied.
        return tensor[:1].expand(int(rows.sum()) if rows.dtype is torch.bool else rows.shape)
    return tensor[rows]


def _member(table: pd.DataFrame, number: int) -> States:
    """One member's part of a table: its own design and pressure, its number for a sample."""
    every = members_in(table.columns)
    taken = {
        name: table[design_column(name, number)] for name in (*DESIGN, SECOND) if design_column(name, number) in table
    }
    own = table.drop(columns=[pressure_column(m) for m in every]).assign(
        **taken, pressure_kpa=table[pressure_column(number)]
    )
    return States.from_table(own).replace(sample=torch.full((len(table),), number))


def kinematic_state(table: pd.DataFrame) -> np.ndarray:
    """Number of the kinematic state that each row belongs to: (N,) int64, in order of first appearance.

    A state is one visit of the bed to a length and twist: its rows share sample and twist, but for what an encoder
    flickers by, and `step` counts up in them. A repeat of a state later in the file is a visit, and so a state, of its
    own: it may have a position error of its own (whether it has, a search asks: discovery.fits.visits). The length is
    left out of the comparison where the step keeps counting, because real beds creep while the pressure changes; a new
    count starts a new state.

    Under a dead load a state is one load as hung: rows that share sample, force and moment, as nearly, while `step`
    counts up. Of a log a state is one recording: its rows share what was set when the actuator was mounted for it.
    """
    if is_log(table):
        return run_numbers(table)
    step = table["step"].to_numpy()
    new = np.ones(len(table), dtype=bool)
    counting = step[1:] > step[:-1]
    if bed_of(table) is DEAD_LOAD:
        new[1:] = ~(stood(table, ("sample", "force_n", "moment_nmm")) & counting)
        return np.cumsum(new) - 1
    twist, elongation = table["twist_deg"].to_numpy(), table["elongation_mm"].to_numpy()
    same_place = stood(table, ("sample", "twist_deg"))
    same_length = (twist[1:] == twist[:-1]) & (elongation[1:] == elongation[:-1])
    # Without a usable count (all steps equal) only an unchanged length keeps rows together.
    new[1:] = ~(same_place & (counting | (same_length & (step[1:] == step[:-1]))))
    return np.cumsum(new) - 1


def pressure_direction(table: pd.DataFrame, state: np.ndarray | None = None) -> np.ndarray:
    """Sign of the last pressure change that led to each row, (N,) float64: +1 rising, −1 falling, 0 at a first step.
    state: each row's, where it is known.

    What a gauge flickers by is no change: of several readings at one pressure all were reached as the first. +1 at a
    first step that is marked as risen."""
    state = kinematic_state(table) if state is None else state
    direction = last_direction(table["pressure_kpa"].to_numpy(dtype=np.float64), state)
    if RISEN not in table:
        return direction
    marked: np.ndarray = table[RISEN].to_numpy(np.float64) == 1
    return np.where((direction == 0) & marked, 1.0, direction)


def begun_under_pressure(pressure: np.ndarray, direction: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Rows before the pressure moves in their state, at which it is not that of rest, (N,) bool. state: each row's."""
    moves = np.bincount(state, direction != 0) > 0
    filled = pressure > AT_REST * max(float(pressure.max(initial=0.0)), 1e-300)
    begun: np.ndarray = (direction == 0) & moves[state] & filled
    return begun


def last_direction(pressure: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Direction in which the pressure (N,) of each state, or recording, last went by more than its noise, (N,) float64:
    0 before it has."""
    if not len(pressure):
        return np.zeros(0)
    first = np.r_[True, run[1:] != run[:-1]]
    band = np.where(first, 0.0, noise_band(pressure))
    # How far the pressure is from the middle of what it pushes along, with play: at an end of the play it pushes.
    ahead = stopped(torch.tensor(pressure), torch.as_tensor(-band), torch.as_tensor(band)).numpy()
    pushed = first | (np.abs(ahead) >= band)
    last = np.maximum.accumulate(np.where(pushed, np.arange(len(ahead)), 0))
    direction: np.ndarray = np.sign(ahead[last])
    return direction


def noise_band(pressure: np.ndarray) -> float:
    """How far the pressures (N,) of a table have to go for their direction to change: a hair more than the share of
    their range, so that of readings in whole digits that go just so far no rounding decides."""
    return NOISE_BAND * (1 + 1e-9) * float(np.ptp(pressure))


def severity(table: pd.DataFrame) -> np.ndarray:
    """How hard each row works the wall, dimensionless, (N,) float64: what earlier stretching is measured by.

    The energy that a thin tube of the wall's mean radius R and thickness t stores, over its shear modulus / 2: with the
    hoop stretch √q, the stretch λ, ρ = R φ/L and the paper's energy, S = 1/(λ²q) + (1 + ρ²) q + λ² − 3 + k (I₄ − 1)²,
    I₄ = q (sin Γ + ρ cos Γ)² + λ² cos² Γ. q is the one at which the wall balances the pressure: ∂S/∂q = P R λ/(t C1). A
    second family adds a term like the first's.
    """
    if len(table) <= BLOCK:
        return _severity(table)
    return np.concatenate([_severity(table.iloc[i : i + BLOCK]) for i in range(0, len(table), BLOCK)])


def _severity(table: pd.DataFrame) -> np.ndarray:
    length, inner, outer = (
        table[name].to_numpy(np.float64) * MM for name in ("length_mm", "inner_radius_mm", "outer_radius_mm")
    )
    radius = (inner + outer) / 2
    angle = np.stack([table[name].to_numpy(np.float64) * DEG for name in ("gamma_deg", SECOND) if name in table])
    fibers, angle = STIFFER * np.isfinite(angle), np.nan_to_num(angle)
    axial = (1 + _shown(table, "elongation_mm") * MM / length) ** 2
    shear = radius * _shown(table, "twist_deg") * DEG / length
    along, across = axial * np.cos(angle) ** 2, (np.sin(angle) + shear * np.cos(angle)) ** 2
    push = table["pressure_kpa"].to_numpy(np.float64) * KPA * radius * axial**0.5 / (outer - inner) / SHEAR_MODULUS
    hoop = np.full(len(table), LEAST_HOOP)
    for _ in range(HOOP_ITERATIONS):
        # Rising and concave from the left of its zero: Newton's method never passes it.
        held = (fibers * across * (hoop * across + along - 1)).sum(0)
        slope = -1 / (axial * hoop**2) + 1 + shear**2 + 2 * held - push
        steeper = 2 / (axial * hoop**3) + 2 * (fibers * across**2).sum(0)
        hoop = (hoop - slope / steeper).clip(LEAST_HOOP, MOST_HOOP)
    stored = (fibers * (hoop * across + along - 1) ** 2).sum(0)
    values: np.ndarray = 1 / (axial * hoop) + (1 + shear**2) * hoop + axial - 3 + stored
    return values


def _shown(table: pd.DataFrame, name: str) -> np.ndarray:
    """A column that a dead load's table may lack or leave blank: zero there."""
    if name not in table:
        return np.zeros(len(table))
    values: np.ndarray = np.nan_to_num(table[name].to_numpy(np.float64))
    return values


def _memory(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Every quantity of MEMORY, by name, each (N,) float64."""
    sample, first, order = table["sample"].to_numpy(), _first(kinematic_state(table)), np.arange(len(table))
    now = severity(table)
    # By sample: the number of each row, the largest severity so far, and the row before.
    count, past, before = np.empty(len(table)), np.empty(len(table)), order.copy()
    for number in np.unique(sample):
        rows = np.flatnonzero(sample == number)
        count[rows], past[rows] = np.arange(len(rows)), np.maximum.accumulate(now[rows])
        before[rows[1:]] = rows[:-1]
    if "time_s" in table:
        time = table["time_s"].to_numpy(np.float64)
        clock = session_clock(table) if is_log(table) else time - time[_first(sample)]
        dwell = time - time[first]
    else:
        clock, dwell = SECONDS_PER_ROW * count, SECONDS_PER_ROW * (order - first)
    moved = [
        place[first] - place[before[first]]
        for place in (_shown(table, "elongation_mm") * MM, _shown(table, "twist_deg") * DEG)
    ]
    values = (clock, dwell, *moved, now, past)
    return dict(zip(MEMORY, values, strict=True))


def _first(group: np.ndarray) -> np.ndarray:
    """Place of the first row of each row's group, (N,)."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return first[inverse]
