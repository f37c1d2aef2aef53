"""The tables of docs/parameters.md, made from the classes: `python -m freelearn.testing.parameter_page FILE`."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

from freelearn.physics.chain.material import MATERIALS
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.effect_page import in_library

DECLARED = """| parameter | unit | middle | deviation | plausible | known from |
|---|---|---|---|---|---|
"""
STOCK = """| `material=` | C1 in kPa | ×÷ | known from |
|---|---|---|---|
"""


def with_tables(page: str) -> str:
    """The page with the tables as they are now, each between its name and an end, in comments."""
    for name, table in (("declared", declared_table()), ("materials", material_table())):
        between = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        page = between.sub(lambda found, table=table: f"{found[1]}{table}{found[2]}", page)  # type: ignore[misc]
    return page


def declared_table() -> str:
    """One row for each parameter of the continuum model and of every effect of the library."""
    all_of = [(p.name, p) for p in Continuum.parameter_class.records()]
    library = [(name, effect) for name, effect in EFFECTS.items() if in_library(effect)]
    all_of += [(f"{name}.{p.name}", p) for name, effect in library for p in effect.declared_parameters()]
    return DECLARED + "".join(_row(name, p) for name, p in all_of)


def material_table() -> str:
    """One row for each material."""
    rows = [
        f"| `{name}` | {stock.C1 / 1e3:.3g} | {math.exp(stock.deviation):.2g} | {stock.source} |\n"
        for name, stock in MATERIALS.items()
    ]
    return STOCK + "".join(rows)


def _row(name: str, p: Parameter) -> str:
    prior, unit, of = p.known, p.unit, ""
    ends = p.plausible({})
    if prior.of:
        # A share of the largest load, or of that in a second.
        unit, of = ("1/s" if p.unit.endswith("/s") else "1"), f" of the {prior.of}"
        ends = prior.middle - p.far * prior.deviation, prior.middle + p.far * prior.deviation
        if p.log:
            factor = math.exp(p.far * prior.deviation)
            ends = prior.middle / factor, prior.middle * factor
    deviation = f"×÷ {math.exp(prior.deviation):.2g}" if p.log else f"{prior.deviation:.3g}{of}"
    shown = f"{ends[0]:.2g} … {ends[1]:.2g}"
    return f"| `{name}` | {unit} | {prior.middle:.3g} | {deviation} | {shown} | {prior.source} |\n"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
