"""docs/intake.md shows a recipe that works, and names every key that there is."""

import re

import numpy as np
from conftest import ROOT

from freelearn.data.intake.convert import convert
from freelearn.data.intake.recipes.recipe_columns import COLUMN_KEYS, TEST_KEYS
from freelearn.data.intake.recipes.recipe_file import KEYS, recipe_of
from freelearn.data.intake.recipes.recipe_parts import JOIN, READ

PAGE = (ROOT / "docs" / "intake.md").read_text(encoding="utf-8")


def test_the_example_works():
    text = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)[0]
    generator = np.random.default_rng(0)
    rows = []
    for length, twist in ((3.5, 0.0), (3.6, 0.5)):
        for pressure in (0.0, 5.0):
            for _ in range(30):
                gauge = 14.6959 + pressure + generator.normal(0, 0.01)
                volt = 0.1 + 0.02 * pressure + generator.normal(0, 0.001)
                rows.append(
                    f"{length},{twist},{gauge:.4f},{volt:.5f},{-0.01 * pressure - 0.02 * twist:.5f},1,{pressure:g},,ann"
                )
    header = "Length (in),w_rad,P_abs,F_volt,torque_Nm,valid,P_cmd,comment,operator"
    table = convert(recipe_of(text, "recipe.yaml"), {"raw.csv": "\n".join([header, *rows]).encode()}).table
    assert table["step"].tolist() == [0, 1, 0, 1]
    assert table["n_readings"].tolist() == [26] * 4
    np.testing.assert_allclose(table["elongation_mm"], [-1.6, -1.6, 0.94, 0.94], atol=1e-9)
    np.testing.assert_allclose(table["pressure_kpa"], [0, 34.47, 0, 34.47], atol=0.1)
    np.testing.assert_allclose(table["force_n"], [0, -0.1 * 12.5 * 4.448, 0, -0.1 * 12.5 * 4.448], atol=0.05)
    assert table["operator"].tolist() == ["ann"] * 4


def test_every_key_is_on_the_page():
    for key in (*KEYS, *READ, *JOIN, *COLUMN_KEYS, *TEST_KEYS):
        assert re.search(rf"`[^`]*\b{key}\b[^`]*`", PAGE), key
