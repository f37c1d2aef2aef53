"""A graph as statements of C99."""

from __future__ import annotations

from collections.abc import Sequence

from freelearn.export.graph import CARRIED, CONSTANT, ENDED, INPUT, Graph

WAYS = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "{} / {}", "neg": "-{}", "abs": "fabs({})",
    "sqrt": "sqrt({})", "exp": "exp({})", "expm1": "expm1({})", "log": "log({})", "log1p": "log1p({})",
    "tanh": "tanh({})", "sin": "sin({})", "cos": "cos({})", "tan": "tan({})", "pow": "pow({}, {})",
    "hypot": "hypot({}, {})", "min": "smaller({}, {})", "max": "larger({}, {})", "sign": "sign_of({})",
    "where": "{} ? {} : {}", "lt": "{} < {}", "le": "{} <= {}", "gt": "{} > {}", "ge": "{} >= {}", "eq": "{} == {}",
    "ne": "{} != {}", "and": "{} & {}", "or": "{} | {}", "not": "!{}", "finite": "isfinite({}) != 0",
    "isnan": "isnan({}) != 0",
}  # fmt: skip

# What the statements call. NaN goes on through both, as through all else.
HELPERS = """\
static inline double smaller(double a, double b) { return (a != a || a < b) ? a : b; }
static inline double larger(double a, double b) { return (a != a || a > b) ? a : b; }
static inline double sign_of(double a) { return (double)((a > 0.0) - (a < 0.0)); }
"""


def statements(graph: Graph, outputs: Sequence[int], inputs: str, results: str) -> list[str]:
    """Lines that read the array `inputs` and write the nodes of the outputs to the array `results`."""
    needed = graph.needed(outputs)
    return [*_Body(graph, needed, inputs).lines(None, 1), *_stores(graph, outputs, results)]


def _stores(graph: Graph, outputs: Sequence[int], results: str) -> list[str]:
    return [f"    {results}[{i}] = {_name(graph, node)};" for i, node in enumerate(outputs)]


def _name(graph: Graph, i: int, inputs: str = "in") -> str:
    node = graph.nodes[i]
    if node.operation == CONSTANT:
        return _literal(node.value, node.truth)
    if node.operation == INPUT:
        return f"{inputs}[{node.of[0]}]"
    if node.operation in (CARRIED, ENDED):
        return f"c{node.of[0]}_{node.of[1]}"
    return f"v{i}"


def _literal(value: float, truth: bool) -> str:
    if truth:
        return str(int(value))
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    text = repr(value)
    return f"({text})" if text.startswith("-") else text


class _Body:
    def __init__(self, graph: Graph, needed: set[int], inputs: str) -> None:
        self.graph, self.needed, self.inputs = graph, needed, inputs
        self.by_loop: dict[int | None, list[int]] = {}
        for i in sorted(needed):
            self.by_loop.setdefault(graph.innermost(i), []).append(i)

    def lines(self, loop: int | None, depth: int) -> list[str]:
        """What is computed in one turn of a loop, or outside of all, in an order that serves."""
        pad, out, opened = "    " * depth, [], set[int]()
        for i in self.by_loop.get(loop, []):
            node = self.graph.nodes[i]
            if node.operation == ENDED and node.of[0] not in opened:
                opened.add(node.of[0])
                out += self._loop(node.of[0], depth)
            elif node.operation not in (CONSTANT, INPUT, CARRIED, ENDED):
                kind = "const int" if node.truth else "const double"
                way = WAYS[node.operation].format(*(self._at(j) for j in node.of))
                out.append(f"{pad}{kind} v{i} = {way};")
        return out

    def _at(self, i: int) -> str:
        return _name(self.graph, i, self.inputs)

    def _loop(self, number: int, depth: int) -> list[str]:
        loop, pad = self.graph.loops[number], "    " * depth
        places = self.graph.carried(number, self.needed)
        kind = {i: "int" if self.graph.nodes[loop.starts[i]].truth else "double" for i in places}
        begun = [f"{pad}{kind[i]} c{number}_{i} = {self._at(loop.starts[i])};" for i in places]
        inside = pad + "    "
        # What is carried changes at once, after all of it was computed; what stays needs no copy.
        moved = [(i, self._at(loop.nexts[i])) for i in places if self._at(loop.nexts[i]) != f"c{number}_{i}"]
        after = [f"{inside}const {kind[i]} n{number}_{i} = {n};" for i, n in moved]
        after += [f"{inside}c{number}_{i} = n{number}_{i};" for i, _ in moved]
        turn = f"{pad}for (int t{number} = 0; t{number} < {loop.times}; t{number}++) {{"
        return [*begun, turn, *self.lines(number, depth + 1), *after, f"{pad}}}"]
