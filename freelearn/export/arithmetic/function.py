"""A function that is exported: its inputs and outputs by name, and the arithmetic between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from freelearn.export.arithmetic.graph import INPUT, NOT_COMPUTED, Graph, Node


@dataclass(frozen=True)
class Port:
    """One number in or out. name: as in code. unit: SI. about: what it is, in words."""

    name: str
    unit: str
    about: str


@dataclass(frozen=True)
class Function:
    """name: loads, stiffness, … about: in words. nodes: of the outputs, in their order. carried: how many of the last
    inputs are a state, zero at first, and of the last outputs what it becomes: handed on from call to call."""

    name: str
    about: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    graph: Graph
    nodes: tuple[int, ...]
    carried: int = 0

    @property
    def state(self) -> tuple[Port, ...]:
        """What is handed on from call to call."""
        return self.inputs[len(self.inputs) - self.carried :]

    @property
    def given(self) -> tuple[Port, ...]:
        """What is given in each call."""
        return self.inputs[: len(self.inputs) - self.carried]

    @property
    def answered(self) -> tuple[Port, ...]:
        """What each call answers."""
        return self.outputs[: len(self.outputs) - self.carried]

    def part(self, name: str, about: str, outputs: Sequence[str]) -> Function:
        """Some of the outputs alone, by name; the inputs stay."""
        place = {port.name: i for i, port in enumerate(self.outputs)}
        picked = [place[o] for o in outputs]
        return replace(
            self,
            name=name,
            about=about,
            outputs=tuple(self.outputs[i] for i in picked),
            nodes=tuple(self.nodes[i] for i in picked),
        )

    @property
    def operations(self) -> int:
        """Numbers computed in one call, loops counted with all of their turns."""
        needed = self.graph.needed(self.nodes)
        return sum(self._turns(i) for i in needed if self.graph.nodes[i].operation not in NOT_COMPUTED)

    def _turns(self, i: int) -> int:
        total, left, seen = 1, set(self.graph.within[i]), set[int]()
        while left:
            loop = left.pop()
            seen.add(loop)
            total *= self.graph.loops[loop].times
            left |= self.graph.loops[loop].inside - seen
        return total


def pruned(graph: Graph, nodes: Sequence[Sequence[int]], inputs: Sequence[Port], kept: int) -> tuple[Port, ...]:
    """The inputs that matter, the first `kept` in any case: the graph's own are numbered anew."""
    used = {i for some in nodes for i in graph.inputs(some)} | set(range(kept))
    place = {old: new for new, old in enumerate(sorted(used))}
    for i, node in enumerate(graph.nodes):
        if node.operation == INPUT:
            graph.nodes[i] = Node(INPUT, (place.get(node.of[0], -1),))
    return tuple(inputs[i] for i in sorted(used))
