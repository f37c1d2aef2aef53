"""What the last evaluation of the same rows ended with, for the next one to begin from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known

T = TypeVar("T")


class Near:
    """Equilibria at which the last evaluation of some rows ended, by name, and what is made of their states alone.

    Equilibria are kept only inside `keeping`, which a fit opens where it takes derivatives, at the points that it
    accepts: so a trial step and the derivatives taken there begin from one place, and follow one branch. What depends
    on no parameter is made once.

    What is held stays: instead of an equilibrium that is searched for, one step from there is taken, whatever was
    evaluated before.

    doubled: inside `keeping`, the number of the rows where these are the same ones twice, under the same parameters,
    first all and then all again; 0 where they are not.
    """

    def __init__(self, held: Mapping[str, Tensor] | None = None) -> None:
        """held: by name, (N, …) each."""
        self.held = dict(held or {})
        self._last: dict[str, Tensor] = {}
        self._fixed: dict[int, Tensor] = {}
        self._made: dict[str, Any] = {}
        self._keeps = False
        self.doubled = 0

    def __reduce__(self) -> tuple[Callable[..., Near], tuple[dict[str, Tensor], dict[str, Tensor]]]:
        return Near.at, (self._last, self.held)

    @classmethod
    def at(cls, last: dict[str, Tensor], held: Mapping[str, Tensor] | None = None) -> Near:
        """One that begins where another has ended, by the names of what that kept. held: what it holds."""
        near = cls(held)
        near._last = last
        return near

    @property
    def moved(self) -> bool:
        """Whether an equilibrium has been kept: the next evaluation then depends on those before it."""
        return bool(self._last)

    def copy(self, times: int = 1) -> Near:
        """Another that begins where this one has ended, for the same rows, or for all of them so many times."""
        other = Near(_repeated(self.held, times))
        other._last = _repeated(self._last, times)
        return other

    def released(self) -> Near:
        """Another for the same rows that searches, and begins where this one has ended, or at what it holds."""
        return Near.at({**self.copy()._last, **self.held})

    def along(self) -> Near:
        """Another for the way to one equilibrium: it begins where this one has ended, and keeps each step's."""
        other = self.copy()
        other._fixed, other._made, other._keeps, other.doubled = self._fixed, self._made, True, self.doubled
        return other

    def arrive(self, way: Near | None) -> None:
        """Where equilibria are kept, those at the end of such a way."""
        if self._keeps and way is not None:
            self._last |= way._last

    def follow(self, other: Near, times: int) -> None:
        """Begins where another one has ended, whose rows are here so many times."""
        self._last = other.copy(times)._last

    def lead(self, other: Near, count: int) -> None:
        """Begins where the first `count` rows of another one have ended."""
        self._last = {name: last[:count] for name, last in other._last.items()}

    @contextmanager
    def keeping(self, doubled: int = 0) -> Iterator[None]:
        """Equilibria found inside are kept. doubled: see the class."""
        self._keeps, self.doubled = True, doubled
        try:
            yield
        finally:
            self._keeps, self.doubled = False, 0

    def last(self, name: str, like: Tensor) -> Tensor | None:
        """What was kept by a name, if it is of the shape of `like`."""
        kept = self._last.get(name)
        return kept if kept is not None and kept.shape == like.shape else None

    def start(self, name: str, otherwise: Tensor) -> Tensor:
        """Where to begin, (N, …): at what was kept of the rows that have it."""
        kept = self.last(name, otherwise)
        return otherwise if kept is None else torch.where(kept.isfinite(), kept, otherwise)

    def keep(self, name: str, value: Tensor, settled: Tensor) -> None:
        """Keeps the values (N, …) of the rows that settled, (N,) bool."""
        # Inside vmap a value is that of several members.
        if self._keeps and all_if_known(settled) is not None:
            there = settled.reshape(-1, *[1] * (value.ndim - 1))
            self._last[name] = torch.where(there, value.detach(), torch.nan)

    def fix(self, tensors: Iterable[Tensor]) -> None:
        """These are the same in every evaluation."""
        self._fixed |= {id(t): t for t in tensors}

    def once(self, name: str, made_of: Iterable[Tensor | None], make: Callable[[], T]) -> T:
        """What `make` returns, made once if all that it is made of is the same in every evaluation."""
        if not all(t is None or id(t) in self._fixed for t in made_of):
            return make()
        if name not in self._made:
            self._made[name] = make()
        made: T = self._made[name]
        return made


def _repeated(tensors: Mapping[str, Tensor], times: int) -> dict[str, Tensor]:
    return {name: each.repeat(times, *[1] * (each.ndim - 1)) for name, each in tensors.items()}
