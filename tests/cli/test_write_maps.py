"""write_maps: every map of a run as a picture and its numbers."""

import beds
import pandas as pd
import pytest
from nightly import usually
from small_runs import make_csv, run

import freelearn
from freelearn.cli.map_files import write_maps
from freelearn.common.errors import UserError
from freelearn.queries.maps.maps import maps

SIGNATURE = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("which", usually("two", nightly=["block"]))
def test_every_map_is_a_picture_and_the_numbers_that_it_shows(which, tmp_path):
    if which == "block":
        overrides = beds.write("block", {}, tmp_path)
        stiffness = ["stiffness"]
    else:
        overrides = ["data=csv", f"data.path={make_csv(tmp_path / 'table.csv')}"]
        stiffness = ["stiffness_lowest", "stiffness_middle", "stiffness_highest"]
    run(tmp_path / "run", "train=all", *overrides, "figures=false")
    fitted = freelearn.load(tmp_path / "run")
    written = write_maps(fitted, tmp_path / "maps")
    names = ["load_polygon", "reachable_poses", *stiffness]
    assert written == [tmp_path / "maps" / f"{name}{end}" for name in names for end in (".png", ".csv")]
    assert {path.name for path in (tmp_path / "maps").iterdir()} == {path.name for path in written}
    assert all(path.read_bytes().startswith(SIGNATURE) for path in written[::2])
    found = maps(fitted)
    polygon = pd.read_csv(tmp_path / "maps" / "load_polygon.csv")
    assert list(polygon) == list(found.loads.points)
    pd.testing.assert_series_equal(polygon["force_n"], found.loads.points["force_n"], rtol=1e-12)
    rows = pd.concat([pd.read_csv(tmp_path / "maps" / f"{name}.csv") for name in stiffness])
    assert len(rows) == len(found.stiffness.table)


def test_a_folder_that_is_a_file_is_said(tmp_path):
    run(tmp_path / "run", "train=all", "data=csv", f"data.path={make_csv(tmp_path / 'table.csv')}", "figures=false")
    (tmp_path / "maps").write_text("")
    with pytest.raises(UserError, match="maps"):
        write_maps(freelearn.load(tmp_path / "run"), tmp_path / "maps")
