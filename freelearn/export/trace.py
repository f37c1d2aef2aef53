"""A function of one row's tensors as a graph of numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor
from torch._decomp import core_aten_decompositions
from torch._subclasses.fake_tensor import FakeTensorMode
from torch.fx.experimental.proxy_tensor import make_fx

from freelearn.errors import UserError
from freelearn.export.graph import Graph
from freelearn.export.lower import Lowering, NotArithmetic
from freelearn.export.solvers import fixed_searches


def traced(function: Callable[..., Sequence[Tensor]], inputs: int, what: str) -> tuple[Graph, list[list[int]]]:
    """The function of so many numbers, each (1,), as a graph, and the nodes of each of its outputs.

    Nothing in it may depend on what the numbers are: where the model asks, the answer is that nobody can know
    (freelearn.vmapped). Raises UserError where it cannot be written as arithmetic; what: its name in the sentence."""
    graph = Graph()
    places = [torch.tensor([graph.input(i)], dtype=torch.int64) for i in range(inputs)]
    mode = FakeTensorMode(allow_non_fake_inputs=True)
    rows = [mode.from_tensor(torch.ones(1, dtype=torch.float64)) for _ in range(inputs)]
    try:
        with fixed_searches(), torch.no_grad():
            # A mapping, whatever its declared type says.
            simpler: Any = core_aten_decompositions()
            module = make_fx(function, decomposition_table=simpler)(*rows)
        outputs = Lowering(graph, module).outputs(places)
    except (NotArithmetic, RuntimeError, TypeError) as problem:
        first = str(problem).strip().splitlines()[0] if str(problem).strip() else type(problem).__name__
        raise UserError(
            f"{what} cannot be exported: it does what no straight-line arithmetic can ({first}); use predict."
        ) from problem
    return graph, [t.reshape(-1).tolist() for t in outputs]
