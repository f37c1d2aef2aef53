"""Tables of specimen tests are read as they stand, or refused with every fault at its line and column."""

import numpy as np
import pandas as pd
import pytest

from freelearn.common.errors import UserError
from freelearn.data.specimen_schema import Stresses
from freelearn.data.specimen_table import read_specimens
from freelearn.data.table.faults import TableError

GOOD = "mode,stretch,stress_mpa,specimen\nuniaxial,1.1,0.1,a\nUT,1.5,0.3,b\nPure shear,1.2,0.25,a\nET,1.2,0.4,a\n"


@pytest.fixture
def file(tmp_path):
    def write(text: str, name: str = "t.csv") -> str:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def test_one_table_holds_all_modes(file):
    data = read_specimens([file(GOOD)])
    assert data.table["mode"].tolist() == ["uniaxial", "uniaxial", "pure_shear", "equibiaxial"]
    assert data.table["stress_mpa"].tolist() == [0.1, 0.3, 0.25, 0.4]
    assert data.table["specimen"].tolist() == ["a", "b", "a", "a"]
    assert data.modes == ["uniaxial", "equibiaxial", "pure_shear"]
    assert data.warnings == []


def test_files_by_mode_hold_the_same_as_one_table(file):
    one = read_specimens([file(GOOD)]).table.assign(specimen="")
    sources = [
        "UT=" + file("P_MPa,lambda\n0.1,1.1\n0.3,1.5\n", "u.csv"),
        "PS=" + file("lambda,P_MPa\n1.2,0.25\n", "p.csv"),
        "equibiaxial=" + file("stretch,stress_mpa\n1.2,0.4\n", "e.csv"),
    ]
    data = read_specimens(sources)
    pd.testing.assert_frame_equal(data.table, one)
    assert [len(f["sha256"]) for f in data.files] == [64] * 3
    assert len({f["sha256"] for f in data.files}) == 3


def test_every_fault_is_told_with_line_and_column(file):
    text = "mode,lambda,P_MPa\nuniaxial,1.1,0.1\nshear,-1,nan\nUT,0,x\nPS,1.2,\nPS,1.2\n"
    with pytest.raises(TableError) as caught:
        read_specimens([file(text)])
    assert [(f.line, f.column) for f in caught.value.faults] == [
        *((3, "mode"), (3, "lambda"), (3, "P_MPa")),
        *((4, "lambda"), (4, "P_MPa")),
        (5, "P_MPa"),
        (6, ""),
    ]
    message = str(caught.value)
    assert "'shear' is no mode: write uniaxial, equibiaxial, pure_shear" in message
    assert "'-1' is not positive" in message
    assert "'x' is not a number" in message


def test_faults_of_all_files_come_together(file):
    uniaxial = file("stretch,stress_mpa\n-1,1\n", "a.csv")
    shear = file("stretch,stress_mpa\n1,1\n0,1\n", "b.csv")
    with pytest.raises(UserError) as caught:
        read_specimens([f"UT={uniaxial}", f"PS={shear}"])
    assert "a.csv has 1 fault" in str(caught.value)
    assert "b.csv has 1 fault" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "prefix", "words"),
    [
        ("stretch,stress_mpa\n1.1,1\n", "", "mode: column is missing.*UT=FILE"),
        ("mode,stretch,stress\nUT,1.1,1\n", "", "stress_mpa: column is missing: rename 'stress' to it"),
        ("mode,stretch,stress_mpa\nPS,1.1,1\n", "UT=", "line 2, mode: 'PS' is not uniaxial, the mode"),
        ("stretch,lambda,stress_mpa\n1,1,1\n", "UT=", "appears 2 times"),
        ("stretch;stress_mpa\n1;1\n", "UT=", "by semicolons"),
        ("1.1,0.2\n1.2,0.3\n", "UT=", "has no header"),
        ("stretch,stress_mpa\n", "UT=", "holds no rows"),
        ("stretch,stress_mpa\n1.1,0\n1.2,0\n", "UT=", "Every stress in mode uniaxial is zero"),
        ("stretch,stress_mpa\n1.1,1\n", "XT=", "Unknown mode 'XT'.*UT .uniaxial."),
    ],
)
def test_what_is_no_such_table_is_refused(file, text, prefix, words):
    with pytest.raises(UserError, match=words):
        read_specimens([prefix + file(text)])


def test_a_file_is_named_once(file):
    path = file("stretch,stress_mpa\n1.1,1\n")
    with pytest.raises(UserError, match="named twice"):
        read_specimens([f"UT={path}", f"PS={path}"])


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("1.1,1e5\n1.5,3e5", "looks like Pa .*in MPa it would be 0.3"),
        ("1.1,100\n1.5,300", "looks like kPa .*in MPa it would be 0.3"),
        ("110,0.1\n150,0.3", "looks like percent"),
        ("0.1,0.1\n0.5,0.3", "2 stresses of mode uniaxial pull where the specimen is stretched less"),
    ],
)
def test_numbers_in_another_unit_are_warned_of(file, rows, words):
    warnings = read_specimens(["UT=" + file(f"stretch,stress_mpa\n{rows}\n")]).warnings
    assert len(warnings) == 1
    assert pd.Series(warnings).str.contains(words).all()


BIAXIAL = "mode,stretch,stretch_2,stress_mpa,stress_2_mpa\n"


def test_a_biaxial_row_holds_two_stretches_and_one_or_two_stresses(file):
    rows = (
        "BT,1.2,1.5,0.3,0.4\nbiaxial,1.2,1.5,,0.4\nBT,0.95,1.5,0.1,\nPS,1.5,,0.5,0.2\nPS,1.5,1.01,,0.2\nUT,1.5,,0.4,0\n"
    )
    data = read_specimens([file(BIAXIAL + rows)])
    assert data.modes == ["uniaxial", "pure_shear", "biaxial"]
    np.testing.assert_allclose(data.table["stretch_2"], [1.5, 1.5, 1.5, 1, 1, 1.5**-0.5])
    nan = np.nan
    np.testing.assert_array_equal(data.table["stress_mpa"], [0.3, nan, 0.1, 0.5, nan, 0.4])
    # Nothing pulls across a uniaxial specimen: its 0 is no measurement.
    np.testing.assert_array_equal(data.table["stress_2_mpa"], [0.4, 0.4, nan, 0.2, 0.2, nan])
    assert data.warnings == []


def test_stresses_come_with_the_stretches_along_and_across_them(file):
    held = Stresses.from_table(read_specimens([file(BIAXIAL + "BT,1.2,1.5,0.3,0.4\nBT,1.1,1.6,,0.5\n")]).table)
    assert held.along.tolist() == [1.2, 1.5, 1.6]
    assert held.across.tolist() == [1.5, 1.2, 1.1]
    assert held.stress_mpa.tolist() == [0.3, 0.4, 0.5]


@pytest.mark.parametrize(
    ("row", "column", "words"),
    [
        ("BT,1.2,,0.3,0.4", "stretch_2", "is blank: a biaxial test imposes it"),
        ("BT,1.2,x,0.3,0.4", "stretch_2", "'x' is not a number"),
        ("BT,1.2,-1,0.3,0.4", "stretch_2", "is not positive"),
        ("BT,1.2,1.5,,", "stress_mpa", "is blank: write a number"),
        ("BT,1.2,1.5,0.1,n/a", "stress_2_mpa", "'n/a' is not a finite number"),
        ("PS,1.2,1.2,0.1,0.1", "stretch_2", "'1.2' is not what this mode imposes"),
        ("UT,1.2,,,0", "stress_mpa", "is blank: write a number"),
        ("UT,1.2,,0.1,0.1", "stress_2_mpa", "a uniaxial test leaves direction 2 free"),
    ],
)
def test_what_a_test_in_two_directions_cannot_be_is_refused(file, row, column, words):
    with pytest.raises(TableError, match=words) as caught:
        read_specimens([file(f"{BIAXIAL}{row}\nBT,1.3,1.5,0.3,0.4\n")])
    assert [(f.line, f.column) for f in caught.value.faults] == [(2, column)]


def test_a_biaxial_table_without_the_stretch_across_is_refused(file):
    with pytest.raises(TableError, match="stretch_2: column is missing: add it, a biaxial test imposes it too"):
        read_specimens(["BT=" + file("stretch,stress_mpa\n1.2,0.3\n")])


def test_unlike_stresses_at_like_stretches_are_warned_of(file):
    warnings = read_specimens([file(BIAXIAL + "BT,1.5,1.5,0.6,0.8\nBT,1.2,1.5,0.4,0.7\nET,1.5,,0.6,0.61\n")]).warnings
    assert len(warnings) == 1
    assert "1 rows of mode biaxial are stretched alike in both directions" in warnings[0]
    assert "differ by up to 25 %" in warnings[0]


def test_a_side_that_pulls_while_it_is_the_shortest_is_warned_of(file):
    # Shorter than at rest, yet longer than the thickness: that pulls.
    assert read_specimens([file(BIAXIAL + "BT,0.93,1.5,0.1,0.4\n")]).warnings == []
    warnings = read_specimens([file(BIAXIAL + "BT,0.5,2.5,0.3,0.4\n")]).warnings
    assert "1 stresses of mode biaxial pull where" in warnings[0]
