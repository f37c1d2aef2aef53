"""One event file of TensorBoard's in a folder, with whole records in it."""

import os

import pytest
from small_runs import make_csv, run
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from freelearn.report.tensorboard_log import NAMES, event_file


def scalars(folder):
    """Values by tag, of the only file in the folder."""
    (path,) = folder.glob(NAMES)
    events = EventAccumulator(str(path))
    events.Reload()
    return {tag: [e.value for e in events.Scalars(tag)] for tag in events.Tags()["scalars"]}


def wrote(folder, tag, value, go_on=False):
    with event_file(folder, go_on) as writer:
        writer.add_scalar(tag, value, 0)


def test_what_is_written_next_replaces_or_follows_what_is_there(tmp_path):
    wrote(tmp_path, "a", 1.0)
    wrote(tmp_path, "b", 2.0, go_on=True)
    wrote(tmp_path, "c", 3.0, go_on=True)
    assert scalars(tmp_path) == {"a": [1.0], "b": [2.0], "c": [3.0]}
    wrote(tmp_path, "d", 4.0)
    assert scalars(tmp_path) == {"d": [4.0]}


def test_of_several_files_that_are_there_the_latest_is_gone_on_with(tmp_path):
    wrote(tmp_path, "old", 1.0)
    (first,) = tmp_path.glob(NAMES)
    kept = first.read_bytes()
    wrote(tmp_path, "new", 2.0)
    # Of the same second, but written before.
    old = tmp_path / first.name.replace("tfevents.", "tfevents.0")
    old.write_bytes(kept)
    os.utime(old, (1, 1))
    wrote(tmp_path, "last", 3.0, go_on=True)
    assert scalars(tmp_path) == {"new": [2.0], "last": [3.0]}


def test_a_file_that_cannot_be_written_leaves_the_earlier_one(tmp_path):
    wrote(tmp_path, "a", 1.0)
    before = {path.name: path.read_bytes() for path in tmp_path.glob(NAMES)}
    with pytest.raises(ZeroDivisionError), event_file(tmp_path):
        _ = 1 / 0
    assert {name: (tmp_path / name).read_bytes() for name in before} == before


@pytest.mark.slow
def test_a_run_leaves_one_file_with_all_of_it_however_often_it_is_repeated(tmp_path):
    chosen = ["data=csv", f"data.path={make_csv(tmp_path / 'mine.csv')}", "model=linear", "train=all"]
    chosen += [f"fits={tmp_path / 'fits'}", "figures=false"]
    for parameters in (True, False):
        # The second time the fit is found again, and the errors by iteration come from what was kept of it.
        run(tmp_path / "run", *chosen)
        found = scalars(tmp_path / "run")
        assert ("parameter/ka" in found) == parameters
        assert {"error_percent/train", "test_error_percent/all"} <= set(found)
        assert len(found["test_error_percent/all"]) == 1
    run(tmp_path / "run", *chosen[:-2], "fits=null", "figures=false")
    assert "parameter/ka" in scalars(tmp_path / "run")
