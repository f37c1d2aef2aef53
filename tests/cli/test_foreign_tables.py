"""A laboratory's own file where a measurement table is asked for."""

import pandas as pd
import pytest
from small_runs import make_csv

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.loaded_table import load_table
from freelearn.cli.command_line import exit_on_user_error
from freelearn.data.table.faults import TableError


def refusal(path):
    """What a command says of the table; the page is told of its faults alone."""
    data = settings(TrainSettings, ["data=csv", f"data.path={path}"]).data
    with pytest.raises(SystemExit) as ended, exit_on_user_error("interrupted"):
        load_table(data)
    with pytest.raises(TableError) as faults:
        load_table(data)
    assert "intake" not in str(faults.value)
    return str(ended.value).removeprefix("error: ")


def test_a_file_with_other_headings_is_sent_on_to_intake(tmp_path):
    path = tmp_path / "their data.csv"
    path.write_text("Length [mm];Twist [deg];Pressure [bar];Force [N]\n98,75;90,04;0,18;-11,5\n")
    said = refusal(path)
    assert said.startswith(f"{path} has ")
    assert "length_mm: column is missing" in said
    assert "becomes such a table by\n  " in said
    assert said.endswith(f"python intake.py 'data.path={path}'")


def test_a_table_that_lacks_a_column_is_not(tmp_path):
    table = make_csv(tmp_path / "whole.csv")
    path = tmp_path / "mine.csv"
    pd.read_csv(table).drop(columns="gamma_deg").to_csv(path, index=False)
    said = refusal(path)
    assert said.endswith("gamma_deg: column is missing: add it")
