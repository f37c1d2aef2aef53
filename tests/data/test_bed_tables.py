"""Tables of every bed and of end blocks: which columns each needs, what may be blank, and what is refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.common.errors import UserError
from freelearn.data.beds import BED, BEDS
from freelearn.data.rows import Readings
from freelearn.data.states import States
from freelearn.data.table.faults import TableError
from freelearn.data.table.measurement_table import TableFile, read_table
from freelearn.data.table.members_table import read_members
from freelearn.physics.chain.prediction import predicted_table
from freelearn.physics.models.build import build_model
from freelearn.testing.small_tables import random_table, visits

IMPOSED = {
    "kinematic": ("elongation_mm", "twist_deg"),
    "isometric": ("elongation_mm", "twist_deg"),
    "dead_load": ("force_n", "moment_nmm"),
    "inflation": ("elongation_mm", "twist_deg"),
}
MEASURED = {
    "kinematic": ("force_n", "moment_nmm"),
    "isometric": ("force_n",),
    "dead_load": ("elongation_mm", "twist_deg"),
    "inflation": ("outer_diameter_mm", "force_n"),
}


def valid(bed: str) -> pd.DataFrame:
    table = visits(count=3).assign(buckled=0)
    rows = np.arange(len(table), dtype=float)
    table = table.assign(force_n=0.5 + 0.1 * rows, moment_nmm=3.0 - 0.7 * rows, outer_diameter_mm=13 + 0.01 * rows)
    return table[[c for c in table if c not in ("force_n", "moment_nmm", "outer_diameter_mm")
                  or c in IMPOSED[bed] + MEASURED[bed]]]  # fmt: skip


def read(table: pd.DataFrame, folder: Path, bed: str = "kinematic", members: pd.DataFrame | None = None) -> TableFile:
    file = folder / "table.csv"
    table.to_csv(file, index=False)
    return read_table(file, BEDS[bed], members)


def faults(table: pd.DataFrame, folder: Path, bed: str = "kinematic", members: pd.DataFrame | None = None):
    with pytest.raises(TableError) as caught:
        read(table, folder, bed, members)
    return [(fault.line, fault.column, fault.problem) for fault in caught.value.faults]


@pytest.mark.parametrize("bed", BEDS)
def test_a_table_of_each_bed_is_read(bed, tmp_path):
    found = read(valid(bed), tmp_path, bed)
    assert found.warnings == []
    assert Readings.from_table(found.table).present.sum() == len(found.table) * len(MEASURED[bed])
    assert States.from_table(found.table).bed is BEDS[bed]


@pytest.mark.parametrize(("bed", "column"), [(b, c) for b in IMPOSED for c in (*IMPOSED[b], "pressure_kpa")])
def test_what_is_imposed_may_be_neither_absent_nor_blank(bed, column, tmp_path):
    assert (1, column) in [f[:2] for f in faults(valid(bed).drop(columns=column), tmp_path, bed)]
    blank = valid(bed)
    blank.loc[4, column] = np.nan
    (fault,) = faults(blank, tmp_path, bed)
    assert fault[:2] == (6, column)
    assert "blank" in fault[2]


@pytest.mark.parametrize(("bed", "column"), [(b, c) for b in MEASURED for c in MEASURED[b]])
def test_what_is_measured_may_be_blank(bed, column, tmp_path):
    table = valid(bed)
    table.loc[[1, 4], column] = np.nan
    found = read(table, tmp_path, bed)
    assert found.table[column].isna().to_numpy().nonzero()[0].tolist() == [1, 4]
    assert found.warnings == []


@pytest.mark.parametrize(("bed", "column"), [(b, c) for b in MEASURED if b != "isometric" for c in MEASURED[b]])
def test_an_absent_measured_column_is_a_warning(bed, column, tmp_path):
    found = read(valid(bed).drop(columns=column), tmp_path, bed)
    (warning,) = found.warnings
    assert column in warning
    assert not Readings.from_table(found.table).plain


@pytest.mark.parametrize("bed", BEDS)
def test_without_any_measured_column_the_table_is_refused(bed, tmp_path):
    columns = list(MEASURED[bed])
    found = faults(valid(bed).drop(columns=columns), tmp_path, bed)
    assert sorted(f[1] for f in found) == sorted(columns)


@pytest.mark.parametrize("bed", BEDS)
def test_without_any_reading_the_table_is_refused(bed, tmp_path):
    table = valid(bed).assign(**dict.fromkeys(MEASURED[bed], np.nan))
    with pytest.raises(UserError, match="no reading"):
        read(table, tmp_path, bed)


@pytest.mark.parametrize(
    ("wrong", "right"), [("Force_N", "force_n"), ("moment_nm", "moment_nmm"), ("force", "force_n")]
)
def test_a_measured_column_that_is_nearly_named_so_is_a_fault(wrong, right, tmp_path):
    (fault,) = faults(valid("kinematic").rename(columns={right: wrong}), tmp_path)
    assert fault[:2] == (1, right)
    assert repr(wrong) in fault[2]


def test_a_second_angle_may_be_blank_in_some_samples(tmp_path):
    table = valid("kinematic")
    table["gamma2_deg"] = np.where(table["sample"] == 3, -36.0, np.nan)
    states = States.from_table(read(table, tmp_path).table)
    braided = (table["sample"] == 3).to_numpy()
    np.testing.assert_array_equal(states.second_share.numpy(), braided)
    np.testing.assert_allclose(states.second_angle.numpy()[braided], np.deg2rad(-36))
    assert states.second_angle.isfinite().all()


def test_a_wholly_blank_second_angle_is_none(tmp_path):
    found = read(valid("kinematic").assign(gamma2_deg=np.nan), tmp_path)
    assert States.from_table(found.table).second_angle is None


def test_a_second_angle_belongs_to_the_sample(tmp_path):
    table = valid("kinematic").assign(gamma2_deg=-36.0)
    table.loc[5, "gamma2_deg"] = -40.0
    (fault,) = faults(table, tmp_path)
    assert fault[:2] == (7, "gamma2_deg")
    assert "differs from -36" in fault[2]


@pytest.mark.parametrize("value", [0.0, 90.0, -90.0, 120.0])
@pytest.mark.parametrize("column", ["gamma_deg", "gamma2_deg"])
def test_an_angle_is_neither_along_nor_around_the_axis(column, value, tmp_path):
    found = faults(valid("kinematic").assign(**{column: value}), tmp_path)
    assert {f[1] for f in found} == {column}
    assert all("outside" in f[2] for f in found)


@pytest.mark.parametrize("column", ["gamma_deg", "gamma2_deg"])
def test_a_helix_the_other_way_has_a_negative_angle(column, tmp_path):
    found = read(valid("kinematic").assign(**{column: -36.0}), tmp_path)
    name = "fiber_angle" if column == "gamma_deg" else "second_angle"
    np.testing.assert_allclose(getattr(States.from_table(found.table), name).numpy(), np.deg2rad(-36))


def test_slack_marks_may_be_blank_and_are_zero_or_one(tmp_path):
    table = valid("kinematic")
    table["slack"] = [1, "", 0, *[""] * (len(table) - 3)]
    found = read(table, tmp_path)
    assert found.table["slack"].tolist()[:3] == [1, 0, 0]
    table["slack"] = [2, *[0] * (len(table) - 1)]
    assert faults(table, tmp_path)[0][:2] == (2, "slack")


@pytest.mark.parametrize("value", [0.0, -13.0])
def test_an_outer_diameter_is_positive(value, tmp_path):
    table = valid("inflation")
    table.loc[3, "outer_diameter_mm"] = value
    (fault,) = faults(table, tmp_path, "inflation")
    assert fault[:2] == (5, "outer_diameter_mm")


def test_blank_readings_are_no_duplicates_of_each_other(tmp_path):
    """Two rows at one place of which nothing was read say nothing twice; the same reading twice does."""
    table = valid("kinematic").drop(columns="time_s")
    twice = pd.concat([table, table.iloc[[2]]], ignore_index=True)
    assert "duplicate of line 4" in faults(twice, tmp_path)[0][2]
    twice.loc[[2, len(table)], ["force_n", "moment_nmm"]] = np.nan
    assert len(read(twice, tmp_path).table) == len(twice)


@pytest.mark.parametrize("bed", BEDS)
def test_predictions_are_read_back_on_their_bed_and_on_no_other(bed, tmp_path):
    """What a run writes is a measurement table with more columns."""
    table = read(valid(bed), tmp_path, bed).table
    with torch.no_grad():
        prediction = build_model("continuum", {"C1": 8e5, "C2": 2e7})(States.from_table(table))
    written = predicted_table(table, "test", prediction)
    again = read(written, tmp_path, bed).table
    assert (again["status"] == written["status"]).all()
    for name in MEASURED[bed]:
        np.testing.assert_array_equal(again[name], table[name])
    shown = Readings.from_table(written, predicted=True).value[:, : 1 if bed == "isometric" else 2]
    ok = prediction.status == 0
    torch.testing.assert_close(shown[ok], prediction.loads[ok, : shown.shape[1]], rtol=1e-12, atol=1e-15)
    if bed != "kinematic":
        other = "kinematic"
        assert (written[BED] == bed).all()
        with pytest.raises(UserError, match=f"data.bed={bed}"):
            read(written.assign(**dict.fromkeys(IMPOSED[other] + MEASURED[other], 1.0)), tmp_path, other)


# --- end blocks -----------------------------------------------------------------------------------------------------

MEMBERS = pd.DataFrame(
    {
        "member": [1, 2],
        "gamma_deg": [36.0, -36.0],
        "gamma2_deg": [np.nan, 36.0],
        "length_mm": [98.0, 99.0],
        "inner_radius_mm": 4.77,
        "outer_radius_mm": [6.7, 6.8],
    }
)


def block(bed: str = "kinematic") -> pd.DataFrame:
    table = valid(bed).drop(columns=["gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"])
    first = table.pop("pressure_kpa")
    return table.assign(pressure_1_kpa=first, pressure_2_kpa=70 - first)


def members_file(folder: Path, table: pd.DataFrame) -> Path:
    table.to_csv(folder / "members.csv", index=False)
    return folder / "members.csv"


@pytest.mark.parametrize("bed", BEDS)
def test_a_table_of_an_end_block_is_read(bed, tmp_path):
    found = read(block(bed), tmp_path, bed, read_members(members_file(tmp_path, MEMBERS)))
    states = States.from_table(found.table)
    first, second = states.members
    np.testing.assert_allclose(first.pressure.numpy() / 1e3, block(bed)["pressure_1_kpa"])
    np.testing.assert_allclose(second.pressure.numpy() / 1e3, 70 - block(bed)["pressure_1_kpa"])
    np.testing.assert_allclose(states.pressure.numpy(), 35e3)
    np.testing.assert_allclose(np.rad2deg(second.fiber_angle.numpy()), -36.0)
    assert first.second_angle is None
    np.testing.assert_allclose(np.rad2deg(second.second_angle.numpy()), 36.0)
    np.testing.assert_allclose(second.reference_length.numpy(), 0.099)
    assert (first.sample == 1).all()
    assert (second.sample == 2).all()
    if bed != "dead_load":
        each = states.side_by_side()
        elongation = (each.length - each.reference_length).numpy().reshape(2, -1) * 1e3
        np.testing.assert_allclose(elongation, [block(bed)["elongation_mm"]] * 2, atol=1e-12)
        np.testing.assert_allclose(each.pressure, np.r_[first.pressure, second.pressure])
        # The first member has no second family of fibers.
        assert each.second_share.reshape(2, -1).sum(1).tolist() == [0, len(states)]


@pytest.mark.parametrize("column", ["pressure_1_kpa", "pressure_2_kpa"])
def test_each_members_pressure_is_imposed(column, tmp_path):
    assert (1, column) in [f[:2] for f in faults(block().drop(columns=column), tmp_path, "kinematic", MEMBERS)]
    table = block()
    table.loc[2, column] = -150.0
    assert faults(table, tmp_path, "kinematic", MEMBERS)[0][:2] == (4, column)


def test_a_read_block_with_its_predictions_is_read_back(tmp_path):
    table = read(block(), tmp_path, "kinematic", MEMBERS).table
    with torch.no_grad():
        prediction = build_model("continuum", {"C1": 8e5, "C2": 2e7}, members=2)(States.from_table(table))
    again = read(predicted_table(table, "test", prediction), tmp_path, "kinematic", MEMBERS).table
    for one, other in zip(States.from_table(again).tensors(), States.from_table(table).tensors(), strict=True):
        assert one[0] == other[0]
        torch.testing.assert_close(one[1], other[1], rtol=1e-12, atol=1e-12)


BROKEN = {
    "no gamma": (MEMBERS.drop(columns="gamma_deg"), 1, "gamma_deg", "missing"),
    "nearly": (MEMBERS.rename(columns={"length_mm": "lenght_mm"}), 1, "length_mm", "'lenght_mm'"),
    "order": (MEMBERS.assign(member=[2, 1]), 2, "member", "out of order"),
    "gap": (MEMBERS.assign(member=[1, 3]), 3, "member", "out of order"),
    "twice": (MEMBERS.assign(member=1), 3, "member", "out of order"),
    "no number": (MEMBERS.assign(length_mm=["98", "long"]), 3, "length_mm", "not a number"),
    "blank": (MEMBERS.assign(length_mm=[98.0, np.nan]), 3, "length_mm", "blank"),
    "radii": (MEMBERS.assign(outer_radius_mm=4.0), 2, "outer_radius_mm", "above inner"),
    "angle": (MEMBERS.assign(gamma_deg=[36.0, 95.0]), 3, "gamma_deg", "outside"),
    "second": (MEMBERS.assign(gamma2_deg=[0.0, 36.0]), 2, "gamma2_deg", "is 0"),
}


@pytest.mark.parametrize(("table", "line", "column", "phrase"), BROKEN.values(), ids=BROKEN)
def test_each_fault_of_a_members_file_is_told_where_it_is(table, line, column, phrase, tmp_path):
    with pytest.raises(TableError) as caught:
        read_members(members_file(tmp_path, table))
    first = caught.value.faults[0]
    assert (first.line, first.column) == (line, column)
    assert phrase in first.problem


def test_an_empty_or_absent_members_file_is_a_users_mistake(tmp_path):
    with pytest.raises(UserError, match="no members"):
        read_members(members_file(tmp_path, MEMBERS.head(0)))
    with pytest.raises(UserError):
        read_members(tmp_path / "nowhere.csv")


@pytest.mark.parametrize("plain", [True, False])
def test_pressures_of_several_actuators_without_their_designs_are_told_for_what_they_are(tmp_path, plain):
    """Beside the columns of one actuator too, which would be read as if it stood alone."""
    table = random_table(12, 0).assign(pressure_1_kpa=1.5, pressure_2_kpa=2.5)
    if not plain:
        table = table.drop(columns=["gamma_deg", "pressure_kpa"])
    with pytest.raises(UserError, match=r"pressure_1_kpa, pressure_2_kpa: .* one end block.* data\.members="):
        read(table, tmp_path)
