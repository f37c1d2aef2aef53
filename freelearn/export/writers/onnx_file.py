"""An actuator as ONNX files: float64, any number of rows at once, loops with a fixed number of turns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from freelearn.common.files import write_bytes
from freelearn.export.actuator_functions import Functions
from freelearn.export.along import Follow, Followed
from freelearn.export.arithmetic.function import Function
from freelearn.export.arithmetic.graph import Graph
from freelearn.export.arithmetic.writing import Writing
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import Answers, Written
from freelearn.export.writers.c_file import title

# Loop and the comparisons of float64 are in all runtimes that have these.
OPSET, IR = 17, 8

WAYS = {
    "add": "Add", "sub": "Sub", "mul": "Mul", "div": "Div", "neg": "Neg", "abs": "Abs", "sqrt": "Sqrt", "exp": "Exp",
    "log": "Log", "tanh": "Tanh", "sin": "Sin", "cos": "Cos", "pow": "Pow", "sign": "Sign", "min": "Min", "max": "Max",
    "where": "Where", "lt": "Less", "le": "LessOrEqual", "gt": "Greater", "ge": "GreaterOrEqual", "eq": "Equal",
    "and": "And", "or": "Or", "not": "Not", "isnan": "IsNaN",
}  # fmt: skip
LOGICAL = ("and", "or", "not")
# Of what is followed from sample to sample.
STATE, STATE_OUT = "state", "state_out"


def onnx_model(name: str, title: str, f: Function) -> Any:
    """The function as an onnx.ModelProto: an input and an output (rows,) for each of its ports, in SI; of those that
    are a state one of all together, `state` and `state_out` (rows, s)."""
    from onnx import TensorProto, checker, helper

    def value(port_name: str, *more: int) -> Any:
        return helper.make_tensor_value_info(port_name, TensorProto.DOUBLE, ["rows", *more])

    writing = _Writing(f.graph, f.nodes, [p.name for p in f.inputs])
    # Constants alone are no rows: each output takes the length of the first input.
    nodes = writing.lines()
    zero = f"{f.inputs[0].name}_zero"
    nodes += [helper.make_node("Sub", [f.inputs[0].name] * 2, [zero])]
    for port, i in zip(f.outputs, f.nodes, strict=True):
        number, made = writing.number(i)
        nodes += [*made, helper.make_node("Add", [number, zero], [port.name])]
    own, after = ([value(n, f.carried)] if f.carried else [] for n in (STATE, STATE_OUT))
    about = {p.name: f"[{p.unit}] {p.about}" for p in (*f.given, *f.answered)}
    if f.carried:
        parts, joined = writing.state([p.name for p in f.state], [p.name for p in f.outputs[len(f.answered) :]])
        nodes = [*parts, *nodes, *joined]
        about |= {f"{STATE}[{i}]": f"{p.name} [{p.unit}] {p.about}; at first 0" for i, p in enumerate(f.state)}
    graph = helper.make_graph(
        nodes,
        f"{name}_{f.name}",
        [*(value(p.name) for p in f.given), *own],
        [*(value(p.name) for p in f.answered), *after],
        [*writing.constants.values()],
        doc_string=f"{title}: {f.about}",
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR)
    model.producer_name = "freelearn"
    helper.set_model_props(model, about)
    checker.check_model(model)
    return model


class _Writing(Writing[Any]):
    """A graph on its way into nodes of ONNX."""

    # What a loop gives has names of its own.
    ended = "e"

    def __init__(self, graph: Graph, outputs: Sequence[int], inputs: Sequence[str]) -> None:
        super().__init__(graph, outputs, inputs)
        self.constants: dict[str, Any] = {}
        self.casts = 0

    def state(self, names: Sequence[str], after: Sequence[str]) -> tuple[list[Any], list[Any]]:
        """What takes a state apart, each number (rows,) by its name, and what joins the numbers that follow them."""
        from onnx import TensorProto, helper

        def whole(name: str, shape: list[int], number: int) -> str:
            self.constants[name] = helper.make_tensor(name, TensorProto.INT64, shape, [number])
            return name

        parts = [
            helper.make_node("Gather", [STATE, whole(f"place_{i}", [], i)], [name], axis=1)
            for i, name in enumerate(names)
        ]
        axis = whole("second_axis", [1], 1)
        columns = [helper.make_node("Unsqueeze", [name, axis], [f"{name}_column"]) for name in after]
        return parts, [*columns, helper.make_node("Concat", [f"{name}_column" for name in after], [STATE_OUT], axis=1)]

    def number(self, i: int) -> tuple[str, list[Any]]:
        """The name of a node's number, and what makes one of a truth."""
        from onnx import TensorProto, helper

        if not self.graph.nodes[i].truth:
            return self.at(i), []
        self.casts += 1
        name = f"n{self.casts}"
        return name, [helper.make_node("Cast", [self.at(i)], [name], to=TensorProto.DOUBLE)]

    def constant(self, value: float, truth: bool = False) -> str:
        from onnx import TensorProto, helper

        name = f"{'truth' if truth else 'number'}_{value!r}"
        kind = TensorProto.BOOL if truth else TensorProto.DOUBLE
        self.constants[name] = helper.make_tensor(name, kind, [], [bool(value) if truth else value])
        return name

    def operation(self, i: int, depth: int) -> list[Any]:
        from onnx import helper

        node, made, names = self.graph.nodes[i], [], []
        for place, j in enumerate(node.of):
            truth = node.operation in LOGICAL or (node.operation == "where" and (place == 0 or node.truth))
            name, more = (self.at(j), []) if truth else self.number(j)
            names.append(name)
            made += more
        result = f"v{i}"
        between = [f"v{i}_{k}" for k in "abc"]

        def op(kind: str, taken: Sequence[str], given: str) -> Any:
            return helper.make_node(kind, list(taken), [given])

        match node.operation:
            case "ne":
                return [*made, op("Equal", names, between[0]), op("Not", between[:1], result)]
            case "finite":
                either = [op("IsNaN", names, between[0]), op("IsInf", names, between[1])]
                return [*made, *either, op("Or", between[:2], between[2]), op("Not", between[2:], result)]
            case "hypot":
                squares = [op("Mul", [n, n], b) for n, b in zip(names, between[:2], strict=True)]
                return [*made, *squares, op("Add", between[:2], between[2]), op("Sqrt", between[2:], result)]
            case "expm1":
                return [*made, op("Exp", names, between[0]), op("Sub", [between[0], self.constant(1.0)], result)]
            case "log1p":
                return [*made, op("Add", [names[0], self.constant(1.0)], between[0]), op("Log", between[:1], result)]
            case "tan":
                parts = [op("Sin", names, between[0]), op("Cos", names, between[1])]
                return [*made, *parts, op("Div", between[:2], result)]
        return [*made, op(WAYS[node.operation], names, result)]

    def loop(self, number: int, depth: int) -> list[Any]:
        from onnx import TensorProto, helper

        loop = self.graph.loops[number]
        places = self.graph.carried(number, self.needed)
        kinds = [TensorProto.BOOL if self.graph.nodes[loop.starts[i]].truth else TensorProto.DOUBLE for i in places]
        body, outs, go_on = self.lines(number), [], f"go_{number}"
        for i in places:
            outs.append(f"o{number}_{i}")
            body.append(helper.make_node("Identity", [self.at(loop.nexts[i])], [outs[-1]]))
        body.append(helper.make_node("Identity", [go_on], [f"{go_on}_on"]))
        inside = helper.make_graph(
            body,
            f"turn_{number}",
            [
                helper.make_tensor_value_info(f"turn_{number}", TensorProto.INT64, []),
                helper.make_tensor_value_info(go_on, TensorProto.BOOL, []),
                *(helper.make_tensor_value_info(f"c{number}_{i}", k, None) for i, k in zip(places, kinds, strict=True)),
            ],
            [
                helper.make_tensor_value_info(f"{go_on}_on", TensorProto.BOOL, []),
                *(helper.make_tensor_value_info(o, k, None) for o, k in zip(outs, kinds, strict=True)),
            ],
        )
        times = f"times_{loop.times}"
        self.constants[times] = helper.make_tensor(times, TensorProto.INT64, [], [loop.times])
        starts = [self.at(loop.starts[i]) for i in places]
        ends = [f"e{number}_{i}" for i in places]
        return [helper.make_node("Loop", [times, self.constant(1.0, True), *starts], ends, body=inside)]


# An actuator as ONNX files.

OUTSIDE = (
    "Output `inside` = 0 beyond the data that the model was fitted on, output `status` says where there is no "
    "equilibrium; the numbers are what the model itself would say there."
)


def write_onnx(functions: Functions, folder: Path, options: Options) -> Written:
    """NAME.onnx with the answer, derivatives, bands and flags; one file more for each other question."""
    needed("onnx")
    about, sessions, paths = title(functions, options), {}, []
    for ending, f in functions.files.items():
        paths.append(folder / f"{options.name}{ending}.onnx")
        write_bytes(paths[-1], onnx_model(options.name, about, f).SerializeToString())
        sessions[ending] = opened(paths[-1])

    def of(f: Function) -> Answers:
        session = sessions[functions.file_of(f)]
        return lambda x: answered(session, f, x)

    step = functions.step
    follow = followed(sessions[""], step) if step else None
    return Written(paths, {f.name: of(f) for f in functions.every if not f.carried}, OUTSIDE, follow=follow)


def opened(path: Path) -> Any:
    """The file in onnxruntime, on one core."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(path.read_bytes(), options, providers=["CPUExecutionProvider"])


def answered(session: Any, f: Function, inputs: np.ndarray) -> np.ndarray:
    """Outputs (n, m) of a function, by its ports' names, at inputs (n, k)."""
    given = {p.name: np.ascontiguousarray(inputs[:, i]) for i, p in enumerate(f.inputs)}
    found = session.run([p.name for p in f.outputs], given)
    return np.stack(found, axis=1)


def followed(session: Any, f: Function) -> Follow:
    """Recordings all at once, sample by sample: each is a row."""

    def follow(recordings: Sequence[Followed]) -> list[np.ndarray]:
        names = [p.name for p in f.answered]
        state, out = np.array([r.begin for r in recordings]), [np.zeros((len(r), len(names))) for r in recordings]
        for n in range(max(map(len, recordings))):
            # Those that have ended go on at their last sample, for nobody.
            at = [min(n, len(r) - 1) for r in recordings]
            x = np.array([[*r.inputs[i], r.dt[i]] for r, i in zip(recordings, at, strict=True)])
            given = {p.name: np.ascontiguousarray(x[:, k]) for k, p in enumerate(f.given)}
            *found, state = session.run([*names, STATE_OUT], given | {STATE: state})
            for k, row in enumerate(np.stack(found, axis=1)):
                if n < len(recordings[k]):
                    out[k][n] = row
        return out

    return follow
