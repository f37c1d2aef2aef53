"""What a laboratory's file asks of a fitted run becomes a table of questions."""

import numpy as np
import pandas as pd
import pytest

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.column_questions import said
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.typed_answers import answer
from freelearn.data.intake.guesses.wanted import (
    Actuators,
    parse_wanted,
    questions_table,
    wanted_draft,
    wanted_questions,
)
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.recipes.recipe_file import content_of

DESIGN = {"gamma_deg": 27.0, "length_mm": 300.0, "inner_radius_mm": 10.0, "outer_radius_mm": 11.5}
MUSCLE = Actuators({1: DESIGN}, 0, {"twist_deg": 0.0})
LENGTH = np.array([300.0, 290.0, 280.0])


def asked(content, known, answers=()):
    """The table of questions, and what was asked."""
    raw = raw_table(content.encode(), "a.csv")
    made, keys, given = {}, [], dict(answers)
    while True:
        found = guess_table(raw, said(guess_table(raw), made))
        question = next((q for q in wanted_questions(found, known, made) if q.key not in made), None)
        if question is None:
            break
        keys.append(question.key)
        made[question.key] = answer(question, given.get(question.key, ""), made)
    recipe = wanted_draft(found, known, made)
    return questions_table(parse_wanted(content_of(recipe, "r"), "r"), raw, known), keys


def text(header, *columns):
    return "\n".join([header, *(";".join(f"{v:g}" for v in row) for row in zip(*columns, strict=True)), ""])


def test_the_pressures_of_a_trajectory():
    content = text("Zeit [s];Länge [cm];Zugkraft [N]", [0, 1, 2], LENGTH / 10, [100, 200, 300])
    table, keys = asked(content, MUSCLE, {"sign.Zugkraft [N]": "y"})
    assert keys == ["given.twist_deg", "given.pressure_kpa", "given.moment_nmm", "sign.Zugkraft [N]"]
    assert table.columns.tolist() == ["sample", "time_s", "elongation_mm", "twist_deg", "force_n"]
    assert table["elongation_mm"].tolist() == [0, -10, -20]
    assert table["force_n"].tolist() == [-100, -200, -300]
    assert table["twist_deg"].tolist() == [0, 0, 0]


def test_the_pressures_of_three_actuators_for_a_pose():
    block = Actuators({1: {}}, 3, {})
    table, keys = asked(text("z_mm;phi_deg", [0, 1], [0, 10]), block, {"given.force_n": "0", "given.moment_nmm": "0"})
    assert [key for key in keys if "pressure" in key] == [f"given.pressure_{n}_kpa" for n in (1, 2, 3)]
    assert table.columns.tolist() == ["sample", "elongation_mm", "twist_deg", "force_n", "moment_nmm"]
    one = text("z_mm;phi_deg;P1_bar;P2_bar", [0, 1], [0, 10], [1, 2], [2, 3])
    table, keys = asked(one, block, {"given.force_n": "0", "given.moment_nmm": "0"})
    assert table["pressure_2_kpa"].tolist() == [200, 300]
    assert "given.pressure_3_kpa" in keys


def test_loads_at_a_pressure_and_columns_that_no_heading_explains():
    content = text("Kanal 7;Druck [bar]", LENGTH, [0, 1, 2])
    answers = {"what.Kanal 7": "held length", "unit.Kanal 7": "mm", "given.force_n": "?"}
    table, _ = asked(content, MUSCLE, answers)
    assert table["pressure_kpa"].tolist() == [0, 100, 200]
    assert "force_n" not in table


def test_of_several_actuators_one_is_meant():
    two = Actuators({1: DESIGN, 2: DESIGN | {"length_mm": 200.0}}, 0, {"twist_deg": 0.0})
    content = text("Länge [mm];Kraft [N]", LENGTH, [1, 2, 3])
    table, keys = asked(content, two, {"sample": "2", "sign.Kraft [N]": "n"})
    assert "sample" in keys
    assert set(table["sample"]) == {2}
    assert table["elongation_mm"].tolist() == [100, 90, 80]
    raw = raw_table(content.encode(), "a.csv")
    recipe = "sample: 5\ncolumns: {elongation_mm: {from: 'Länge [mm]', unit: mm, minus: length_mm}}\nasks: [force_n]"
    with pytest.raises(UserError, match="knows no sample 5"):
        questions_table(parse_wanted(content_of(recipe, "r"), "r"), raw, two)


def test_what_a_run_knows():
    rows = pd.DataFrame({"sample": [1, 1, 2], **{k: [v] * 3 for k, v in DESIGN.items()}, "twist_deg": [0.0] * 3})
    rows = rows.assign(elongation_mm=[0, 1, 2], pressure_kpa=1.0)
    known = Actuators.from_table(rows)
    assert (known.members, known.held, sorted(known.designs)) == (0, {"twist_deg": 0.0}, [1, 2])
    assert known.designs[2] == DESIGN
