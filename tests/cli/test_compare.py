"""`compare`: each run's error on the rows that both have is its own error on these rows."""

import re

import numpy as np
import pandas as pd
import pytest
from fitted_folders import continuum, folder_of, grid, shown

import freelearn
from freelearn.api.compared import Compared, compared
from freelearn.cli.comparing import charts, compare, parameters_table
from freelearn.common.errors import UserError


def test_two_runs_on_the_rows_that_both_have(tmp_path, capsys):
    truth = continuum()
    table = shown(truth, grid())
    table = table[table["force_n"].notna()].reset_index(drop=True)
    folder_of(tmp_path / "a", truth, table)
    folder_of(tmp_path / "b", continuum(c1=9e5), table.iloc[:-20].reset_index(drop=True))
    compare(tmp_path / "a", tmp_path / "b", tmp_path / "page.html")
    told = capsys.readouterr().out
    assert f"A: continuum, fitted on all, in {tmp_path / 'a'}" in told
    (line,) = [line for line in told.splitlines() if "all rows of both" in line]
    *_, number, a, b = line.replace("−", "-").split()
    assert int(number) == len(table) - 20
    # The first is the truth; the second errs as it does by itself.
    assert float(a) == pytest.approx(0, abs=1e-6)
    expected = 100 * freelearn.load(tmp_path / "b").error(table.iloc[:-20].reset_index(drop=True))
    assert float(b) == pytest.approx(expected, rel=5e-3)
    assert expected > 0.1
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Errors on the same rows" in page
    # States are told as everywhere, with their units.
    both = compared([freelearn.load(tmp_path / name) for name in "ab"])
    titles = [chart.title.text for chart in charts(both)]
    assert titles
    assert all(re.fullmatch(r"sample \d+, [+-]\d+ mm, [+-]\d+°", title) for title in titles), titles
    assert "http://" not in page.split("<script>")[0]


def test_runs_without_a_common_row_are_refused(tmp_path):
    for name, sample in (("a", 3), ("b", 1)):
        table = shown(continuum(), grid(sample))
        folder_of(tmp_path / name, continuum(), table[table["force_n"].notna()].reset_index(drop=True))
    with pytest.raises(UserError, match="no row in common"):
        compare(tmp_path / "a", tmp_path / "b", tmp_path / "page.html")


def test_readings_that_are_whole_in_one_table_are_the_same_ones(tmp_path):
    table = shown(continuum(), grid())
    table = table[table["force_n"].notna()].reset_index(drop=True)
    whole = table.assign(force_n=table["force_n"].round().astype(int))
    folder_of(tmp_path / "a", continuum(), whole)
    folder_of(tmp_path / "b", continuum(), table.assign(force_n=whole["force_n"] + np.where(table.index % 2, 0.0, 0.5)))
    found = compared([freelearn.load(tmp_path / name) for name in "ab"])
    assert len(found.rows) == len(table) // 2


def test_what_the_rows_do_not_determine_has_no_error_and_what_was_learned_is_counted(tmp_path):
    names = ["C1", "C2"]
    each = {"a": [2.2e17, 1.0e6], "a_stderr": [5.8e40, 2e4], "a_untold": [True, False]}
    other = {"b": [4e5, 1.1e6], "b_stderr": [1e4, np.nan], "b_untold": [False, False], "unit": "Pa"}
    parameters = pd.DataFrame({**each, **other}, index=names)
    table = parameters_table(Compared(("a", "b"), parameters, pd.DataFrame(), pd.DataFrame(), (0, 105)))
    assert table.rows == (
        ("C1", "Pa", "2.2e+17", "4e+05 ± 1e+04", ""),
        ("C2", "Pa", "1e+06 ± 2e+04", "1.1e+06", ""),
    )
    assert table.caption == "B: and 105 learned coefficients; without ±: not determined by its rows (C1)"
