"""A guess at a raw file says what its headings say, and drafts a recipe that works once it is filled in."""

import re
from pathlib import Path

import numpy as np
import pytest
from raw_files import HEADER, ROWS, raw_text

from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess
from freelearn.data.intake.guesses.recipe_text import quoted
from freelearn.data.intake.headings import heading
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.recipes.recipe_file import recipe_of
from freelearn.data.intake.template import members_template, template
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members

HEADINGS = {
    "P48_kPa": ("pressure_kpa", "kPa"),
    "F_raw_N": ("force_n", "N"),
    "dphi (rad)": ("twist_deg", "rad"),
    "Load (lbs in)": ("moment_nmm", "lbs in"),
    "Pressure (psi)": ("pressure_kpa", "psi"),
    "s_m": ("elongation_mm", "m"),
    "w_rad": ("twist_deg", "rad"),
    "Length [mm]": ("length_mm", "mm"),
    "torque_Nm": ("moment_nmm", "Nm"),
    "Force (lbf)": ("force_n", "lbf"),
    "OD_um": ("outer_diameter_mm", "um"),
    "Axial Force [N]": ("force_n", "N"),
    "P_mmHg": ("pressure_kpa", "mmHg"),
    "Temp °C": ("temperature_c", "°C"),
    "t_s": ("time_s", "s"),
    "lambda_z": ("stretch", ""),
    "contraction (%)": ("contraction", "%"),
    "Verkürzung [mm]": ("shortening", "mm"),
    "P_kPa 2": ("pressure_kpa", "kPa"),
    "F [N] [2]": ("force_n", "N"),
    "Wandstärke [mm]": ("wall", "mm"),
    "Load [kg]": ("force_n", "kg"),
    "PressureSensor (bar)": ("pressure_kpa", "bar"),
    "gamma_deg": ("gamma_deg", "deg"),
    "inner radius / mm": ("inner_radius_mm", "mm"),
}
DESIGN = {"gamma_deg": "40", "length_mm": "90", "inner_radius_mm": "4.77", "outer_radius_mm": "6.35"}


def filled(text: str) -> str:
    """A draft with its blanks filled in."""
    for name, value in DESIGN.items():
        text = re.sub(rf"{name}:   # TODO.*", f"{name}: {value}", text)
    text = re.sub(r"sample:   # TODO.*", "sample: 1", text)
    text = re.sub(
        r"(samples|constants)(:.*)\n((?:  \d+: .*\n)+)", lambda m: m[0].replace("length_mm: ", "length_mm: 90"), text
    )
    text = re.sub(r"from: (.*# TODO: from ('.*?') or)", r"from: \2\1", text)
    text = re.sub(r"  (\w+): (.*), unit: ([,}].*)the table's is (.*)\)", r"  \1: \2, unit: \4\3\4", text)
    return re.sub(r"(_\w+):   # TODO: no column says it.*", r"\1: 0", text)


@pytest.mark.parametrize("name", HEADINGS)
def test_headings(name):
    said = heading(name)
    assert (said.quantity, said.unit) == HEADINGS[name]


@pytest.mark.parametrize("name", ["Load (bolts)", "F_std", "n", "P1_cmd_Pa", "row", "kink", "valve", "x"])
def test_headings_that_say_less(name):
    assert heading(name).confidence != "sure" or heading(name).quantity is None


def test_the_guess_shows_every_column():
    found = guess(raw_text().encode(), "raw.csv")
    assert [c.name for c in found.columns] == HEADER.split(",")
    assert (found.bed, found.rows) == ("kinematic", 9)
    force = found.of("force_n")
    assert force is not None
    assert (force.low, force.high, force.example) == (-7.35, -0.11, "-0.11")


def test_a_draft_waits_to_be_filled_in_and_then_works():
    text = draft(guess(raw_text().encode(), "raw.csv"))
    with pytest.raises(UserError, match="gamma_deg is blank: fill in a number"):
        recipe_of(text, "draft.yaml")
    table = convert(recipe_of(filled(text), "draft.yaml"), {"raw.csv": raw_text().encode()}).table
    np.testing.assert_allclose(table["force_n"], [row[4] for row in ROWS])
    np.testing.assert_allclose(table["time_s"], [row[0] for row in ROWS])


NEAR = """sample,gamma_deg,length_mm,inner_radius_mm,outer_radius_mm,step,elongation_mm,twist_deg,P [bar],force_n,slack
1,40,90,4.7,6.3,0,1,10,0,1,0
1,40,90,4.7,6.3,1,1,10,0.1,1.5,0
2,40,95,4.7,6.3,0,2,20,0,1,1
2,40,95,4.7,6.3,1,2,20,0.1,3,0
"""


def test_a_draft_of_a_table_but_for_a_unit_takes_all_of_its_columns():
    text = draft(guess(NEAR.encode(), "near.csv"))
    assert "TODO" not in text
    table = convert(recipe_of(text, "draft.yaml"), {"near.csv": NEAR.encode()}).table
    assert table["length_mm"].tolist() == [90, 90, 95, 95]
    assert table["elongation_mm"].tolist() == [1, 1, 2, 2]
    assert table["pressure_kpa"].tolist() == pytest.approx([0, 10, 0, 10])
    assert table["step"].tolist() == [0, 1, 0, 1]
    assert table["slack"].tolist() == [0, 0, 1, 0]


@pytest.mark.parametrize(
    ("columns", "length", "inner"),
    [
        ("elongation_mm,length_mm,inner_radius_mm\n1,90,4\n2,90,4", "length_mm", "inner_radius_mm"),
        # A length that changes was held, and so was one that stands alone; a radius that changes is no design.
        ("elongation_mm,length_mm,inner_radius_mm\n1,91,4\n2,92,4.1", "held_length", None),
        ("force_n,length_mm,inner_radius_mm\n1,90,4\n2,90,4", "held_length", "inner_radius_mm"),
    ],
)
def test_what_a_length_and_a_radius_are(columns, length, inner):
    found = {c.name: c.quantity for c in guess(columns.encode(), "raw.csv").columns}
    assert (found["length_mm"], found["inner_radius_mm"]) == (length, inner)


UNITS = ("m", "psi", "lbf", "lbs in", "rad")


def test_a_draft_in_other_units_gives_the_same_table_back():
    other = ("m", "rad", "psi", "lbf", "lbf·in")
    own = ("mm", "deg", "kPa", "N", "N*mm")
    header = "L (m),twist [rad],P_psi,Load (lbf),Torque (lbf·in)"
    factors = [conversion(a, b).factor for a, b in zip(own, other, strict=True)]
    values = np.array(ROWS)[:, 1:]
    values = np.hstack([values[:, :1] + 90, values[:, 1:]])
    rows = "\n".join(",".join(f"{v * f:.12g}" for v, f in zip(row, factors, strict=True)) for row in values)
    content = f"{header}\n{rows}\n".encode()
    table = convert(recipe_of(filled(draft(guess(content, "raw.csv"))), "d"), {"raw.csv": content}).table
    columns = ["elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm"]
    np.testing.assert_allclose(table[columns], np.array(ROWS)[:, 1:], atol=1e-7)


def test_a_guess_from_a_path_is_that_of_its_bytes(tmp_path: Path):
    path = tmp_path / "raw.csv"
    path.write_text(raw_text())
    assert guess(path) == guess(raw_text().encode(), "raw.csv")


@pytest.mark.parametrize(
    "name", ["F_N", "Pressure (psi)", "on", "no", "null", "1", "a: b", 'a "b"', "Kraft [N]", "#1", "é"]
)
def test_names_of_columns_survive_yaml(name):
    import yaml

    assert yaml.safe_load(f"{{from: {quoted(name)}}}") == {"from": name}


def test_drafts_of_real_files_are_recipes(shared_data):
    for path in sorted(shared_data.glob("*/*.csv")):
        if path.parent.name in ("rubber", "rubber/treloar_1944"):
            continue
        found = guess(path)
        text = filled(draft(found))
        if any(c.chosen for c in found.columns if c.quantity in ("force_n", "moment_nmm", "twist_deg")):
            recipe_of(text, path.name)


@pytest.mark.parametrize("bed", BEDS)
@pytest.mark.parametrize("members", [0, 3])
def test_templates_are_tables(bed, members, tmp_path):
    path, file = tmp_path / "table.csv", tmp_path / "members.csv"
    path.write_text(template(bed, members))
    file.write_text(members_template(3))
    assert len(read_table(path, BEDS[bed], read_members(file) if members else None).table) == 1
