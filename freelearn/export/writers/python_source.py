"""A graph as a function in plain Python: for callbacks where no compiler is."""

from __future__ import annotations

from freelearn.export.arithmetic.function import Function
from freelearn.export.arithmetic.writing import Writing, literal

WAYS = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "divided({}, {})", "neg": "-{}", "abs": "abs({})",
    "sqrt": "root({})", "exp": "exponential({})", "expm1": "(exponential({}) - 1.0)", "log": "logarithm({})",
    "log1p": "logarithm(1.0 + {})", "tanh": "math.tanh({})", "sin": "math.sin({})", "cos": "math.cos({})",
    "tan": "math.tan({})", "pow": "power({}, {})", "hypot": "math.hypot({}, {})", "min": "smaller({}, {})",
    "max": "larger({}, {})", "sign": "sign_of({})", "lt": "{} < {}", "le": "{} <= {}", "gt": "{} > {}",
    "ge": "{} >= {}", "eq": "{} == {}", "ne": "{} != {}", "and": "{} and {}", "or": "{} or {}", "not": "not {}",
    "finite": "math.isfinite({})", "isnan": "math.isnan({})", "where": "{1} if {0} else {2}",
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
    writing = _Writing(f.graph, f.nodes, [p.name for p in f.inputs])
    given = ", ".join(p.name for p in f.inputs)
    about = [f"    {p.name} [{p.unit}]: {p.about}" for p in (*f.inputs, *f.outputs)]
    out = ", ".join(writing.at(i) for i in f.nodes)
    head = [f"def {f.name}({given}):", f'    """{f.about[0].upper()}{f.about[1:]}.', "", *about, '    """']
    return "\n".join([*head, *writing.lines(), f"    return ({out},)", ""])


class _Writing(Writing[str]):
    def operation(self, i: int, depth: int) -> list[str]:
        node = self.graph.nodes[i]
        way = WAYS[node.operation].format(*(self.at(j) for j in node.of))
        return [f"{'    ' * depth}v{i} = {way}"]

    def constant(self, value: float, truth: bool) -> str:
        return str(bool(value)) if truth else literal(value)

    def loop(self, number: int, depth: int) -> list[str]:
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
