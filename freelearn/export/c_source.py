"""An actuator as one file of C99: double precision, no allocations, a fixed number of operations in every call."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from freelearn.export.c_body import HELPERS, statements
from freelearn.export.function import Function, Port

WIDTH = 116


def c_source(name: str, title: str, functions: Sequence[Function]) -> str:
    """The text of NAME.c. name: that all its functions begin with. title: what it is, for the head."""
    head = [
        title,
        "Double precision, no allocations, no state: a call takes a fixed number of operations, whatever its inputs.",
        "Each function returns 0 where its answer stands. Bit 0 (1): beyond the data that the model was fitted on: "
        "nothing is promised. Bit 1 (2): no equilibrium, the tube balloons. Bit 2 (4): fibers at a singular angle. "
        "Bit 3 (8): fibers overstretched. Bit 4 (16): no pressure gives that load. Inputs and outputs are SI.",
        "Compile with: cc -std=c99 -O2 -c; link with -lm.",
    ]
    parts = [_comment(head), "#include <math.h>\n", HELPERS]
    # A compiler that is told of unused functions as errors knows these as used.
    parts.append(_prototypes(name, functions))
    parts += [_function(name, f) for f in functions]
    return "\n".join(parts)


def _prototypes(name: str, functions: Sequence[Function]) -> str:
    return "".join(f"{_signature(name, f)};\n" for f in functions)


def _signature(name: str, f: Function) -> str:
    return f"int {name}_{f.name}(const double in[{len(f.inputs)}], double out[{len(f.outputs)}])"


def _function(name: str, f: Function) -> str:
    about = [f"{f.about[0].upper()}{f.about[1:]}. {f.operations} operations."]
    about += _ports("in", f.inputs) + _ports("out", f.outputs)
    unread = [f"    (void)in[{i}];" for i in range(len(f.inputs)) if i not in f.graph.inputs(f.nodes)]
    lines = [_comment(about), f"{_signature(name, f)} {{", *unread, *statements(f.graph, f.nodes, "in", "out")]
    return "\n".join([*lines, f"    return {_flags(f)};", "}\n"])


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
