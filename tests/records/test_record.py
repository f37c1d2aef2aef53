"""What a run wrote is read back, and what is no run is said to be none."""

import json
import math

import pytest

from freelearn.common.errors import UserError
from freelearn.records.estimates import Estimate
from freelearn.records.sweep_records import read_records
from freelearn.report.tables.sweep_tables import fitted_parameters, parameter_spread

MEASURED = {"name": "csv", "simulated": False, "path": "t.csv", "sha256": "abc"}


def write(folder, fit="levenberg_marquardt", value=2.0, **more):
    folder.mkdir(parents=True)
    estimates = [Estimate("C1", value, "Pa", 0.5, 1.2, 3.1, 0.4), Estimate("weight[0]", 1.0)]
    content = {"model": "continuum", "effects": ["end_clamps"], "train": "sample3", "fit": fit, "seed": 4}
    content |= {"data": MEASURED, "parameters": {e.name: e.plain() for e in estimates}}
    (folder / "results.json").write_text(json.dumps(content | more))
    return estimates


def test_a_sweep_is_read_in_the_order_of_its_jobs(tmp_path):
    written = {number: write(tmp_path / str(number), value=float(number + 1)) for number in (10, 9, 1)}
    records = read_records(tmp_path)
    assert [record.folder.name for record in records] == ["1", "9", "10"]
    assert records[0].title == "continuum + end_clamps"
    assert records[0].provenance.plain() == MEASURED
    assert records[0].estimates[0] == written[1][0]
    assert math.isnan(records[0].estimates[1].stderr)
    assert read_records(tmp_path / "9") == records[1:2]
    moved = parameter_spread(fitted_parameters(records))
    assert moved[["parameter", "fits", "max / min"]].to_numpy().tolist() == [["C1", 3, 5.5]]


def test_nothing_fitted_has_no_parameters(tmp_path):
    write(tmp_path / "0", fit="none")
    fitted = fitted_parameters(read_records(tmp_path))
    assert not len(fitted)
    assert not len(parameter_spread(fitted))


def test_folders_without_whole_runs_are_said(tmp_path):
    with pytest.raises(UserError, match="No results in"):
        read_records(tmp_path)
    write(tmp_path / "0", parameters=None)
    with pytest.raises(UserError, match="make the run again"):
        read_records(tmp_path)
    (tmp_path / "0" / "results.json").write_text("{")
    with pytest.raises(UserError, match="make the run again"):
        read_records(tmp_path)
