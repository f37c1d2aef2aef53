"""The table of questions: what a file may leave blank or out, and one sentence for each thing that is wrong with it."""

import numpy as np
import pytest

from freelearn.common.errors import UserError
from freelearn.data.columns import Columns
from freelearn.data.table.questions import read_questions

HEAD = "sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm"


@pytest.fixture
def read(tmp_path):
    def of(text, columns=None, encoding="utf-8"):
        path = tmp_path / "questions.csv"
        path.write_bytes(text.encode(encoding))
        return read_questions(path, columns or Columns())

    return of


def test_any_cell_may_be_blank_and_rows_stay_in_their_order(read):
    asked = read(f"{HEAD}\n3,1.5,,20,0,\n,,,,1,2\n6,-1,10,,,3\n")
    assert list(asked.table) == HEAD.split(",")
    expected = [[3, 1.5, np.nan, 20, 0, np.nan], [np.nan] * 4 + [1, 2], [6, -1, 10, np.nan, np.nan, 3]]
    np.testing.assert_array_equal(asked.table.to_numpy(float), expected)
    assert asked.lines.tolist() == [2, 3, 4]
    assert asked.warnings == []


def test_columns_may_be_absent_and_stand_in_any_order(read):
    asked = read("moment_nmm,pressure_kpa,force_n\n1,20,0\n")
    assert list(asked.table) == ["moment_nmm", "pressure_kpa", "force_n"]


def test_a_byte_order_mark_and_the_line_ends_of_windows_do_no_harm(read):
    asked = read("pressure_kpa,force_n\r\n20,0\r\n30,\r\n", encoding="utf-8-sig")
    assert list(asked.table) == ["pressure_kpa", "force_n"]
    assert asked.table["pressure_kpa"].tolist() == [20, 30]


def test_other_columns_are_kept_as_the_text_that_they_are(read):
    asked = read('name,pressure_kpa,remark\n007,20,"a, b"\n1e3,30,\n')
    assert asked.table["name"].tolist() == ["007", "1e3"]
    assert asked.table["remark"].tolist() == ["a, b", ""]


def test_a_blank_sample_excuses_no_other_row(read):
    with pytest.raises(UserError, match="positive integer"):
        read("sample,pressure_kpa\n,10\n2.5,20\n")


def test_a_design_may_be_blank_where_the_sample_says_it(read):
    """A blank is no design that differs from that of the sample's other rows."""
    asked = read("sample,gamma_deg,pressure_kpa\n3,36,10\n3,,20\n")
    assert np.isnan(asked.table["gamma_deg"][1])


@pytest.mark.parametrize(("text", "said"), [
    (f"{HEAD}\n", "holds no rows"),
    ("", "empty|holds no"),
    ("sample,gamma_deg\n3,40\n", "asks nothing"),
    ("sample,pressure_kPa\n3,40\n", "pressure_kpa"),
    ("pressure_kpa,force_n,force_n\n1,2,3\n", "appears 2 times"),
    ("pressure_kpa,,force_n\n1,2,3\n", "has no name"),
    ("pressure_kpa;force_n\n1;2\n", "separates its columns by semicolons"),
    ("pressure_kpa,force_n\n20,abc\n", "line 2, force_n: 'abc' is not a number"),
    ("pressure_kpa,force_n\n20,inf\n", "line 2, force_n: 'inf'"),
    ("pressure_kpa,force_n\n20,nan\n", "line 2, force_n: 'nan'"),
    ("pressure_kpa,force_n\n20,1e999\n", "line 2, force_n"),
    ("pressure_kpa,force_n\n20,1\n30\n", "line 3: .*complete the line"),
    ("pressure_kpa,force_n\n20,1,5\n", "line 2"),
    ("pressure_kpa,force_n\n,\n", "line 2.*blank but for its commas"),
    ("sample,pressure_kpa\n-1,20\n", "positive integer"),
    ("sample,step,pressure_kpa\n3,1.5,20\n", "step"),
    ("length_mm,elongation_mm\n90,-95\n", "leaves no length"),
    ("inner_radius_mm,outer_radius_mm,pressure_kpa\n6,5,20\n", "is not above"),
    ("sample,gamma_deg,pressure_kpa\n3,40,1\n3,40,2\n3,50,3\n", "differs from 40"),
    ('pressure_kpa,force_n\n"20,1\n', "not valid CSV"),
])  # fmt: skip
def test_what_is_wrong_is_said_in_a_sentence(read, text, said):
    with pytest.raises(UserError, match=said) as caught:
        read(text)
    assert "Traceback" not in str(caught.value)


def test_all_faults_are_told_at_once(read):
    with pytest.raises(UserError) as caught:
        read("pressure_kpa,force_n\n20,abc\nx,1\n")
    assert "2 faults" in str(caught.value)
    assert [fault.line for fault in caught.value.faults] == [2, 3]


def test_a_column_whose_name_nearly_is_one_is_told(read):
    asked = read("pressure_kpa,force\n20,1\n")
    assert len(asked.warnings) == 1
    assert "'force'" in asked.warnings[0]
    assert "force_n" in asked.warnings[0]


def test_an_end_block_has_the_pressures_of_its_actuators(read):
    asked = read("elongation_mm,pressure_2_kpa\n1,20\n", Columns(members=3))
    assert asked.table["pressure_2_kpa"].dtype == np.float64
    with pytest.raises(UserError, match="asks nothing"):
        read("pressure_kpa\n20\n", Columns(members=3))
