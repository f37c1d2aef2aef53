"""A graph as a function in plain Python: for callbacks where no compiler is."""

from __future__ import annotations

from collections.abc import Sequence

from freelearn.export.arithmetic.function import Function
from freelearn.export.arithmetic.graph import CARRIED, CONSTANT, ENDED, INPUT, Graph

WAYS = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "divided({}, {})", "neg": "-{}", "abs": "abs({})",
    "sqrt": "root({})", "exp": "exponential({})", "expm1": "(exponential({}) - 1.0)", "log": "logarithm({})",
    "log1p": "logarithm(1.0 + {})", "tanh": "math.tanh({})", "sin": "math.sin({})", "cos": "math.cos({})",
    "tan": "math.tan({})", "pow": "power({}, {})", "hypot": "math.hypot({}, {})", "min": "smaller({}, {})",
    "max": "larger({}, {})", "sign": "sign_of({})", "lt": "{} < {}", "le": "{} <= {}", "gt": "{} > {}",
    "ge": "{} >= {}", "eq": "{} == {}", "ne": "{} != {}", "and": "{} and {}", "or": "{} or {}", "not": "not {}",
    "finite": "math.isfinite({})", "isnan": "math.isnan({})",
}  # fmt: skip

HELPERS = """\
NAN, INFINITY = math.nan, math.inf


def divided(a, b):
    if b == 0.0:
        return NAN if a == 0.0 or a != a else math.copysign(INFINITY, a) * math.copysign(1.0, b)
    return a / b


def root(a):
    return math.sqrt(a) if a >= 0.0 else NAN


def exponential(a):
    return math.exp(a) if a < 709.0 else INFINITY


def logarithm(a):
    return math.log(a) if a > 0.0 else (-INFINITY if a == 0.0 else NAN)


def power(a, b):
    try:
        return math.pow(a, b)
    except OverflowError:
        return INFINITY
    except ValueError:
        return NAN


def smaller(a, b):
    return a if a != a or a < b else b


def larger(a, b):
    return a if a != a or a > b else b


def sign_of(a):
    return float((a > 0.0) - (a < 0.0))
"""


def python_function(f: Function) -> str:
    """def NAME(inputs by name): a tuple of the outputs."""
    writing = _Writing(f.graph, f.graph.needed(f.nodes), [p.name for p in f.inputs])
    given = ", ".join(p.name for p in f.inputs)
    about = [f"    {p.name} [{p.unit}]: {p.about}" for p in (*f.inputs, *f.outputs)]
    out = ", ".join(writing.at(i) for i in f.nodes)
    head = [f"def {f.name}({given}):", f'    """{f.about[0].upper()}{f.about[1:]}.', "", *about, '    """']
    return "\n".join([*head, *writing.lines(None, 1), f"    return ({out},)", ""])


class _Writing:
    def __init__(self, graph: Graph, needed: set[int], inputs: Sequence[str]) -> None:
        self.graph, self.needed, self.inputs = graph, needed, inputs
        self.by_loop: dict[int | None, list[int]] = {}
        for i in sorted(needed):
            self.by_loop.setdefault(graph.innermost(i), []).append(i)

    def lines(self, loop: int | None, depth: int) -> list[str]:
        """One turn of a loop, or what is outside of all."""
        pad, out, opened = "    " * depth, list[str](), set[int]()
        for i in self.by_loop.get(loop, []):
            node = self.graph.nodes[i]
            if node.operation == ENDED and node.of[0] not in opened:
                opened.add(node.of[0])
                out += self._loop(node.of[0], depth)
            elif node.operation == "where":
                test, first, second = (self.at(j) for j in node.of)
                out.append(f"{pad}v{i} = {first} if {test} else {second}")
            elif node.operation not in (CONSTANT, INPUT, CARRIED, ENDED):
                out.append(f"{pad}v{i} = {WAYS[node.operation].format(*(self.at(j) for j in node.of))}")
        return out

    def at(self, i: int) -> str:
        """The name or the number of a node."""
        node = self.graph.nodes[i]
        if node.operation == CONSTANT:
            return self._constant(node.value, node.truth)
        if node.operation == INPUT:
            return self.inputs[node.of[0]]
        return f"c{node.of[0]}_{node.of[1]}" if node.operation in (CARRIED, ENDED) else f"v{i}"

    @staticmethod
    def _constant(value: float, truth: bool) -> str:
        if truth:
            return str(bool(value))
        if value != value:
            return "NAN"
        if value in (float("inf"), float("-inf")):
            return "INFINITY" if value > 0 else "(-INFINITY)"
        return f"({value!r})" if value < 0 else repr(value)

    def _loop(self, number: int, depth: int) -> list[str]:
        loop, pad = self.graph.loops[number], "    " * depth
        places = self.graph.carried(number, self.needed)
        names = ", ".join(f"c{number}_{i}" for i in places)
        begin = ", ".join(self.at(loop.starts[i]) for i in places)
        after = ", ".join(self.at(loop.nexts[i]) for i in places)
        comma = "," if len(places) == 1 else ""
        return [
            f"{pad}{names}{comma} = {begin}{comma}",
            f"{pad}for _ in range({loop.times}):",
            *self.lines(number, depth + 1),
            f"{pad}    {names}{comma} = {after}{comma}",
        ]
