"""What is not exported, and what is said of it."""

import json
import sys

import pytest
from exported import actuator

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


def test_an_undecided_search_is_doubted(tmp_path):
    fitted = actuator(tmp_path / "run")
    assert doubts(fitted) == []
    content = json.loads((tmp_path / "run" / "results.json").read_text())
    (tmp_path / "run" / "results.json").write_text(json.dumps(content | {"verdict": "undecided"}))
    from freelearn import load

    assert "undecided" in doubts(load(tmp_path / "run"))[0]


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
