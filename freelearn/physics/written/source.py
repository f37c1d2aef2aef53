"""The Python file of a written effect, like one that a user writes; and the class that it defines."""

from __future__ import annotations

import sys
from functools import cache
from types import ModuleType
from typing import Any

from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.ports import BASES
from freelearn.physics.written.written_effect import Constant, Written

HEAD = '''"""{title}

{lines}
"""

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
WIDTH = 120


def base_of(written: Written) -> str:
    """Name of the base class: a state imposed that depends on the loads is a mount's."""
    mount = written.place.port == "boundary" and any(i.of_loads for i in written.inputs)
    return "MountEffect" if mount else written.place.base


def source(written: Written) -> str:
    """The whole file's text."""
    place, base, body = written.place, base_of(written), _body(written)
    # In the order in which a formatter has them.
    names = [*sorted([base, "Parameters", "Material" if place.energy else "States"])]
    names += [*(["columns"] if "columns(" in body else []), "parameter"]
    imports = [
        *(["import torch"] if "torch." in body else []),
        "from torch import Tensor\n",
        f"from freelearn.own import {', '.join(names)}",
    ]
    units = [
        f"{i.symbol} in units of {s:g}{'' if i.unit == '1' else f' {i.unit}'}"
        for i, s in zip(written.inputs, written.scales, strict=True)
    ]
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
        body=body,
    )


def _declared(constant: Constant, each: bool) -> str:
    bounds = "".join(
        f" {name}={value!r}," for name, value in (("lower", constant.lower), ("upper", constant.upper))
        if abs(value) != float("inf")
    )  # fmt: skip
    none = f" none=0.0,{' per_member=True,' if each else ''}" if constant.amount else ""
    size = abs(constant.start) or 1.0
    given = f'"{constant.symbol}", "{constant.unit}", start={constant.start!r},{bounds}{none} scale={size!r}'
    head = f"    {constant.name}: Tensor = parameter("
    if len(f"{head}{given})") <= WIDTH:
        return f"{head}{given})"
    if len(f"        {given}") <= WIDTH:
        return f"{head}\n        {given}\n    )"
    each_own = given.replace(", ", ",\n        ")
    return f"{head}\n        {each_own},\n    )"


def _body(written: Written) -> str:
    place, form = written.place, written.form
    constants = {c.name: c for c in written.constants()}
    shapes = {}
    for shape in form.shapes:
        scale = written.scales[shape.place]
        own = f"p.{constants[shape.name].name}"
        shapes[shape.name] = {"x": f"({own} / {scale!r})", "1/x": f"({own} * {scale!r})", "": own}[shape.of]
    # A potential is a function of length and twist.
    codes = ("length - states.reference_length", "twist") if place.potential else [i.code for i in written.inputs]
    lines = [f"{x} = ({code}) / {scale!r}" for x, code, scale in zip("xy", codes, written.scales, strict=False)]
    terms = _terms(written, {"x": "x", "y": "y"} | shapes)
    if len(whole := f"value = {' + '.join(terms)}") <= WIDTH - 12:
        lines.append(whole)
    else:
        lines += [f"value = {terms[0]}", *(f"value = value + {term}" for term in terms[1:])]
    if place.potential:
        return place.body.format(value="\n            ".join(lines))
    return "\n".join(f"        {line}" for line in [*lines, place.body.format(value="value")])


def _terms(written: Written, names: dict[str, str]) -> list[str]:
    terms = [term.format(**names) for term in written.form.terms]
    return [f"p.{c.name} * ({t})" for c, t in zip(written.constants(), terms, strict=False)]


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
