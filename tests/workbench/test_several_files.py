"""Several files on the page: recordings, or channels each with its clock, dropped together or in an archive."""

import io
import json
import re
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from freelearn.common.errors import UserError
from freelearn.workbench.panels.mapping import Mapping
from freelearn.workbench.panels.widgets import Dropper
from freelearn.workbench.state.dropped_files import kept_in_folder, unpacked

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


def csv(header, *columns):
    return "\n".join([header, *(",".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True)), ""]).encode()


def recording(number):
    time = np.arange(0, 5 + number, 0.05)
    return time, 60 - 60 * np.cos(0.9 * time), -30 * np.cos(0.7 * time) - number


def files():
    made = {}
    for number in (1, 2):
        time, pressure, force = recording(number)
        made[f"muscle/test{number}/pressure.csv"] = csv("t [s],P [kPa]", time, pressure)
        made[f"muscle/test{number}/force.csv"] = csv("t [s],F [N]", time, force)
    return made


def archive(content):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        for name, text in content.items():
            made.writestr(name, text)
    return out.getvalue()


def answered(page):
    """The questions of the page, as one answers them."""
    said = {"gamma_deg": "25", "length_mm": "150", "inner_radius_mm": "5", "outer_radius_mm": "6"}
    for _ in range(3):
        for key, field in page.questions.fields.items():
            if key.startswith("design."):
                field.value = said[key.split(".")[1]]
            elif key.startswith("held."):
                field.value = "0"
            elif key == "recorded":
                field.value = "one"
            elif not field.value:
                field.value = "no"
    for row in page.rows:
        if row.quantity.value == "force_n":
            row.turned.value = "no"


def test_an_archive_of_recordings_becomes_one_log(sessions, finish):
    session = sessions.get("")[1]
    session.upload("muscle.zip", archive(files() | {"__MACOSX/muscle/._x.csv": b"\0", "muscle/readme.md": b"notes"}))
    finish(session)
    assert session.problem == ""
    page = Mapping(session)
    page.refresh()
    assert page.view.visible
    assert "muscle.zip holds 2 recordings of one form" in page.notes.object
    assert "recorded" in page.questions.fields
    answered(page)
    page.make.clicks += 1
    assert page.problem.object == "" or "still" not in page.problem.object, page.problem.object
    finish(session)
    assert session.problem == ""
    assert session.made["name"] == "muscle.zip"
    table = pd.read_csv(session.made["path"])
    assert table["run"].drop_duplicates().tolist() == [1, 2]
    for run, rows in table.groupby("run"):
        np.testing.assert_allclose(rows["force_n"], recording(run)[2], atol=1e-6)
        np.testing.assert_allclose(rows["pressure_kpa"], recording(run)[1], atol=1e-5)
    # What lies here lies under names of the page's own.
    provenance = json.loads((session.folder / session.made["folder"] / "table_provenance.json").read_text())
    assert len(provenance["raw"]) == 4
    assert provenance["uploaded_as"] == "muscle.zip"


@pytest.mark.nightly
def test_channels_that_were_dropped_together_are_joined(sessions, finish):
    session = sessions.get("")[1]
    session.upload_several({Path(name).name: text for name, text in files().items() if "test1" in name})
    finish(session)
    page = Mapping(session)
    page.refresh()
    assert "there are 2 clocks" in page.notes.object
    answered(page)
    page.make.clicks += 1
    finish(session)
    assert session.problem == ""
    np.testing.assert_allclose(pd.read_csv(session.made["path"])["force_n"], recording(1)[2], atol=1e-6)


def test_files_that_do_not_belong_together_say_so(sessions, finish):
    session = sessions.get("")[1]
    time, pressure, force = recording(1)
    session.upload_several(
        {"a.csv": csv("t [s],P [kPa],F [N]", time, pressure, force), "b.csv": csv("n,phi", time, force)}
    )
    finish(session)
    assert "neither recordings of one form nor channels" in session.problem
    assert not session.mapping


def test_what_an_archive_may_hold():
    assert list(unpacked(archive(files()), 10**8)) == list(files())
    assert unpacked(b"t,F\n1,2\n", 10**8) == {}
    assert unpacked(archive({"[Content_Types].xml": "", "xl/workbook.xml": ""}), 10**8) == {}
    with pytest.raises(UserError, match="holds no tables"):
        unpacked(archive({"a.docx": "x"}), 10**8)
    with pytest.raises(UserError, match="more than 300 tables, or 1 MB"):
        unpacked(archive({"a.csv": "0," * 1_000_000}), 1 << 20)
    with pytest.raises(UserError, match="cannot be unpacked"):
        unpacked(archive(files())[:200], 10**8)


@pytest.mark.parametrize(
    "name", ["../../x.csv", "/etc/x.csv", "a/../../x.csv", "..\\..\\x.csv", ".hidden/x.csv", "a\n\u202eb/x.csv"]
)
def test_names_in_an_archive_lead_nowhere(name, tmp_path):
    made = kept_in_folder({name: b"1", "b/y.csv": b"2"}, tmp_path / "session")
    inside = [path for path in (tmp_path / "session").rglob("*") if path.is_file()]
    assert len(inside) == 2
    assert all(path.is_relative_to(made) for path in inside)
    assert all(re.fullmatch(r"[\w .,()\[\]+=-]+", part) for path in inside for part in path.relative_to(made).parts)
    assert not [path for path in tmp_path.rglob("*.csv") if path not in inside]


def test_pieces_of_files_that_come_in_turn_are_put_together_each():
    """A browser sends two files at a time: of larger ones pieces of both come one after another."""
    came = {}
    place = Dropper(300, came.__setitem__)
    sent = [("a.csv", b"1", 1), ("b.csv", b"x", 1), ("a.csv", b"2", 2), ("b.csv", b"y", 2), ("a.csv", b"3", 3)]
    for name, data, chunk in sent:
        about = {"name": name, "data": data, "chunk": chunk, "total_chunks": 3 if name == "a.csv" else 2}
        place._process_event(SimpleNamespace(event_name="upload_event", data=about))
    assert came == {"a.csv": b"123", "b.csv": b"xy"}
