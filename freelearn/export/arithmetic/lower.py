"""From what torch recorded of a model's one row to numbers and operations on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any

import torch
from torch import Tensor
from torch.fx import GraphModule, Node

from freelearn.export.arithmetic.graph import CONSTANT, Graph
from freelearn.export.arithmetic.loops import BEGIN, END

aten = torch.ops.aten

# A tensor while it is lowered: the numbers of its nodes, int64, in its own shape.
Ids = Tensor


class NotArithmetic(Exception):
    """The model does what cannot be written as arithmetic; the message names the operation."""


# Operations on one, two or three numbers at a time.
PLAIN = {
    "add": "add", "sub": "sub", "mul": "mul", "div": "div", "neg": "neg", "abs": "abs", "sign": "sign", "sgn": "sign",
    "sqrt": "sqrt", "exp": "exp", "expm1": "expm1", "log": "log", "log1p": "log1p", "tanh": "tanh", "sin": "sin",
    "cos": "cos", "tan": "tan", "pow": "pow", "hypot": "hypot", "maximum": "max", "minimum": "min",
    "where": "where", "lt": "lt", "le": "le", "gt": "gt", "ge": "ge", "eq": "eq", "ne": "ne",
    "logical_and": "and", "bitwise_and": "and", "logical_or": "or", "bitwise_or": "or",
    "logical_not": "not", "bitwise_not": "not", "isfinite": "finite", "isnan": "isnan",
}  # fmt: skip
# Operations along some dimensions: on two numbers after the other to one, or to one for each of them.
REDUCED = {"prod": "mul", "amax": "max", "amin": "min", "any": "or", "all": "and"}
RUNNING = {"cumprod": "mul", "cumsum": "add"}
# Operations that only move numbers about: done on the nodes' numbers in place of the numbers themselves.
MOVES = {
    "view", "_unsafe_view", "reshape", "expand", "unsqueeze", "squeeze", "permute", "transpose", "t", "select", "slice",
    "cat", "stack", "alias", "clone", "detach", "unbind", "split", "split_with_sizes", "diagonal", "flip", "repeat",
    "index", "index_select", "gather", "select_scatter", "slice_scatter", "diagonal_scatter", "lift_fresh",
    "lift_fresh_copy", "as_strided", "copy", "unflatten", "expand_copy", "view_copy",
}  # fmt: skip
# Those of their arguments that are places, not numbers.
PLACES = {"index": (1,), "index_select": (2,), "gather": (2,)}


class Lowering:
    """One traced function on its way into a graph."""

    def __init__(self, graph: Graph, traced: GraphModule) -> None:
        self.graph, self.traced = graph, traced
        self.made: dict[Node, Any] = {}

    def outputs(self, inputs: Sequence[Ids]) -> list[Ids]:
        """The nodes of every output, for the nodes of the inputs."""
        places = iter(inputs)
        needed = self._needed()
        result: list[Ids] = []
        for node in self.traced.graph.nodes:
            if node.op == "placeholder":
                self.made[node] = next(places)
            elif node.op == "output":
                result = [self.made[a] for a in node.args[0]]
            elif node in needed:
                self.made[node] = self._constant(node) if node.op == "get_attr" else self._called(node)
        return result

    def _needed(self) -> set[Node]:
        """What the outputs need: a trace also records questions that nobody could answer."""
        left, needed = [n for n in self.traced.graph.nodes if n.op == "output"], set[Node]()
        while left:
            node = left.pop()
            if node not in needed:
                needed.add(node)
                left += node.all_input_nodes
        return needed

    def _constant(self, node: Node) -> Ids:
        return self.of_tensor(getattr(self.traced, str(node.target)))

    def of_tensor(self, tensor: Tensor) -> Ids:
        """Nodes of a tensor's numbers."""
        flat = [self.graph.constant(v) for v in tensor.detach().reshape(-1).tolist()]
        return torch.tensor(flat, dtype=torch.int64).reshape(tensor.shape)

    def _called(self, node: Node) -> Any:
        target: Any = node.target
        args, kwargs = self._resolved(node.args), self._resolved(node.kwargs)
        if target is BEGIN:
            return self._begin(args[0])
        if target is END:
            return self._end(*args)
        if getattr(target, "__name__", "") == "getitem":
            return args[0][args[1]]
        name = target._schema.name.split("::")[-1]
        # In place or not: nothing else holds what it changes.
        if name.endswith("_") and not name.endswith("__"):
            name, target = name[:-1], getattr(aten, name[:-1]).default
        if name in MOVES:
            taken = [self._whole(a) if i in PLACES.get(name, ()) else a for i, a in enumerate(args)]
            return target(*taken, **kwargs)
        if self._fixed(node):
            return self._computed(node, target)
        if name in PLAIN:
            return self._plain(name, args, kwargs, str(target))
        kwargs = {k: v for k, v in kwargs.items() if k not in ("dtype", "layout", "device", "pin_memory")}
        if name in REDUCED:
            return self._reduced(REDUCED[name], *args, **kwargs)
        if name in RUNNING:
            return self._running(RUNNING[name], *args, **kwargs)
        if (rule := getattr(self, f"_on_{name}", None)) is not None:
            return rule(*args, **kwargs)
        raise NotArithmetic(f"{target} of shape {tuple(node.meta['val'].shape)}")

    def _resolved(self, value: Any) -> Any:
        if isinstance(value, Node):
            return self.made[value]
        if isinstance(value, list | tuple):
            return [self._resolved(v) for v in value]
        if isinstance(value, dict):
            return {k: self._resolved(v) for k, v in value.items()}
        return value

    def _whole(self, value: Any) -> Any:
        """Nodes that stand for places, as these."""
        if isinstance(value, Tensor):
            nodes = [self.graph.nodes[i] for i in value.reshape(-1).tolist()]
            if any(n.operation != CONSTANT for n in nodes):
                raise NotArithmetic("a choice of rows by what is computed")
            kind = torch.bool if nodes and nodes[0].truth else torch.int64
            return torch.tensor([n.value for n in nodes]).to(kind).reshape(value.shape)
        return [self._whole(v) for v in value] if isinstance(value, list) else value

    def _fixed(self, node: Node) -> bool:
        """Whether all that it works on is constant."""
        ids = [self.made[n] for n in node.all_input_nodes]
        each = [i for value in ids for i in (value if isinstance(value, list | tuple) else [value])]
        return all(self.graph.nodes[i].operation == CONSTANT for t in each for i in t.reshape(-1).tolist())

    def _computed(self, node: Node, target: Any) -> Any:
        """By torch itself."""

        def number(n: Node) -> Any:
            flat = [self.graph.nodes[i].value for i in self.made[n].reshape(-1).tolist()]
            kind = n.meta["val"].dtype if "val" in n.meta else getattr(self.traced, str(n.target)).dtype
            return torch.tensor(flat, dtype=torch.float64).to(kind).reshape(self.made[n].shape)

        args = torch.fx.map_arg(node.args, number)
        kwargs = torch.fx.map_arg({k: v for k, v in node.kwargs.items() if k not in ("device", "pin_memory")}, number)
        value = target(*args, **kwargs)
        return [self.of_tensor(v) for v in value] if isinstance(value, list | tuple) else self.of_tensor(value)

    def _ids(self, value: Any) -> Ids:
        return value if isinstance(value, Tensor) else torch.tensor(self.graph.constant(value), dtype=torch.int64)

    def _each(self, operation: str, *args: Any) -> Ids:
        arrays = torch.broadcast_tensors(*(self._ids(a) for a in args))
        rows = zip(*(a.reshape(-1).tolist() for a in arrays), strict=True)
        flat = [self.graph.apply(operation, *row) for row in rows]
        return torch.tensor(flat, dtype=torch.int64).reshape(arrays[0].shape)

    def _plain(self, name: str, args: list[Any], kwargs: dict[str, Any], target: str) -> Ids:
        numbers = args[: 3 if name == "where" else 2]
        factor = kwargs.get("alpha", 1)
        if len(args) > 2 and name in ("add", "sub"):
            factor = args[2]
        if factor != 1:
            numbers = [numbers[0], self._each("mul", numbers[1], float(factor))]
        if kwargs.get("rounding_mode"):
            raise NotArithmetic(target)
        return self._each(PLAIN[name], *numbers)

    def _begin(self, starts: list[Ids]) -> list[Ids]:
        flat = self.graph.begin([i for t in starts for i in t.reshape(-1).tolist()])
        return _shaped(flat, starts)

    def _end(self, carried: list[Ids], nexts: list[Ids], times: int) -> list[Ids]:
        begun, after = ([i for t in some for i in t.reshape(-1).tolist()] for some in (carried, nexts))
        return _shaped(self.graph.end(begun, after, times), nexts)

    # Rules of single operations, by torch's own names.

    def _on_reciprocal(self, x: Ids) -> Ids:
        return self._each("div", 1.0, x)

    def _on_rsqrt(self, x: Ids) -> Ids:
        return self._each("div", 1.0, self._each("sqrt", x))

    def _on_asin(self, x: Ids) -> Ids:
        """2 atan t, t = x/(1 + √(1 − x²)), from a guess within 0.004 and the series of what it leaves: onnxruntime has
        no arcus in float64."""
        each = self._each
        root = each("sqrt", each("mul", each("sub", 1.0, x), each("add", 1.0, x)))
        t = each("div", x, each("add", 1.0, root))
        guess = each("mul", t, each("sub", math.pi / 4 + 0.273, each("mul", 0.273, each("abs", t))))
        tangent = each("tan", guess)
        left = each("div", each("sub", t, tangent), each("add", 1.0, each("mul", t, tangent)))
        square = each("mul", left, left)
        series = self._ids(1 / 9)
        for term in (-1 / 7, 1 / 5, -1 / 3, 1.0):
            series = each("add", term, each("mul", square, series))
        return each("mul", 2.0, each("add", guess, each("mul", left, series)))

    def _on_square(self, x: Ids) -> Ids:
        return self._each("mul", x, x)

    def _on__to_copy(self, x: Ids) -> Ids:
        return x

    def _on_sigmoid(self, x: Ids) -> Ids:
        return self._each("div", 1.0, self._each("add", 1.0, self._each("exp", self._each("neg", x))))

    def _on_clamp(self, x: Ids, min: Any = None, max: Any = None) -> Ids:
        x = x if min is None else self._each("max", x, min)
        return x if max is None else self._each("min", x, max)

    def _on_clamp_min(self, x: Ids, min: Any) -> Ids:
        return self._on_clamp(x, min)

    def _on_addcmul(self, x: Ids, a: Ids, b: Ids, value: float = 1) -> Ids:
        return self._each("add", x, self._each("mul", self._each("mul", float(value), a), b))

    def _on_addcdiv(self, x: Ids, a: Ids, b: Ids, value: float = 1) -> Ids:
        return self._each("add", x, self._each("mul", float(value), self._each("div", a, b)))

    def _on_nan_to_num(
        self, x: Ids, nan: float | None = None, posinf: float | None = None, neginf: float | None = None
    ) -> Ids:
        most = torch.finfo(torch.float64).max
        x = self._each("where", self._each("isnan", x), float(nan or 0.0), x)
        return self._on_clamp(x, -most if neginf is None else neginf, most if posinf is None else posinf)

    def _reduced(self, operation: str, x: Ids, dims: Any = None, keepdim: bool = False) -> Ids:
        every = range(x.ndim) if dims is None or dims == [] else [dims] if isinstance(dims, int) else dims
        every = sorted(d % x.ndim for d in every) if x.ndim else []
        for d in every:
            parts = x.unbind(d)
            x = reduce(lambda a, b: self._each(operation, a, b), parts).unsqueeze(d)
        return x if keepdim else x.squeeze(tuple(every)) if every else x

    def _on_sum(self, x: Ids, dims: Any = None, keepdim: bool = False) -> Ids:
        if not x.numel():
            return self._each("add", torch.zeros(0, dtype=torch.int64).new_full((), self.graph.constant(0.0)), 0.0)
        return self._reduced("add", x, dims, keepdim)

    def _on_mean(self, x: Ids, dims: Any = None, keepdim: bool = False) -> Ids:
        total = self._reduced("add", x, dims, keepdim)
        return self._each("div", total, float(x.numel() // total.numel()))

    def _on_linalg_vector_norm(self, x: Ids, ord: float = 2, dims: Any = None, keepdim: bool = False) -> Ids:
        if ord != 2:
            raise NotArithmetic(f"a norm of order {ord}")
        return self._each("sqrt", self._reduced("add", self._on_square(x), dims, keepdim))

    def _on_mm(self, a: Ids, b: Ids) -> Ids:
        return self._on_sum(self._each("mul", a[..., :, :, None], b[..., None, :, :]), -2)

    def _on_mv(self, a: Ids, b: Ids) -> Ids:
        return self._on_sum(self._each("mul", a, b), -1)

    _on_bmm, _on_dot = _on_mm, _on_mv

    def _on_addmm(self, c: Ids, a: Ids, b: Ids) -> Ids:
        return self._each("add", c, self._on_mm(a, b))

    def _on_full_like(self, x: Ids, value: Any, **_: Any) -> Ids:
        return self._ids(value).expand(x.shape)

    def _on_zeros_like(self, x: Ids, **_: Any) -> Ids:
        return self._ids(0.0).expand(x.shape)

    def _on_ones_like(self, x: Ids, **_: Any) -> Ids:
        return self._ids(1.0).expand(x.shape)

    def _on_new_zeros(self, x: Ids, size: list[int]) -> Ids:
        return self._ids(0.0).expand(size)

    _on_fill = _on_full_like

    def _on_index_put(self, x: Ids, places: list[Any], values: Ids, accumulate: bool = False) -> Ids:
        where = tuple(slice(None) if p is None else self._whole(p) for p in places)
        numbers = torch.arange(x.numel()).reshape(x.shape)[where]
        flat = x.reshape(-1).tolist()
        for place, value in zip(
            numbers.reshape(-1).tolist(), values.expand_as(numbers).reshape(-1).tolist(), strict=True
        ):
            flat[place] = self.graph.apply("add", flat[place], value) if accumulate else value
        return torch.tensor(flat, dtype=torch.int64).reshape(x.shape)

    def _running(self, operation: str, x: Ids, dim: int) -> Ids:
        parts = list(x.unbind(dim))
        for i in range(1, len(parts)):
            parts[i] = self._each(operation, parts[i - 1], parts[i])
        return torch.stack(parts, dim)

    def _on_log2(self, x: Ids) -> Ids:
        return self._each("div", self._each("log", x), math.log(2.0))

    def _on_tanh_backward(self, gradient: Ids, y: Ids) -> Ids:
        return self._each("mul", gradient, self._each("sub", 1.0, self._each("mul", y, y)))


def _shaped(flat: list[int], like: list[Ids]) -> list[Ids]:
    """So many numbers in the shapes of some tensors."""
    parts, start = [], 0
    for tensor in like:
        some = flat[start : start + tensor.numel()]
        parts.append(torch.tensor(some, dtype=torch.int64).reshape(tensor.shape))
        start += tensor.numel()
    return parts
