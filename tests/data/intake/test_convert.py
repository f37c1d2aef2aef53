"""What a recipe says becomes of the readings, in the table's units, signs and order."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import EVERY
from raw_files import HEADER, RECIPE, ROWS, raw_text, taken, taken_path

from freelearn.data.beds import NMM
from freelearn.data.intake.assemble import shared_values
from freelearn.data.intake.convert import convert
from freelearn.data.intake.laboratory_units import conversion, registry
from freelearn.data.intake.recipes.recipe_file import recipe_of

# Unit, column of the table, and how many of the table's units one is; from the definitions of inch, pound and g.
G = 9.80665
POUND = 0.45359237 * G
KNOWN = [
    ("m", "elongation_mm", 1000.0),
    ("in", "elongation_mm", 25.4),
    ("µm", "elongation_mm", 1e-3),
    ("um", "elongation_mm", 1e-3),
    ("rad", "twist_deg", 180 / math.pi),
    ("turn", "twist_deg", 360.0),
    ("°", "twist_deg", 1.0),
    ("psi", "pressure_kpa", POUND / 0.0254**2 / 1000),
    ("bar", "pressure_kpa", 100.0),
    ("mbar", "pressure_kpa", 0.1),
    ("Pa", "pressure_kpa", 1e-3),
    ("MPa", "pressure_kpa", 1000.0),
    ("mmHg", "pressure_kpa", 13.5951 * G / 1000),
    ("lbf", "force_n", POUND),
    ("lbs", "force_n", POUND),
    ("kg", "force_n", G),
    ("g", "force_n", G / 1000),
    ("mN", "force_n", 1e-3),
    ("lbs in", "moment_nmm", POUND * 25.4),
    ("in-lb", "moment_nmm", POUND * 25.4),
    ("ft-lbs", "moment_nmm", POUND * 304.8),
    ("Nm", "moment_nmm", 1000.0),
    ("N·m", "moment_nmm", 1000.0),
    ("N m", "moment_nmm", 1000.0),
    ("N-mm", "moment_nmm", 1.0),
    ("mNm", "moment_nmm", 1.0),
    ("Ncm", "moment_nmm", 10.0),
    ("ms", "time_s", 1e-3),
    ("min", "time_s", 60.0),
]


def made(recipe: str, text: str = "") -> pd.DataFrame:
    return convert(recipe_of(recipe, "recipe.yaml"), {"raw.csv": (text or raw_text()).encode()}).table


def changed(old: str, new: str) -> str:
    assert old in RECIPE
    return RECIPE.replace(old, new)


@pytest.mark.parametrize(("unit", "column", "factor"), KNOWN)
def test_units(unit, column, factor):
    recipe = changed("columns:", f"columns:\n  {column}: {{from: t_s, unit: {json.dumps(unit)}}}")
    lines = [line for line in recipe.splitlines() if not (line.startswith(f"  {column}:") and "t_s" not in line)]
    table = made("\n".join(lines))
    np.testing.assert_allclose(table[column], factor * np.arange(9.0), rtol=2e-6)


def test_a_temperature_has_another_zero():
    table = made(changed("columns:", "columns:\n  temperature_c: {from: t_s, unit: degF}"))
    np.testing.assert_allclose(table["temperature_c"], (np.arange(9.0) - 32) / 1.8)


@given(
    st.sampled_from([(unit, column) for unit, column, _ in KNOWN]),
    st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=1, max_size=20),
)
def test_there_and_back_again(unit_and_column, values):
    unit, column = unit_and_column
    wanted = {"moment_nmm": "N*mm", "force_n": "N", "time_s": "s", "twist_deg": "deg", "pressure_kpa": "kPa"}
    there, back = (conversion(*pair) for pair in ((unit, wanted.get(column, "mm")), (wanted.get(column, "mm"), unit)))
    converted = there.factor * np.array(values) + there.shift
    np.testing.assert_allclose(back.factor * converted + back.shift, values, rtol=1e-12, atol=1e-9)


@settings(max_examples=100 if EVERY else 25)
@given(
    sign=st.sampled_from([1, -1]),
    scale=st.floats(0.01, 100),
    offset=st.floats(-50, 50),
    unit=st.sampled_from(["N", "lbf", "mN", "kN"]),
)
def test_a_reading_is_recovered_from_the_table(sign, scale, offset, unit):
    spec = f"unit: {unit}, sign: {sign}, scale: {scale!r}, offset: {offset!r}}}"
    table = made(changed("unit: N}", spec))
    per_unit = float(registry().Quantity(1.0, {"lbf": "lbf"}.get(unit, unit)).to("N").magnitude)
    recovered = sign * table["force_n"] / per_unit / scale + offset
    np.testing.assert_allclose(recovered, [row[4] for row in ROWS], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "spec",
    [
        "{from: L_m, unit: m, minus: length_mm}",
        "{from: stretch, times: length_mm, minus: length_mm}",
        "{from: contraction, unit: percent, times: length_mm, sign: -1}",
        "{from: L_m, unit: m, minus: {from: rest_in, unit: in}}",
        "{from: L_m, unit: m, minus: [{from: rest_in, unit: in}, 10], plus: 10}",
    ],
)
def test_lengths_stretches_and_contractions_become_elongations(spec):
    rows = "L_m,stretch,contraction,rest_in\n" + "".join(
        f"{0.09 * x},{x},{100 * (1 - x):.9f},{90 / 25.4}\n" for x in (1.0, 1.05, 0.9)
    )
    recipe = f"""\
bed: isometric
constants: {{gamma_deg: 20, length_mm: 90, inner_radius_mm: 4, outer_radius_mm: 5, twist_deg: 0, pressure_kpa: 30}}
columns:
  force_n: {{from: stretch, unit: N}}
  elongation_mm: {spec}
"""
    np.testing.assert_allclose(made(recipe, rows)["elongation_mm"], [0.0, 4.5, -9.0], atol=1e-6)


def test_thrust_of_the_pressure_on_a_circle():
    table = made(changed("unit: N}", "unit: N, plus: {pressure_on: inner_radius_mm}}"))
    thrust = math.pi * 0.00477**2 * 1000 * np.array([row[3] for row in ROWS])
    np.testing.assert_allclose(table["force_n"], np.array([row[4] for row in ROWS]) + thrust)


def test_readings_at_rest_are_taken_off():
    rows = np.array(ROWS)
    first = made(changed("unit: N}", "unit: N, offset: rest}") + "rest: first\n")
    np.testing.assert_allclose(first["force_n"], rows[:, 4] - rows[0, 4])
    vented = made(changed("unit: N}", "unit: N, offset: rest}") + "rest: {pressure_kpa: {below: 1}}\n")
    np.testing.assert_allclose(vented["force_n"], rows[:, 4] - rows[[0, 3, 6], 4].mean())


def test_blanks_fills_marks_and_rows():
    table = made(
        changed("unit: N}", "unit: N, blank_where: {P_kPa: 0}}")
        + "slack: {moment_nmm: {above: 0}}\nbuckled: {P_kPa: {above: 60}}\n"
        "drop: [{t_s: 8}, {t_s: {above: 6.5, below: 7.5}}]\n"
    )
    assert len(table) == 7
    assert table["force_n"].isna().tolist() == [True, False, False, True, False, False, True]
    assert table["slack"].tolist() == [1, 0, 0, 1, 0, 0, 0]
    assert table["buckled"].tolist() == [0, 0, 1, 0, 0, 1, 0]
    kept = made(RECIPE + "keep: {phi_deg: {is_not: 20}, F_N: {blank: false}}\n")
    assert len(kept) == 6
    blank = raw_text().replace("31.3,", ",")
    filled = made(changed("unit: kPa}", "unit: kPa, fill: 31}"), blank)
    assert filled["pressure_kpa"].tolist()[7] == 31


def test_steps():
    assert made(RECIPE)["step"].tolist() == [0, 1, 2, 0, 1, 2, 0, 1, 2]
    assert made(RECIPE + "step: {state: [twist_deg]}\n")["step"].tolist() == [0, 1, 2, 3, 4, 5, 0, 1, 2]
    assert made(RECIPE + "step: each_row\n")["step"].tolist() == [0] * 9
    assert made(RECIPE + "step: {from: t_s}\n")["step"].tolist() == list(range(9))
    again = raw_text() + "\n".join(raw_text().splitlines()[7:]).replace("9\n", "9\n") + "\n"
    assert made(RECIPE, again)["step"].tolist() == [0, 1, 2, 0, 1, 2, 0, 1, 2, 3, 4, 5]
    assert made(RECIPE + "step: {new_state_on: [P_kPa]}\n")["step"].tolist() == [0] * 9


def test_under_a_dead_load_a_state_is_a_load():
    recipe = """\
bed: dead_load
constants: {gamma_deg: 40, length_mm: 90, inner_radius_mm: 4.77, outer_radius_mm: 6.35, force_n: 0}
columns:
  elongation_mm: {from: dl_mm, unit: mm}
  twist_deg: {from: phi_deg, unit: deg}
  pressure_kpa: {from: P_kPa, unit: kPa}
  moment_nmm: {from: hung, unit: N·m, scale: 1.5}
"""
    rows = "dl_mm,phi_deg,P_kPa,hung\n0,1,0,1\n1,2,5,1\n,4,9,1\n1,3,0,2\n2,9,5,2\n"
    table = made(recipe, rows)
    assert table["step"].tolist() == [0, 1, 2, 0, 1]
    assert table["moment_nmm"].tolist() == [1500, 1500, 1500, 3000, 3000]
    assert np.isnan(table["elongation_mm"][2])


def test_states_that_jitter_are_joined():
    # Further than an encoder flickers.
    text = raw_text().replace(",2.5,", ",2.45,", 1).replace("5.0,2.5,", "5.0,2.55,")
    assert made(RECIPE, text)["step"].tolist() == [0, 1, 2, 0, 0, 0, 0, 1, 2]
    joined = made(RECIPE + "state_tolerance: {elongation_mm: 0.1}\n", text)
    assert joined["step"].tolist() == [0, 1, 2, 0, 1, 2, 0, 1, 2]
    assert joined["elongation_mm"].nunique() == 2
    with pytest.raises(Exception, match="choose a smaller one"):
        shared_values(np.arange(0, 10, 0.5), 0.6, "elongation_mm")


def test_order_and_carried_columns():
    table = made(RECIPE + "order_by: [phi_deg, F_N]\ncarry: [t_s]\n")
    assert table["t_s"].astype(float).tolist() == [5, 4, 2, 3, 1, 0, 8, 7, 6]


def test_samples_by_words_numbers_and_files():
    text = raw_text(HEADER.replace("t_s", "who"))
    for old, new in zip([row[0] for row in ROWS], ["a"] * 6 + ["b"] * 3, strict=True):
        text = text.replace(f"\n{old},", f"\n{new},")
    recipe = changed("gamma_deg: 40, ", "")
    recipe += (
        "sample: {from: who, as: {a: 2, b: 5}}\nsamples: {2: {gamma_deg: 30}, 5: {gamma_deg: {value: -1, unit: rad}}}\n"
    )
    table = made(recipe, text)
    assert table["sample"].tolist() == [2] * 6 + [5] * 3
    assert table["gamma_deg"].round(3).tolist() == [30] * 6 + [-57.296] * 3

    files = changed("gamma_deg: 40, ", "") + "files:\n  - {name: a.csv, sample: 1, constants: {gamma_deg: 20}}\n"
    files += "  - {name: b.csv, sample: 2, constants: {gamma_deg: 60}, drop: {t_s: 0}}\n"
    both = convert(recipe_of(files, "r"), {"a.csv": raw_text().encode(), "b.csv": raw_text().encode()})
    assert both.table.groupby("sample")["gamma_deg"].first().tolist() == [20, 60]
    assert len(both.table) == 17
    assert [file["dropped"] for file in both.files] == [0, 1]
    assert both.lines[9] == ("b.csv", 3)


def test_members_of_an_end_block():
    recipe = changed("  pressure_kpa: {from: P_kPa, unit: kPa}\n", "").replace("gamma_deg: 40, ", "")
    recipe += "members:\n  - {pressure: {from: P_kPa, unit: kPa}, gamma_deg: 48}\n"
    recipe += "  - {pressure: {from: t_s, unit: psi}, gamma_deg: -48, outer_radius_mm: 7}\n"
    intake = convert(recipe_of(recipe, "r"), {"raw.csv": raw_text().encode()})
    assert list(intake.table)[:5] == ["sample", "step", "elongation_mm", "twist_deg", "pressure_1_kpa"]
    assert "gamma_deg" not in intake.table
    assert intake.table["pressure_2_kpa"][1] == pytest.approx(6.894757)
    assert intake.members is not None
    assert intake.members["gamma_deg"].tolist() == [48, -48]
    assert intake.members["outer_radius_mm"].tolist() == [6.35, 7]
    assert intake.members["gamma2_deg"].isna().all()


def test_the_contracts_columns_in_its_order(tmp_path):
    table, warnings = taken(tmp_path, raw_text())
    assert ",".join(table.columns) == (
        "sample,gamma_deg,length_mm,inner_radius_mm,outer_radius_mm,step,elongation_mm,twist_deg,pressure_kpa,force_n,"
        "moment_nmm,buckled"
    )
    np.testing.assert_allclose(
        table[["elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm"]], np.array(ROWS)[:, 1:]
    )
    assert warnings == []


def test_provenance_tells_every_conversion(tmp_path):
    taken(tmp_path, raw_text(), changed("unit: N}", "unit: lbf, sign: -1, offset: 0.5}") + "drop: {t_s: 8}\n")
    told = json.loads((tmp_path / "out" / "table_provenance.json").read_text())
    (file,) = told["files"]
    assert (file["rows"], file["dropped"], file["table_rows"]) == (9, 1, 8)
    force = file["columns"]["force_n"]
    assert force["factor"] == pytest.approx(POUND)
    assert (force["from"], force["unit"], force["to"], force["sign"], force["offset"]) == ("F_N", "lbf", "N", -1, 0.5)
    assert told["constants"]["gamma_deg"] == 40
    assert told["recipe"]["content"].startswith("bed: kinematic")
    assert len(told["raw"][0]["sha256"]) == 64
    assert NMM == 1e-3


def test_provenance_tells_each_files_constants_though_one_name_ends_as_another(tmp_path):
    angles = {"1.csv": 20.0, "11.csv": 30.0}
    (tmp_path / "raw").mkdir()
    for name in angles:
        (tmp_path / "raw" / name).write_text(raw_text())
    listed = [
        f"  - {{name: {n}, sample: {i}, constants: {{gamma_deg: {g}}}}}"
        for i, (n, g) in enumerate(angles.items(), start=1)
    ]
    taken_path(tmp_path, tmp_path / "raw", changed("gamma_deg: 40, ", "") + "\n".join(["files:", *listed, ""]))
    told = json.loads((tmp_path / "out" / "table_provenance.json").read_text())
    assert {file["file"]: file["constants"]["gamma_deg"] for file in told["files"]} == angles
