"""Which tables are suspected of another unit: blood vessels and measured sets are not, inches and psi always are."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from scipy.linalg import lstsq

from freelearn.data.beds import BEDS
from freelearn.data.intake.convert import convert
from freelearn.data.intake.readers.raw_files import read_sources
from freelearn.data.intake.recipes.recipe_file import recipe_of
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members
from freelearn.data.table.unit_suspicions import UnitWarning, _rise, unit_warnings
from freelearn.testing.reference.other_beds import measure, nominal
from freelearn.testing.small_tables import visits

RECIPES = ROOT / "experiments/recipes"
INCH, PSI = 25.4, 6.894757
LENGTHS = ["length_mm", "inner_radius_mm", "outer_radius_mm", "elongation_mm", "outer_diameter_mm"]
REAL = {
    "dmsp_20_300": "braided_muscles/dmsp_20_300.csv",
    "festo_10mm": "braided_muscles/festo_10mm_isometric.csv",
    "free70_single": "free70_single/raw.csv",
    "parallel_3": "parallel_3/plateaus_test9.csv",
    "parallel_free_end": "parallel_free_end/steps.csv",
    "torsion_4angles": "torsion_4angles",
    "vessels": "vessels/inflation_extension.csv",
}
# A moment that rises with the twist, where no pressure turns the tube.
TRULY = {"free70_single": ["moment_nmm may have its sign turned"]}


def inflated(length: float, inner: float, outer: float, highest: float, stretches=(0.05, 0.15, 0.25)) -> pd.DataFrame:
    """A tube with two families of fibers, held at some stretches and inflated; sizes in mm, pressure in kPa."""
    table = visits(count=3, samples=(3,)).assign(
        gamma_deg=45.0, gamma2_deg=-45.0, twist_deg=0.0, buckled=0, bed="inflation"
    )
    table["elongation_mm"] = length * np.repeat(stretches, 4)
    table["pressure_kpa"] = np.tile(np.linspace(0, highest, 4), 3)
    sizes = {"length_mm": length, "inner_radius_mm": inner, "outer_radius_mm": outer}
    swollen = 2 * outer * (0.95 + 0.4 * table["pressure_kpa"] / highest)
    return table.assign(**sizes, outer_diameter_mm=swollen, force_n=-0.02 * np.arange(12))


CAROTID = {"a mouse's carotid": (6.0, 0.24, 0.3, 20.0)}
VESSEL = {"a mouse's": (4.5, 1.9, 2.7, 3.4), "a rat's": (9.0, 0.8, 1.1, 12.0), "an artery's": (15.0, 2.5, 4.2, 11.0)}


@pytest.mark.parametrize("sizes", (VESSEL | CAROTID).values(), ids=VESSEL | CAROTID)
def test_a_vessel_is_what_it_is(sizes):
    assert unit_warnings(inflated(*sizes)) == []


@pytest.mark.parametrize("sizes", (VESSEL | CAROTID).values(), ids=VESSEL | CAROTID)
def test_a_vessel_in_inches_or_meters_is_suspected(sizes):
    for factor in (INCH, 1000):
        table = inflated(*sizes)
        table[LENGTHS] /= factor
        assert any("length_mm" in w or "radius_mm" in w for w in unit_warnings(table)), factor


ACTUATOR = (98.42, 4.77, 6.74, 72.5, (-0.05, 0.0, 0.05))


def test_an_actuator_whose_diameter_is_measured_is_no_vessel():
    """On the vessels' bed as on every other: a length in inches or centimeters, all in inches, a pressure in psi."""
    assert unit_warnings(inflated(*ACTUATOR)) == []
    for factor in (INCH, 10):
        table = inflated(*ACTUATOR)
        table["length_mm"] /= factor
        assert any("length_mm may be in inches or centimeters" in w for w in unit_warnings(table)), factor
    table = inflated(*ACTUATOR)
    table[LENGTHS] /= INCH
    assert any("radius_mm may be in inches" in w for w in unit_warnings(table))
    table = inflated(*ACTUATOR)
    table["pressure_kpa"] /= PSI
    (warning,) = unit_warnings(table)
    assert "pressure_kpa may be in psi" in warning
    assert isinstance(warning, UnitWarning)


def test_a_thin_actuator_in_inches_is_no_vessel():
    """2.5 mm wide like a vessel; its elongation, in mm, is longer than its length in inches."""
    table = inflated(110.0, 1.9, 2.5, 100.0, (0.02, 0.05, 0.1))
    table["length_mm"] /= INCH
    assert any("length_mm may be in inches" in w for w in unit_warnings(table))
    # And without a diameter nothing speaks for a vessel.
    table = inflated(*VESSEL["a mouse's"]).drop(columns="outer_diameter_mm").assign(bed="isometric")
    assert len(unit_warnings(table)) == 2


@pytest.mark.parametrize("name", REAL)
def test_measured_sets_are_not_suspected(name: str, shared_data: Path, tmp_path: Path):
    """Through intake and as train reads it: what is said of them is true, and none of it is about units."""
    recipe = recipe_of((RECIPES / f"{name}.yaml").read_text(encoding="utf-8"), name)
    made = convert(recipe, read_sources(shared_data / REAL[name], recipe))
    said = [warning for warning in made.warnings if isinstance(warning, UnitWarning) or "gauge" in warning]
    assert [warning.split(":")[0] for warning in said] == TRULY.get(name, [])
    made.table.to_csv(tmp_path / "table.csv", index=False)
    members = None
    if made.members is not None:
        made.members.to_csv(tmp_path / "members.csv", index=False)
        members = read_members(tmp_path / "members.csv")
    assert read_table(tmp_path / "table.csv", BEDS[recipe.bed], members).warnings == said


@pytest.mark.parametrize(
    ("column", "factor", "says"), [("length_mm", 25.4, "meters"), ("pressure_kpa", 1e-3, "pascals")]
)
def test_the_measured_vessels_in_other_units_are_suspected(column, factor, says, shared_data: Path):
    recipe = recipe_of((RECIPES / "vessels.yaml").read_text(encoding="utf-8"), "vessels")
    table = convert(recipe, read_sources(shared_data / REAL["vessels"], recipe)).table.assign(bed="inflation")
    table[column] /= factor
    assert any(column in w and says in w for w in unit_warnings(table))


@pytest.mark.parametrize("turned", [(), ("force_n",), ("moment_nmm",), ("force_n", "moment_nmm")])
@pytest.mark.parametrize("gamma", [25.0, -40.0, 62.0])
def test_a_tube_that_would_drive_itself_on_has_a_sign_turned(gamma, turned):
    """By the textbook's loads: whatever the fibers, a tube without pressure is a spring."""
    generator = np.random.default_rng(int(abs(gamma)))
    places = generator.uniform([-4, -60], [4, 60], (20, 2))
    table = nominal("kinematic", {1: (gamma, np.nan, 98.42, 4.77, 6.74)}, places, np.array([0.0, 30.0, 60.0]))
    table = measure("kinematic", table, 8e5, 2e7, {}, 1)
    for column in turned:
        table[column] *= -1
    said = [w for w in unit_warnings(table) if "sign turned" in w]
    assert [w.split()[0] for w in said] == list(turned)
    assert all(isinstance(w, UnitWarning) for w in said)


def test_tubes_that_hang_loose_and_few_rows_say_nothing_of_signs():
    table = visits(count=3, samples=(3,)).assign(buckled=0, moment_nmm=0.0)
    rising = table.assign(force_n=table["elongation_mm"], pressure_kpa=0.0)
    assert any("force_n may have its sign turned" in w for w in unit_warnings(rising))
    assert not any("sign" in w for w in unit_warnings(rising.assign(slack=1)))
    assert not any("sign" in w for w in unit_warnings(rising[:7]))


def test_a_twist_that_is_held_at_zero_is_not_in_radians():
    """An encoder reads some hundredths of a degree; places in radians stay for the rows of a state."""
    noise = np.random.default_rng(2)
    table = (
        inflated(110.0, 6.0, 7.5, 100.0, (0.02, 0.05, 0.1)).drop(columns="outer_diameter_mm").assign(bed="isometric")
    )
    many = pd.concat([table] * (1 + 60 // len(table)), ignore_index=True)
    held = many.assign(twist_deg=noise.normal(0, 0.05, len(many)), step=np.arange(len(many)))
    assert not [w for w in unit_warnings(held) if "radians" in w]
    turned = held.assign(twist_deg=np.repeat(noise.uniform(-0.25, 0.25, len(many)), 5)[: len(many)])
    assert [w for w in unit_warnings(turned) if "radians" in w]


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e-3, "outer_diameter_mm may be in meters (largest 0.01755): in mm it would be 17.55."),
        (1 / INCH, "outer_diameter_mm may be in inches (largest 0.6909): in mm it would be 17.55."),
        (1e3, "outer_diameter_mm may be in micrometers (largest 1.755e+04): in mm it would be 17.55."),
        (0.4, "outer_diameter_mm may be a radius (largest 7.02 beside an unloaded diameter of 13): give the diameter."),
        (1.0, None),
    ],
)
def test_a_diameter_of_an_actuator_in_another_unit_is_suspected(factor, said):
    """Swollen to 1.35 times the 13 mm that it has unloaded."""
    table = inflated(100.0, 5.0, 6.5, 200.0)
    table["outer_diameter_mm"] *= factor
    told = [warning for warning in unit_warnings(table) if "outer_diameter_mm" in warning]
    assert told == ([] if said is None else [said])


def test_a_load_that_rises_does_so_by_the_t_value_of_a_regression():
    """Of a regression with a level for each sample and the other place beside, by SciPy's least squares."""
    generator = np.random.default_rng(3)
    sample = np.repeat([1, 2, 3], 9)
    rows = pd.DataFrame(
        {"force_n": 0.0, "elongation_mm": generator.normal(size=27), "twist_deg": generator.normal(size=27)}
    )
    rows["sample"] = sample
    rows["force_n"] = sample + 0.3 * rows["elongation_mm"] - 2.0 * rows["twist_deg"] + generator.normal(size=27)
    levels = (sample[:, None] == [1, 2, 3]).astype(float)
    design = np.column_stack([rows[["elongation_mm", "twist_deg"]], levels])
    solved = lstsq(design, rows["force_n"])
    left = float(((rows["force_n"] - design @ solved[0]) ** 2).sum()) / (27 - 5)
    error = (left * np.linalg.inv(design.T @ design)[0, 0]) ** 0.5
    assert _rise(rows) == pytest.approx(solved[0][0] / error, rel=1e-9)
