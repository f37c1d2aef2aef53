"""What is not exported, and what is said of it."""

import errno
import json
import os
import sys

import pytest
from exported import actuator, linear
from nightly import usually

import freelearn
from freelearn.api.settings.configuration import composed
from freelearn.api.settings.parse import parsed
from freelearn.api.settings.run_settings import ExportSettings
from freelearn.common.errors import UserError
from freelearn.export.export import doubts
from freelearn.export.export_options import Options, asked_for, needed


def test_what_the_data_do_not_determine_is_not_exported(tmp_path):
    fitted = actuator(tmp_path / "run", known=False)
    with pytest.raises(UserError, match=r"C1, C2.*force=true"):
        fitted.export(tmp_path / "out.c")
    assert not (tmp_path / "out.c").exists()


@pytest.mark.parametrize("verdict", usually("undecided", nightly=["unexplained"]))
@pytest.mark.usefixtures("traced")
def test_a_search_that_does_not_know_is_exported_by_force_alone(tmp_path, verdict):
    fitted = linear(tmp_path / "run")
    assert doubts(fitted) == []
    content = json.loads((tmp_path / "run" / "results.json").read_text())
    (tmp_path / "run" / "results.json").write_text(json.dumps(content | {"verdict": verdict}))
    doubted = freelearn.load(tmp_path / "run")
    with pytest.raises(UserError, match=rf"{verdict}.*force=true"):
        doubted.export(tmp_path / "out", "table")
    assert not (tmp_path / "out").exists()
    found = doubted.export(tmp_path / "out", "table", force=True)
    assert found.content["forced"]
    assert verdict in found.content["warnings"][0]
    assert "Exported all the same" in (tmp_path / "out" / "export.html").read_text()


def test_a_folder_holds_one_export(traced, tmp_path):
    traced.export(tmp_path / "left.nc", error=0.1)
    with pytest.raises(UserError, match="holds the export of left to=table"):
        traced.export(tmp_path / "right.nc", error=0.1)
    # The same once more takes its place.
    again = traced.export(tmp_path / "left.nc", error=0.2)
    assert again.content["round_trip"]["limit"] == 0.2
    assert "allowed 0.2: held" in repr(again)
    assert len(repr(again)) < 1000


@pytest.mark.parametrize("count", range(6))
def test_a_disk_that_fills_leaves_nothing(traced, tmp_path, monkeypatch, count):
    """Three files are made, then moved: the export, its certificate, its page."""
    move, taken = os.replace, []

    def replace(source, target):
        if len(taken) == count:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken.append(target)
        move(source, target)

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", replace)
        with pytest.raises(UserError, match=rf"Cannot write to {tmp_path / 'out'}: No space left on device"):
            traced.export(tmp_path / "out", "table", error=0.1)
    assert not (tmp_path / "out").exists()


def test_a_missing_package_is_said_with_the_line_that_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(UserError, match=r"pip install 'freelearn\[export\]'"):
        needed("onnx")


@pytest.mark.parametrize(
    ("options", "said"),
    [({"to": "pdf"}, "format"), ({"to": "c", "name": "2 arms"}, "cannot name code")],
)
def test_options_that_cannot_be(options, said):
    with pytest.raises(UserError, match=said):
        Options(**options)


def test_a_path_tells_the_format():
    assert asked_for("x/left.onnx")[1:] == ("onnx", "left")
    with pytest.raises(UserError, match="to="):
        asked_for("folder")
    with pytest.raises(UserError, match="no file of to=c"):
        asked_for("left.onnx", "c")


def test_the_command_asks_for_what_it_lacks():
    with pytest.raises(UserError, match="to is missing"):
        parsed(ExportSettings, composed("export", ["run=somewhere"]))
    assert (
        parsed(ExportSettings, composed("export", ["run=somewhere", "to=c", "license=CC-BY-4.0"])).license
        == "CC-BY-4.0"
    )
