"""Tables in Python: light, of every kind, and with faults that are said of what the user gave."""

import subprocess
import sys

import pandas as pd
import pytest
from face_runs import hidden_table

import freelearn as fl
from freelearn.api.table_files import table_file


@pytest.fixture(scope="module")
def table():
    return hidden_table()


def test_reading_a_table_and_telling_a_mistake_need_no_torch():
    code = """
import sys, freelearn as fl
assert not {"torch", "pandas", "hydra", "pydantic"} & set(sys.modules)
fl.read_table("example:dmsp_20_300.csv", bed="isometric")
assert not {"torch", "hydra", "lightning", "matplotlib"} & set(sys.modules)
for options in ({"seed": "x"}, {"effects": ["end_clamp"]}, {"ruled_out": ["end_clamp"]}, {"accuracy": 3}):
    try:
        (fl.discover if "ruled_out" in options else fl.fit)("dmsp20", **options)
    except fl.UserError as mistake:
        assert next(iter(options)) in str(mistake) or "Did you mean 'end_clamps'?" in str(mistake)
    else:
        raise AssertionError(options)
assert not {"torch", "lightning", "matplotlib"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_data_set_brings_its_bed_and_its_accuracy():
    table = fl.read_table("dmsp20")
    assert set(table["bed"]) == {"isometric"}
    assert table.attrs["accuracy"]["force_n"] == 3.0
    # Unchanged it is the data set still; a part of it is a table of its own, with the same accuracy.
    assert table_file(table, None).name == "dmsp20"
    part = table_file(table.head(60), None)
    assert (part.name, part.bed, part.accuracy["force_n"]) == ("csv", "isometric", 3.0)


def test_a_fault_of_a_data_frame_names_its_row(table):
    rows = table.head(5).set_axis(list("abcde"), axis=0).astype({"pressure_kpa": object})
    rows.loc["d", "pressure_kpa"] = "high"
    with pytest.raises(fl.UserError, match=r"(?s)The DataFrame.*row 'd', pressure_kpa: 'high'") as raised:
        fl.read_table(rows)
    assert ".csv" not in str(raised.value)


def test_a_raw_file_with_its_recipe(tmp_path):
    raw, recipe = tmp_path / "raw.csv", tmp_path / "recipe.yaml"
    raw.write_text("P [bar],F [N],M [N m]\n0,0,0\n0.5,3.5,-0.01\n")
    recipe.write_text(
        "bed: kinematic\n"
        "constants: {gamma_deg: 40, length_mm: 100, inner_radius_mm: 5, outer_radius_mm: 6.5,\n"
        "            elongation_mm: 0, twist_deg: 0}\n"
        'columns:\n  pressure_kpa: {from: "P [bar]", unit: bar}\n  force_n: {from: "F [N]", unit: N}\n'
        '  moment_nmm: {from: "M [N m]", unit: N m}\n'
    )
    table = fl.read_table(raw, recipe=recipe)
    assert table["pressure_kpa"].tolist() == [0.0, 50.0]
    assert table["moment_nmm"].tolist() == pytest.approx([0.0, -10.0])
    assert not [path for path in tmp_path.iterdir() if path not in (raw, recipe)]
    with pytest.raises(fl.UserError, match="name the file"):
        fl.read_table(table, recipe=recipe)


def test_columns_without_names_are_refused():
    with pytest.raises(fl.UserError, match="named by texts"):
        fl.read_table(pd.DataFrame([[1, 2], [3, 4]]))


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("dmsp21", "Did you mean 'dmsp20'"),
        ("nowhere.csv", "no file nowhere.csv"),
        (None, "A NoneType is no table"),
        (pd.DataFrame({"a": [1]}), r"gamma_deg: column is missing: add it, or give design=\{'gamma_deg'"),
    ],
)
def test_what_is_no_table_is_told(table, says):
    for read in (fl.read_table, fl.fit):
        with pytest.raises(fl.UserError, match=says):
            read(table)


MEMBERS = pd.DataFrame(
    {
        **{"member": [1, 2], "gamma_deg": [40.0, -40.0], "length_mm": 100.0},
        **{"inner_radius_mm": 5.0, "outer_radius_mm": 6.5},
    }
)
PAIR = pd.DataFrame(
    {
        **{"sample": 1, "step": range(6), "elongation_mm": [0.0, 0.0, 1.0, 1.0, 2.0, 2.0], "twist_deg": 0.0},
        **{"pressure_1_kpa": [0.0, 50.0] * 3, "pressure_2_kpa": [10.0, 20.0, 30.0] * 2},
        **{"force_n": [0.1, 2.0, 0.9, 2.8, 1.7, 3.7], "moment_nmm": [0.0, -9.0, 3.0, -8.0, 1.0, -7.0], "buckled": 0},
    }
)


def test_actuators_on_one_block_may_be_a_frame(tmp_path):
    MEMBERS.to_csv(tmp_path / "members.csv", index=False)
    by_file = fl.read_table(PAIR, members=tmp_path / "members.csv")
    by_frame = fl.read_table(PAIR, members=MEMBERS)
    pd.testing.assert_frame_equal(by_frame, by_file)
    options = {"model": "linear", "train": "all", "test": "all", "figures": False, "progress": False}
    fitted = fl.fit(PAIR, members=MEMBERS, **options)
    assert fitted.parameters == fl.fit(PAIR, members=tmp_path / "members.csv", **options).parameters
    # What was read brings its actuators with it.
    assert fl.fit(by_frame, **options).parameters == fitted.parameters


def test_a_fault_of_an_actuator_is_said_of_its_frame():
    wrong = MEMBERS.assign(inner_radius_mm=[5.0, -5.0])
    for read in (fl.read_table, fl.fit):
        with pytest.raises(fl.UserError, match=r"(?s)members.*row 1.*inner_radius_mm"):
            read(PAIR, members=wrong)


def test_a_frame_of_readings_alone_is_completed_as_intake_does():
    """Rows of one tube in their order: one sample, none that buckled, steps counted at each place, another visit of the
    same place counted anew."""
    rows = pd.DataFrame({"elongation_mm": [0.0, 0.0, 2.0, 2.0, 0.0], "twist_deg": 10.0})
    rows = rows.assign(pressure_kpa=[0.0, 50.0, 0.0, 50.0, 25.0], force_n=[0.0, 1.0, -1.0, 0.2, 0.5], moment_nmm=-3.0)
    tube = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    table = fl.read_table(rows, design=tube)
    assert table["step"].tolist() == [0, 1, 0, 1, 0]
    assert set(table["sample"]) == {1}
    assert set(table["buckled"]) == {0}
    assert "step" not in rows
    hung = rows.assign(force_n=[0.0, 0.0, -1.0, -1.0, -1.0], moment_nmm=0.0)
    assert fl.read_table(hung, design=tube, bed="dead_load")["step"].tolist() == [0, 1, 0, 1, 2]
    assert fl.read_table(hung.assign(bed="dead_load"), design=tube)["step"].tolist() == [0, 1, 0, 1, 2]


def test_what_a_file_lacks_is_a_fault_of_it(tmp_path):
    pd.DataFrame({"elongation_mm": [0.0, 0.0]}).to_csv(tmp_path / "mine.csv", index=False)
    with pytest.raises(fl.UserError, match=r"(?s)sample: column is missing.*buckled: column is missing"):
        fl.read_table(tmp_path / "mine.csv")
