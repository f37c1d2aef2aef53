"""Numbers that look wrong are said and never changed; good ones are not accused."""

import numpy as np
import pandas as pd
import pytest
from raw_files import HEADER, RECIPE, ROWS, raw_text, taken


def many(rows=240, seed=0) -> pd.DataFrame:
    """A longer file of the same columns: loads of a spring with a thrust, and noise."""
    generator = np.random.default_rng(seed)
    frame = pd.DataFrame({"t_s": np.arange(rows) / 2.0})
    frame["dl_mm"] = np.repeat(generator.uniform(-5, 5, rows // 4), 4).round(2)
    frame["phi_deg"] = np.repeat(generator.uniform(-60, 60, rows // 4), 4).round(1)
    frame["P_kPa"] = np.tile([0.0, 30, 60, 30], rows // 4) + generator.normal(0, 0.1, rows).round(3)
    frame["F_N"] = (-0.8 * frame["dl_mm"] - 0.1 * frame["P_kPa"] + generator.normal(0, 0.02, rows)).round(4)
    frame["M_Nmm"] = (-0.6 * frame["phi_deg"] - 0.3 * frame["P_kPa"] + generator.normal(0, 0.4, rows)).round(3)
    return frame


def said(tmp_path, frame: pd.DataFrame, recipe: str = RECIPE) -> tuple[pd.DataFrame, str]:
    table, warnings = taken(tmp_path, frame.to_csv(index=False), recipe)
    return table, "\n".join(warnings)


def test_a_good_file_is_not_accused(tmp_path):
    for seed in range(5):
        assert said(tmp_path, many(seed=seed), RECIPE + "order_by: [t_s]\n")[1] == ""
        (tmp_path / "out" / "table.csv").unlink()


@pytest.mark.parametrize("factor", [10, 1000, 0.1, 25.4])
def test_a_block_on_another_scale(factor, tmp_path):
    frame = many()
    frame["F_N"] += 20  # Nothing near zero: there no scale can be told.
    frame.loc[100:160, "F_N"] *= factor
    table, text = said(tmp_path, frame)
    np.testing.assert_allclose(table["force_n"], frame["F_N"])
    assert "force_n from row 101 to 161 is about" in text


@pytest.mark.parametrize("factor", [1000, 0.001])
@pytest.mark.parametrize("column", ["F_N", "M_Nmm"])
def test_a_block_in_another_unit_where_readings_pass_through_zero(factor, column, tmp_path):
    frame = many()
    frame.loc[100:160, column] *= factor
    assert "is about" in said(tmp_path, frame)[1]


def test_a_gauge_that_reads_73_at_rest(tmp_path):
    frame = many()
    frame["P_kPa"] = np.tile([73.0, 200, 400, 74], 60)
    _, text = said(tmp_path, frame)
    assert "pressure_kpa is never below 73" in text
    frame.loc[frame.index % 4 == 0, "P_kPa"] = 8.4
    _, text = said(tmp_path, frame)
    assert "pressure_kpa goes back to 74 and no lower" in text


def test_pressures_that_were_set_are_no_gauge_at_rest(tmp_path):
    """The same levels at every state: a ladder that begins at 35 kPa. Read by a gauge, they would scatter."""
    frame = many()
    frame[["dl_mm", "phi_deg"]] = frame[["dl_mm", "phi_deg"]].to_numpy()[::8].repeat(8, axis=0)
    frame["P_kPa"] = np.tile([35.0, 65, 85, 110, 135, 180, 250, 375], 30)
    assert "never below" not in said(tmp_path, frame)[1]
    frame["P_kPa"] += np.random.default_rng(2).normal(0, 0.3, len(frame)).round(1)
    (tmp_path / "out" / "table.csv").unlink()
    assert "never below 3" in said(tmp_path, frame)[1]


def test_newton_meters_in_a_column_of_newton_millimeters(tmp_path):
    frame = many()
    frame["M_Nmm"] = (frame["M_Nmm"] / 1000).round(7)
    table, text = said(tmp_path, frame)
    assert "moment_nmm may be in N·m" in text
    np.testing.assert_allclose(table["moment_nmm"], frame["M_Nmm"])


def test_a_column_twice(tmp_path):
    _, text = said(tmp_path, many().assign(M_Nmm=lambda f: f["F_N"]))
    assert "columns 'F_N' and 'M_Nmm' are the same, cell by cell" in text


def test_time_that_runs_backwards(tmp_path):
    frame = many()
    frame.loc[50:, "t_s"] -= 20
    _, text = said(tmp_path, frame, RECIPE.replace("columns:", "columns:\n  time_s: {from: t_s, unit: s}"))
    assert "time 't_s' runs backwards at line 52 (1 times in all)" in text


def test_a_dead_channel(tmp_path):
    _, text = said(tmp_path, many().assign(M_Nmm=0.25))
    assert "column 'M_Nmm' is 0.25 in every row" in text


def test_saturated_readings(tmp_path):
    frame = many()
    frame["F_N"] = frame["F_N"].clip(lower=-7.25)
    assert (frame["F_N"] == -7.25).sum() > 8
    _, text = said(tmp_path, frame)
    assert "column 'F_N' is -7.25, its smallest value, in" in text


def test_a_turned_sign(tmp_path):
    _, text = said(tmp_path, many().assign(M_Nmm=lambda f: 0.6 * f["phi_deg"] - 0.3 * f["P_kPa"]))
    assert "moment_nmm may have its sign turned" in text
    assert "force_n" not in text


def test_rows_that_stand_there_twice(tmp_path):
    lines = raw_text().splitlines()
    _, warnings = taken(tmp_path, "\n".join([*lines, lines[-1]]) + "\n")
    assert warnings == ["raw.csv: 1 rows stand there twice (line 11)."]


def test_absolute_pressures(tmp_path):
    frame = many()
    frame["P_kPa"] += 101.3
    _, text = said(tmp_path, frame)
    assert "may be absolute" in text
    assert "psia is absolute" in said(tmp_path, frame, RECIPE.replace("unit: kPa", "unit: psia"))[1]


def test_two_columns_of_one_name(tmp_path):
    header = HEADER + ",F_N"
    text = "\n".join([header, *(",".join(map(str, (*row, row[4] + 1))) for row in ROWS)])
    table, warnings = taken(tmp_path, text)
    assert table["force_n"].tolist() == [row[4] for row in ROWS]
    assert any("two columns are called 'F_N' and differ" in warning for warning in warnings)
