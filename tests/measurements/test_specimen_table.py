"""Tables of specimen tests are read as they stand, or refused with every fault at its line and column."""

import pandas as pd
import pytest

from freelearn.errors import UserError
from freelearn.measurements.faults import TableError
from freelearn.measurements.specimen_table import read_specimens

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
        ("0.1,0.1\n0.5,0.3", "2 rows of mode uniaxial are in tension below stretch 1"),
    ],
)
def test_numbers_in_another_unit_are_warned_of(file, rows, words):
    warnings = read_specimens(["UT=" + file(f"stretch,stress_mpa\n{rows}\n")]).warnings
    assert len(warnings) == 1
    assert pd.Series(warnings).str.contains(words).all()
