"""The Python file of a written effect, like one that a user writes; and the class that it defines."""

from __future__ import annotations

import sys
from functools import cache
from types import ModuleType
from typing import Any

from freelearn.models.effect import Effect
from freelearn.models.ports import BASES
from freelearn.models.written.written import Constant, Written

HEAD = '''"""{title}

{lines}
"""

import torch
from torch import Tensor

from freelearn.measurements.states import States
{imports}


class Constants(Parameters):
    """{told}"""

{parameters}


class {kind}({base}[Constants]):
    """{formula}"""

    name = "{name}"
    suspect = "{suspect}"
    source = "written by freelearn's search from the measurements named above"
    parameter_class = Constants
{more}
    def {signature}
        """As {base}.{method}."""
        {body}
'''
SIGNATURES = {
    "BoundaryEffect": "impose(self, states: States, p: Constants) -> States:",
    "MountEffect": "impose(self, states: States, loads: Tensor, p: Constants) -> States:",
    "GeometryEffect": "reshape(self, states: States, p: Constants) -> States:",
    "EnergyEffect": "psi(self, *invariants: Tensor, p: Constants, material: Material) -> Tensor:",
    "EndEffect": "dissipate(self, loads: Tensor, states: States, p: Constants) -> Tensor:",
    "DissipationEffect": "dissipate(self, loads: Tensor, states: States, p: Constants) -> Tensor:",
    "WallEffect": "soften(self, states: States, p: Constants) -> Tensor:",
    "MeasurementEffect": "sense(self, loads: Tensor, states: States, p: Constants) -> Tensor:",
}
WIDTH = 116


def base_of(written: Written) -> str:
    """Name of the base class: a state imposed that depends on the loads is a mount's."""
    mount = written.place.port == "boundary" and any(i.of_loads for i in written.inputs)
    return "MountEffect" if mount else written.place.base


def source(written: Written) -> str:
    """The whole file's text."""
    place, base = written.place, base_of(written)
    names = sorted({base, *(["columns"] if "columns(" in place.body else [])}, key=str.lower)
    imports = [
        *(["from freelearn.models.material import Material"] if place.energy else []),
        "from freelearn.models.parameters import Parameters, parameter",
        f"from freelearn.models.ports import {', '.join(names)}",
    ]
    units = [f"{i.symbol} in units of {s:g} {i.unit}" for i, s in zip(written.inputs, written.scales, strict=True)]
    said = ", ".join(i.name if i.unit != "1" else i.symbol for i in written.inputs)
    title = f"{place.changes.capitalize()} that depends on {said}: written by freelearn's search."
    signature = SIGNATURES[base]
    more = f'    depends_on = ("{written.inputs[0].name}",)\n' if place.energy else ""
    return HEAD.format(
        title=title,
        lines="\n".join(written.lines) or "No evidence was kept.",
        imports="\n".join(imports),
        told=f"Amounts at {' and '.join(units)}." if any(i.unit != "1" for i in written.inputs) else "Of the form.",
        parameters="\n".join(_declared(constant, written.each) for constant in written.constants()),
        kind="".join(part.capitalize() for part in written.name.split("_")),
        base=base,
        formula=f"{written.formula}, with {', '.join(units)}.",
        name=written.name,
        suspect=f"{place.changes.capitalize()} depends on {said}.",
        more=more,
        signature=signature,
        method=signature.split("(")[0],
        body=_body(written),
    )


def _declared(constant: Constant, each: bool) -> str:
    bounds = "".join(
        f" {name}={value!r}," for name, value in (("lower", constant.lower), ("upper", constant.upper))
        if abs(value) != float("inf")
    )  # fmt: skip
    none = f" none=0.0,{' per_member=True,' if each else ''}" if constant.amount else ""
    size = abs(constant.start) or 1.0
    head = f'    {constant.name}: Tensor = parameter("{constant.symbol}", "{constant.unit}", start={constant.start!r},'
    rest = f"{bounds}{none} scale={size!r})"
    return head + rest if len(head + rest) <= WIDTH else f"{head}\n       {rest.replace(')', '')}\n    )"


def _body(written: Written) -> str:
    place, form = written.place, written.form
    constants = {c.name: c for c in written.constants()}
    shapes = {}
    for shape in form.shapes:
        scale = written.scales[shape.place]
        own = f"p.{constants[shape.name].name}"
        shapes[shape.name] = {"x": f"({own} / {scale!r})", "1/x": f"({own} * {scale!r})", "": own}[shape.of]
    inputs = {
        letter: f"({i.code}) / {scale!r}"
        for letter, i, scale in zip("xy", written.inputs, written.scales, strict=False)
    }
    if place.potential:
        # Inside a function of length and twist.
        codes = ("(length - states.reference_length)", "twist")
        named = {x: f"({code} / {scale!r})" for x, code, scale in zip("xy", codes, written.scales, strict=True)}
        return place.body.format(value=_value(written, named | shapes))
    lines = [f"{letter} = {code}" for letter, code in inputs.items()]
    lines.append(f"value = {_value(written, {'x': 'x', 'y': 'y'} | shapes)}")
    lines.append(place.body.format(value="value"))
    return "\n        ".join(lines)


def _value(written: Written, names: dict[str, str]) -> str:
    terms = [term.format(**names) for term in written.form.terms]
    return " + ".join(f"p.{c.name} * ({t})" for c, t in zip(written.constants(), terms, strict=False))


@cache
def _module(text: str) -> ModuleType:
    """The text as a module, which is run: only ever text that this module wrote itself."""
    # Where inspect finds the class's module.
    name = f"freelearn_written_{sum(key.startswith('freelearn_written_') for key in sys.modules)}"
    module = ModuleType(name)
    sys.modules[name] = module
    exec(compile(text, f"<{name}>", "exec"), vars(module))
    return module


def effect_class(written: Written) -> type[Effect[Any]]:
    """The effect that the file defines."""
    own = [v for v in vars(_module(source(written))).values() if isinstance(v, type) and issubclass(v, BASES)]
    (kind,) = [v for v in own if v.__module__.startswith("freelearn_written_")]
    return kind
