"""docs/parameters.md says what the classes declare."""

import re

import pytest
from conftest import ROOT

from freelearn.physics.models.build import build_model
from freelearn.physics.models.stated_knowledge import stated
from freelearn.testing.parameter_page import declared_table, material_table, with_tables

PAGE = (ROOT / "docs/parameters.md").read_text(encoding="utf-8")


def test_its_tables_are_made_from_the_classes():
    assert declared_table() in PAGE, "run python -m freelearn.testing.parameter_page docs/parameters.md"
    assert material_table() in PAGE
    assert with_tables(PAGE) == PAGE


def test_its_python_runs():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert "build_model" in code
    assert "stated" in code
    found = {}
    exec(code, found)
    assert found["model"].beforehand() == {"C1": "1.2e+06 ± 2e+05", "C2": "fixed"}
    assert found["model"].scalars() == pytest.approx({"C1": 1.2e6, "C2": 3e7})
    assert build_model("continuum", known=stated("continuum")).beforehand() == {}
