"""A graph on its way into a language: statement by statement, each loop where its results are first asked for."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Generic, TypeVar

from freelearn.export.arithmetic.graph import CARRIED, CONSTANT, ENDED, INPUT, NOT_COMPUTED, Graph

Statement = TypeVar("Statement")


def literal(value: float) -> str:
    """A number as C and Python write it alike, where NAN and INFINITY are known.

    >>> literal(0.5), literal(-2.0), literal(-math.inf)
    ('0.5', '(-2.0)', '(-INFINITY)')
    """
    if math.isnan(value):
        return "NAN"
    text = repr(value) if math.isfinite(value) else "INFINITY" if value > 0 else "-INFINITY"
    return f"({text})" if text.startswith("-") else text


class Writing(ABC, Generic[Statement]):
    """What a language adds: how it writes a constant, an operation and a loop.

    outputs: nodes that are asked for. inputs: what the inputs are called, by place. ended: before the number of what a
    loop carries once it has ended."""

    ended = "c"

    def __init__(self, graph: Graph, outputs: Sequence[int], inputs: Sequence[str]) -> None:
        self.graph, self.needed, self.inputs = graph, graph.needed(outputs), inputs
        self._by_loop: dict[int | None, list[int]] = {}
        for i in sorted(self.needed):
            self._by_loop.setdefault(graph.innermost(i), []).append(i)

    def lines(self, loop: int | None = None, depth: int = 1) -> list[Statement]:
        """What is computed in one turn of a loop, or outside of all, in an order that serves."""
        out, opened = list[Statement](), set[int]()
        for i in self._by_loop.get(loop, []):
            node = self.graph.nodes[i]
            if node.operation == ENDED and node.of[0] not in opened:
                opened.add(node.of[0])
                out += self.loop(node.of[0], depth)
            elif node.operation not in NOT_COMPUTED:
                out += self.operation(i, depth)
        return out

    def at(self, i: int) -> str:
        """The name of a node, or the number that it is."""
        node = self.graph.nodes[i]
        if node.operation == CONSTANT:
            return self.constant(node.value, node.truth)
        if node.operation == INPUT:
            return self.inputs[node.of[0]]
        if node.operation in (CARRIED, ENDED):
            return f"{'c' if node.operation == CARRIED else self.ended}{node.of[0]}_{node.of[1]}"
        return f"v{i}"

    @abstractmethod
    def constant(self, value: float, truth: bool) -> str:
        """A number, or true or false."""

    @abstractmethod
    def operation(self, i: int, depth: int) -> list[Statement]:
        """What computes a node."""

    @abstractmethod
    def loop(self, number: int, depth: int) -> list[Statement]:
        """A whole loop, its turns inside."""
