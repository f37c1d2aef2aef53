"""An actuator as one file of C99: double precision, no allocations, a fixed number of operations in every call."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from freelearn.export.arithmetic.function import Function, Port
from freelearn.export.arithmetic.writing import Writing, literal

# A graph as statements of C99.

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


class _Body(Writing[str]):
    def __init__(self, f: Function, inputs: str) -> None:
        super().__init__(f.graph, f.nodes, [inputs.format(i) for i in range(len(f.inputs))])

    def stores(self, outputs: Sequence[int], results: str) -> list[str]:
        """What puts nodes into an array."""
        return [f"    {results}[{i}] = {self.at(node)};" for i, node in enumerate(outputs)]

    def constant(self, value: float, truth: bool) -> str:
        return str(int(value)) if truth else literal(value)

    def operation(self, i: int, depth: int) -> list[str]:
        node = self.graph.nodes[i]
        kind = "const int" if node.truth else "const double"
        way = WAYS[node.operation].format(*(self.at(j) for j in node.of))
        return [f"{'    ' * depth}{kind} v{i} = {way};"]

    def loop(self, number: int, depth: int) -> list[str]:
        loop, pad = self.graph.loops[number], "    " * depth
        places = self.graph.carried(number, self.needed)
        kind = {i: "int" if self.graph.nodes[loop.starts[i]].truth else "double" for i in places}
        begun = [f"{pad}{kind[i]} c{number}_{i} = {self.at(loop.starts[i])};" for i in places]
        inside = pad + "    "
        # What is carried changes at once, after all of it was computed; what stays needs no copy.
        moved = [(i, self.at(loop.nexts[i])) for i in places if self.at(loop.nexts[i]) != f"c{number}_{i}"]
        after = [f"{inside}const {kind[i]} n{number}_{i} = {n};" for i, n in moved]
        after += [f"{inside}c{number}_{i} = n{number}_{i};" for i, _ in moved]
        turn = f"{pad}for (int t{number} = 0; t{number} < {loop.times}; t{number}++) {{"
        return [*begun, turn, *self.lines(number, depth + 1), *after, f"{pad}}}"]


WIDTH = 116


def c_source(name: str, title: str, functions: Sequence[Function]) -> str:
    """The text of NAME.c. name: that all its functions begin with. title: what it is, for the head."""
    head = [
        title,
        "Double precision, no allocations, no state of its own: a call takes a fixed number of operations, whatever "
        "its inputs.",
        "Each function returns 0 where its answer stands. Bit 0 (1): beyond the data that the model was fitted on: "
        "nothing is promised. Bit 1 (2): no equilibrium, the tube balloons. Bit 2 (4): fibers at a singular angle. "
        "Bit 3 (8): fibers overstretched. Bit 4 (16): no pressure gives that load. Inputs and outputs are SI.",
        "Compile with: cc -std=c99 -O2 -c; link with -lm.",
    ]
    if any(f.carried for f in functions):
        head.insert(
            2,
            f"Along a log: {name}_reset before the first sample, {name}_step at each, the state of yours in both. What "
            "is imposed counts as a straight line from sample to sample.",
        )
    parts = [_comment(head), "#include <math.h>\n", HELPERS]
    # A compiler that is told of unused functions as errors knows these as used.
    parts.append(_prototypes(name, functions))
    parts += [_function(name, f) for f in functions]
    return "\n".join(parts)


def _prototypes(name: str, functions: Sequence[Function]) -> str:
    every = [s for f in functions for s in (*([_reset(name, f)] if f.carried else []), _signature(name, f))]
    return "".join(f"{s};\n" for s in every)


def _reset(name: str, f: Function) -> str:
    return f"void {name}_reset(double state[{f.carried}])"


def _signature(name: str, f: Function) -> str:
    if f.carried:
        given, answered = len(f.given) - 1, len(f.answered)
        own = f"const double in[{given}], double dt, double state[{f.carried}], double out[{answered}]"
        return f"int {name}_{f.name}({own})"
    return f"int {name}_{f.name}(const double in[{len(f.inputs)}], double out[{len(f.outputs)}])"


def _function(name: str, f: Function) -> str:
    about = [f"{f.about[0].upper()}{f.about[1:]}. {f.operations} operations."]
    if f.carried:
        return _stepping(name, f, about)
    about += _ports("in", f.inputs) + _ports("out", f.outputs)
    unread = [f"    (void)in[{i}];" for i in range(len(f.inputs)) if i not in f.graph.inputs(f.nodes)]
    body = _Body(f, "in[{}]")
    lines = [_comment(about), f"{_signature(name, f)} {{", *unread, *body.lines(), *body.stores(f.nodes, "out")]
    return "\n".join([*lines, f"    return {_flags(f)};", "}\n"])


def _stepping(name: str, f: Function, about: list[str]) -> str:
    """The function of one sample, and the one that begins a recording."""
    given, answered = len(f.given), len(f.answered)
    told = [*about, *_ports("in", f.given[:-1]), f"dt [s]: {f.given[-1].about}"]
    told += _ports("state", f.state) + _ports("out", f.answered)
    # Read before any of them is written.
    read = [f"    const double g{i} = in[{i}];" for i in range(given - 1)] + [f"    const double g{given - 1} = dt;"]
    read += [f"    const double g{given + i} = state[{i}];" for i in range(f.carried)]
    unread = [f"    (void)g{i};" for i in range(len(f.inputs)) if i not in f.graph.inputs(f.nodes)]
    body = _Body(f, "g{}")
    stores = body.stores(f.nodes[:answered], "out") + body.stores(f.nodes[answered:], "state")
    begin = [_comment([f"The state before the first sample: {f.carried} zeros."]), f"{_reset(name, f)} {{"]
    begin += [f"    for (int i = 0; i < {f.carried}; i++) state[i] = 0.0;", "}\n"]
    step = [
        _comment(told),
        f"{_signature(name, f)} {{",
        *read,
        *unread,
        *body.lines(),
        *stores,
        f"    return {_flags(f)};",
        "}\n",
    ]
    return "\n".join([*begin, *step])


def _flags(f: Function) -> str:
    place = {p.name: i for i, p in enumerate(f.outputs)}
    bits = [f"(out[{place['inside']}] != 0.0 ? 0 : 1)"]
    if "status" in place:
        bits.append(f"(out[{place['status']}] != 0.0 ? 1 << (int)out[{place['status']}] : 0)")
    if "found" in place:
        bits.append(f"(out[{place['found']}] != 0.0 ? 0 : 16)")
    return " | ".join(bits)


def _ports(array: str, ports: Sequence[Port]) -> list[str]:
    return [f"{array}[{i}] {p.name} [{p.unit}]: {p.about}" for i, p in enumerate(ports)]


def _comment(lines: Sequence[str]) -> str:
    wrapped = [part for line in lines for part in textwrap.wrap(line, WIDTH, subsequent_indent="    ")]
    text = "\n".join(f" * {line}" for line in wrapped).replace("*/", "* /")
    return f"/*\n{text}\n */"
