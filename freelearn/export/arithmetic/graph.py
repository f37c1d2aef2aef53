"""Straight-line arithmetic in float64: what every exported function is made of, whatever it is written as.

A number is a node; a node is an operation on earlier nodes. There are no branches (`where` picks), and loops run a
fixed number of times, so that the work of a call never depends on what it is called with.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

# Operations that are not arithmetic: a constant, an input, what a loop carries, and what it ends with.
CONSTANT, INPUT, CARRIED, ENDED = "constant", "input", "carried", "ended"
# None of these is computed when its turn comes.
NOT_COMPUTED = (CONSTANT, INPUT, CARRIED, ENDED)


def _divided(a: float, b: float) -> float:
    if b == 0:
        return math.nan if a == 0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1.0, b)
    return a / b


def _power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        return math.inf
    except ValueError:
        return math.inf if a == 0 else math.nan


def _exponential(a: float) -> float:
    return math.exp(a) if a < 709.0 else math.inf


def _smaller(a: float, b: float) -> float:
    return a if math.isnan(a) or a < b else b


def _larger(a: float, b: float) -> float:
    return a if math.isnan(a) or a > b else b


def _sign(a: float) -> float:
    return float((a > 0) - (a < 0))


# What each operation gives, in Python's own float64.
ARITHMETIC: dict[str, Callable[..., float]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _divided,
    "min": _smaller,
    "max": _larger,
    "pow": _power,
    "hypot": math.hypot,
    "neg": lambda a: -a,
    "abs": abs,
    "sign": _sign,
    "sqrt": lambda a: math.sqrt(a) if a >= 0 else math.nan,
    "exp": _exponential,
    "expm1": lambda a: math.expm1(a) if a < 709.0 else math.inf,
    "log": lambda a: math.log(a) if a > 0 else (-math.inf if a == 0 else math.nan),
    "log1p": lambda a: math.log1p(a) if a > -1 else math.nan,
    "tanh": math.tanh,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "where": lambda c, a, b: a if c else b,
}
# Operations that give a truth.
TRUTHS: dict[str, Callable[..., bool]] = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "and": lambda a, b: bool(a) and bool(b),
    "or": lambda a, b: bool(a) or bool(b),
    "not": lambda a: not a,
    "finite": math.isfinite,
    "isnan": math.isnan,
}
EVERY: dict[str, Callable[..., float]] = {**ARITHMETIC, **TRUTHS}


@dataclass(frozen=True)
class Node:
    """operation: by name. of: numbers of the nodes it works on; for CARRIED and ENDED the loop and the place in it, for
    INPUT the place among the inputs. value: of a constant. truth: whether it is true or false rather than a number."""

    operation: str
    of: tuple[int, ...]
    value: float = 0.0
    truth: bool = False


@dataclass
class Loop:
    """times: how often it runs. starts, nexts: nodes that its carried numbers begin with and become, by place. inside:
    loops, outermost first, that it lies in."""

    times: int
    starts: tuple[int, ...]
    nexts: tuple[int, ...] = ()
    inside: frozenset[int] = frozenset()


@dataclass
class Graph:
    """nodes: each made after those it works on. within: loops in whose every turn a node is computed anew."""

    nodes: list[Node] = field(default_factory=list)
    within: list[frozenset[int]] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)
    _known: dict[tuple[object, ...], int] = field(default_factory=dict)

    def constant(self, value: float | bool) -> int:
        """A number that is always the same."""
        truth = isinstance(value, bool)
        number = float(value)
        # Zeros of either sign are different numbers, and no NaN equals another.
        return self._node(Node(CONSTANT, (), number, truth), (CONSTANT, number.hex(), truth))

    def input(self, place: int) -> int:
        """The input at a place."""
        return self._node(Node(INPUT, (place,)), (INPUT, place))

    def apply(self, operation: str, *of: int) -> int:
        """An operation on nodes: computed now where all are constants, and once where it is asked for twice."""
        nodes = [self.nodes[i] for i in of]
        if operation == "mul" and all(n.truth for n in nodes):
            # As torch tells a finite number: (x == x) * (|x| != inf).
            operation = "and"
        if all(n.operation == CONSTANT for n in nodes):
            value = EVERY[operation](*(n.value for n in nodes))
            return self.constant(bool(value) if self._truth(operation, of) else float(value))
        if (plain := self._plain(operation, of)) is not None:
            return plain
        if operation in ("add", "mul", "and", "or") and of[0] > of[1]:
            of = (of[1], of[0])
        return self._node(Node(operation, tuple(of), truth=self._truth(operation, of)), (operation, *of))

    def _truth(self, operation: str, of: Sequence[int]) -> bool:
        """Whether the operation gives a truth."""
        return operation in TRUTHS or (operation == "where" and all(self.nodes[i].truth for i in of[1:]))

    def _plain(self, operation: str, of: Sequence[int]) -> int | None:
        """What a sum with zero, a product with one or zero, a choice that is settled come to."""
        value = [self.nodes[i].value if self.nodes[i].operation == CONSTANT else None for i in of]
        match operation:
            case "add":
                return of[1] if value[0] == 0 else of[0] if value[1] == 0 else None
            case "sub":
                return of[0] if value[1] == 0 else self.apply("neg", of[1]) if value[0] == 0 else None
            case "mul":
                if 0 in value:
                    return self.constant(0.0)
                return of[1] if value[0] == 1 else of[0] if value[1] == 1 else None
            case "div":
                return of[0] if value[1] == 1 else self.constant(0.0) if value[0] == 0 else None
            case "pow":
                if value[1] in (1, 2, 0.5):
                    one = of[0]
                    return one if value[1] == 1 else self._square_or_root(one, value[1])
            case "and":
                if 0 in value:
                    return self.constant(False)
                return of[1] if value[0] == 1 else of[0] if value[1] == 1 else None
            case "or":
                if 1 in value:
                    return self.constant(True)
                return of[1] if value[0] == 0 else of[0] if value[1] == 0 else None
            case "where":
                if value[0] is not None:
                    return of[1] if value[0] else of[2]
                return of[1] if of[1] == of[2] else None
            case "neg":
                inner = self.nodes[of[0]]
                return inner.of[0] if inner.operation == "neg" else None
        return None

    def _square_or_root(self, one: int, power: float | None) -> int:
        return self.apply("mul", one, one) if power == 2 else self.apply("sqrt", one)

    def begin(self, starts: Sequence[int]) -> list[int]:
        """Opens a loop: nodes of what it carries, in the order of what it begins with."""
        number = len(self.loops)
        self.loops.append(Loop(0, tuple(starts)))
        carried = [Node(CARRIED, (number, i), truth=self.nodes[s].truth) for i, s in enumerate(starts)]
        return [self._node(node, (CARRIED, *node.of)) for node in carried]

    def end(self, carried: Sequence[int], nexts: Sequence[int], times: int) -> list[int]:
        """Closes the loop that carries these: nodes of what it ends with after so many turns."""
        number = self.nodes[carried[0]].of[0]
        loop = self.loops[number]
        loop.times, loop.nexts = times, tuple(nexts)
        around = frozenset().union(*(self.within[i] for i in (*loop.starts, *loop.nexts)))
        loop.inside = around - {number}
        number = self._same(number)
        ended = [Node(ENDED, (number, i), truth=self.nodes[n].truth) for i, n in enumerate(nexts)]
        return [self._node(node, (ENDED, *node.of)) for node in ended]

    def _same(self, number: int) -> int:
        """An earlier loop that does the same, or the loop itself: derivatives record once more what values did."""
        loop = self.loops[number]
        for other, earlier in enumerate(self.loops[:number]):
            if (earlier.starts, earlier.times, len(earlier.nexts)) == (loop.starts, loop.times, len(loop.nexts)):
                copies = {i: i for i in range(len(self.nodes)) if number not in self.within[i]}
                for i in sorted(self.needed(loop.nexts) - copies.keys()):
                    node = self.nodes[i]
                    if node.operation == ENDED:
                        break
                    carried = node.operation == CARRIED
                    copies[i] = (
                        self._known[CARRIED, other, node.of[1]]
                        if carried
                        else self.apply(node.operation, *(copies[j] for j in node.of))
                    )
                else:
                    if tuple(copies[i] for i in loop.nexts) == earlier.nexts:
                        return other
        return number

    def _node(self, node: Node, key: tuple[object, ...]) -> int:
        if key in self._known:
            return self._known[key]
        if node.operation == CARRIED:
            within = frozenset({node.of[0]})
        elif node.operation == ENDED:
            within = self.loops[node.of[0]].inside
        elif node.operation in (CONSTANT, INPUT):
            within = frozenset()
        else:
            within = frozenset().union(*(self.within[i] for i in node.of))
        self.nodes.append(node)
        self.within.append(within)
        self._known[key] = len(self.nodes) - 1
        return len(self.nodes) - 1

    def needed(self, outputs: Iterable[int]) -> set[int]:
        """Nodes that these outputs need, themselves included."""
        left, needed = list(outputs), set[int]()
        while left:
            i = left.pop()
            if i in needed:
                continue
            needed.add(i)
            node = self.nodes[i]
            if node.operation in (CARRIED, ENDED):
                number, place = node.of
                loop = self.loops[number]
                left += [loop.starts[place], *loop.nexts[place : place + 1]]
            elif node.operation not in (CONSTANT, INPUT):
                left += node.of
        return needed

    def carried(self, number: int, needed: set[int]) -> list[int]:
        """Places of what a loop carries that are needed."""
        keys = [(kind, number, i) for i in range(len(self.loops[number].starts)) for kind in (CARRIED, ENDED)]
        return sorted({key[2] for key in keys if self._known.get(key) in needed})

    def inputs(self, outputs: Iterable[int]) -> list[int]:
        """Places of the inputs that these outputs depend on, in order."""
        return sorted(self.nodes[i].of[0] for i in self.needed(outputs) if self.nodes[i].operation == INPUT)

    def innermost(self, i: int) -> int | None:
        """The loop in whose turn a node is computed; None outside of all."""
        around = self.within[i]
        return max(around, key=self._depth) if around else None

    def _depth(self, number: int) -> int:
        return 1 + max((self._depth(other) for other in self.loops[number].inside), default=0)
