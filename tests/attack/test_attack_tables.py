"""The table zoo: every kind gets the answer it must get, from the reader and from whole commands."""

from __future__ import annotations

import json
import os
import re
import socket
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from attack_runs import Ended, command
from attack_tables import ACCEPT, HEADER, KINDS, REFUSE, WARN, Kind, good, good_table, with_cell
from hidden_tables import among
from nightly import EVERY, chosen, usually

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import CsvData, TrainSettings
from freelearn.api.tasks.loaded_table import data_version, load_table
from freelearn.common.errors import UserError
from freelearn.common.files import LARGER, read_bytes
from freelearn.data.columns import Columns
from freelearn.data.intake.readers.raw_files import raw_table, table_files
from freelearn.data.sets import overlap, samples_of
from freelearn.data.specimen_table import read_specimens
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members
from freelearn.data.table.questions import read_questions
from freelearn.data.table.records import mark_left_out
from freelearn.records.specimen_record import load_parameters

PLAIN = ("data=csv", "train=all", "figures=false", "bands=false")


def loaded(path: Path):
    """What train and discover read."""
    return load_table(CsvData(name="csv", path=path, accuracy=None))


def test_the_zoo_is_large_and_holds_every_answer():
    assert len(KINDS) >= 200
    assert {answer: sum(kind.answer == answer for kind in KINDS) > 20 for answer in (REFUSE, WARN, ACCEPT)} == {
        REFUSE: True,
        WARN: True,
        ACCEPT: True,
    }


@pytest.mark.parametrize("kind", chosen(KINDS, 120), ids=lambda kind: kind.name)
def test_a_table_gets_its_answer(kind: Kind, tmp_path: Path):
    path = tmp_path / "table.csv"
    path.write_bytes(kind.made())
    if kind.answer == REFUSE:
        with pytest.raises(UserError) as told:
            loaded(path)
        assert kind.says in str(told.value)
        assert_one_clear_message(str(told.value))
        return
    read = loaded(path)
    if kind.answer == WARN:
        assert any(kind.says in warning for warning in read.warnings), read.warnings
    else:
        assert read.warnings == ()
    if kind.same:
        pd.testing.assert_frame_equal(read.table[HEADER], good_table(), check_dtype=False)


def assert_one_clear_message(message: str) -> None:
    """No control character reaches a terminal, and no line is longer than anybody reads."""
    assert not re.search(r"[\x00-\x08\x0b-\x1f]", message)
    assert max(map(len, message.splitlines())) < 600
    assert len(message.splitlines()) < 30


# --- whole commands --------------------------------------------------------------------------------------------------


def assert_ended(kind: Kind, ended: Ended, run: Path, marks: str) -> None:
    """The command ended as it must, and left what it must."""
    assert "Traceback" not in ended.said
    if kind.answer == REFUSE:
        assert ended.status == 1
        assert ended.err.startswith("error: ")
        assert ended.err.count("error: ") == 1
        assert " ".join(kind.says.split()) in ended.said
        assert not run.exists()
        return
    if ended.status:
        assert not kind.fits, ended.said[-2000:]
        assert ended.err.startswith("error: ")
        assert not (run / marks).exists()
    else:
        json.loads((run / marks).read_text())
        if kind.answer == WARN:
            # A sentence may begin with a capital there.
            assert kind.says.lower() in ended.said.lower()
    assert not [path for path in run.rglob("*") if path.name.endswith(".part")]


SAMPLE = [
    *chosen([kind for kind in KINDS if kind.answer == REFUSE], 3),
    *chosen([kind for kind in KINDS if kind.answer == WARN], 1),
    *chosen([kind for kind in KINDS if kind.answer == ACCEPT], 1),
]


@pytest.mark.slow
@pytest.mark.parametrize("kind", SAMPLE, ids=lambda kind: kind.name)
@pytest.mark.parametrize(("name", "marks"), [("train", "results.json"), ("discover", "discovery.json")])
def test_a_command_ends_with_its_answer(kind: Kind, name: str, marks: str, tmp_path: Path):
    path, run, content = tmp_path / "table.csv", tmp_path / "run", kind.made()
    path.write_bytes(content)
    # Which effects a search looks at is not asked here: by day two.
    more = ["fits=null"] if name == "train" else [] if EVERY else [among("force_offset", "friction_hysteresis")]
    ended = command(name, *PLAIN, f"data.path={path}", f"hydra.run.dir={run}", *more, folder=tmp_path)
    assert path.read_bytes() == content
    assert_ended(kind, ended, run, marks)


# --- what is no file -------------------------------------------------------------------------------------------------


def _odd(folder: Path) -> dict[str, Path]:
    """Paths that are no regular file, or none at all."""
    odd = {"device": Path("/dev/zero"), "terminal": Path("/dev/null"), "folder": folder, "nowhere": folder / "no"}
    odd |= {"pipe": folder / "pipe", "socket": folder / "socket", "NUL": Path("a\0b"), "long": folder / ("x" * 400)}
    odd |= {"loop": folder / "loop", "into a file": folder / "file" / "table.csv", "link to a pipe": folder / "link"}
    os.mkfifo(odd["pipe"])
    odd["loop"].symlink_to(odd["loop"])
    odd["link to a pipe"].symlink_to(odd["pipe"])
    (folder / "file").write_text("x")
    return odd


READERS = {
    "table": loaded,
    "members": read_members,
    "questions": lambda path: read_questions(path, Columns()),
    "specimens": lambda path: read_specimens([str(path)]),
    "a mode's specimens": lambda path: read_specimens([f"UT={path}"]),
    "specimen.json": load_parameters,
    "bytes": read_bytes,
}


@pytest.mark.parametrize("reader", READERS)
def test_only_regular_files_are_read(reader: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)  # a socket's path must be short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        for what, path in _odd(tmp_path).items():
            with pytest.raises(UserError) as told:
                READERS[reader](path)
            assert len(str(told.value).splitlines()) == 1, what
            assert "\0" not in str(told.value), what


def test_the_digest_of_what_is_no_file_waits_for_nothing(tmp_path: Path):
    for path in _odd(tmp_path).values():
        assert data_version(CsvData(name="csv", path=path, accuracy=None)) == "" or path.is_file()


def test_a_folder_of_raw_files_that_is_none(tmp_path: Path):
    for path in _odd(tmp_path).values():
        if path != tmp_path:
            with pytest.raises(UserError):
                table_files(path)


@pytest.mark.parametrize("name", usually("train", nightly=["discover"]))
def test_a_command_opens_no_device_and_no_pipe(name: str, tmp_path: Path):
    for what, path in _odd(tmp_path).items():
        if what == "NUL":
            continue  # no command line can hold one
        words = [f"data.path={path}", f"hydra.run.dir={tmp_path / 'run'}"]
        ended = command(name, "data=csv", *words, folder=tmp_path)
        assert (ended.status, ended.err.startswith("error: ")) == (1, True), what
        assert not (tmp_path / "run").exists()


def test_a_file_too_large_is_told_with_its_size_and_the_limit_can_be_raised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    large = tmp_path / "large.csv"
    with large.open("wb") as file:
        file.truncate(3_000_000_000)  # A hole: it takes no room on the disk.
    with pytest.raises(UserError, match=rf"3 GB of at most 2\).*{LARGER}"):
        loaded(large)
    with pytest.raises(UserError, match=LARGER):
        settings(TrainSettings, ["data=csv", f"data.path={large}"])
    path = tmp_path / "table.csv"
    path.write_bytes(good())
    monkeypatch.setenv(LARGER, "1e-6")
    with pytest.raises(UserError, match="larger than is read"):
        loaded(path)
    monkeypatch.setenv(LARGER, "4")
    assert len(loaded(path).table) == 80
    for wrong in ("much", "-1", "nan", "0"):
        monkeypatch.setenv(LARGER, wrong)
        with pytest.raises(UserError, match="is no size"):
            read_bytes(path)


def test_a_file_without_a_stated_size_ends_at_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """As the files of /proc are: regular, and longer than they say."""
    path = tmp_path / "table.csv"
    path.write_bytes(good())
    whole, real = len(good()), os.fstat
    monkeypatch.setattr("freelearn.common.files.os.fstat", lambda fd: os.stat_result((*real(fd)[:6], 0, 0, 0, 0)))
    assert len(read_bytes(path)) == whole
    monkeypatch.setattr("freelearn.common.files.CHUNK", 100)
    assert len(read_bytes(path)) == whole


# --- the same of what else reads a table -----------------------------------------------------------------------------


def test_a_marked_copy_of_every_table_that_is_read_is_read(tmp_path: Path):
    """Marks go to the right line, whatever stands before the header."""
    for kind in chosen([kind for kind in KINDS if kind.answer != REFUSE], 15):
        path = tmp_path / "table.csv"
        path.write_bytes(kind.made())
        lines = read_table(path).lines
        if len(lines) < 20:
            continue
        path.write_bytes(mark_left_out(kind.made(), [int(lines[11])]))
        again = read_table(path)
        assert 11 in np.flatnonzero(again.table["left_out"] == 1), kind.name
        assert again.lines.tolist() == lines.tolist(), kind.name


def test_intake_answers_every_kind_too(tmp_path: Path):
    """A laboratory's reader is given the same files: a table or one sentence, and the same numbers where both read."""
    for kind in chosen(KINDS, 60):
        read = raw_answer(kind)
        if isinstance(read, str):
            assert len(read) < 2000, kind.name
            assert kind.answer != ACCEPT or kind.name in UNREAD_BY_INTAKE, (kind.name, read)
        elif kind.same:
            for name in HEADER:
                np.testing.assert_array_equal(read[name], good_table()[name], err_msg=f"{kind.name}: {name}")


def raw_answer(kind: Kind) -> dict[str, np.ndarray] | str:
    """The columns' numbers, or what is said instead."""
    try:
        raw = raw_table(kind.made(), "raw.csv")
        return {name: raw.numbers(name) for name in HEADER if name in raw.columns}
    except UserError as told:
        return str(told)


# A number that no reader of raw files believes.
UNREAD_BY_INTAKE = {"number of 5000 digits"}


def test_a_question_beyond_every_bed_is_refused(tmp_path: Path):
    path = tmp_path / "questions.csv"
    for column in ("force_n", "pressure_kpa", "elongation_mm", "twist_deg", "moment_nmm"):
        path.write_bytes(with_cell(5, column, "1e200"))
        with pytest.raises(UserError, match=f"line 5, {column}"):
            read_questions(path, Columns())


def test_a_member_beyond_every_bed_is_refused(tmp_path: Path):
    path = tmp_path / "members.csv"
    path.write_text("member,gamma_deg,length_mm,inner_radius_mm,outer_radius_mm\n1,40,1e200,4,6\n2,40,90,4,1e150\n")
    with pytest.raises(UserError, match=r"line 2, length_mm(.|\n)*line 3, outer_radius_mm"):
        read_members(path)


def test_a_specimen_beyond_every_rubber_is_refused(tmp_path: Path):
    path = tmp_path / "specimen.csv"
    path.write_text("mode,stretch,stress_mpa\nUT,1e200,1\nUT,2,1e160\nUT,2,1_0\n")
    with pytest.raises(UserError, match=r"line 2, stretch(.|\n)*line 3, stress_mpa(.|\n)*line 4.*without _"):
        read_specimens([str(path)])


def test_large_sample_numbers_cost_no_memory():
    """As many numbers as the largest one would be gigabytes."""
    assert overlap("all", f"sample{10**18 - 1}")
    assert not overlap("sample999999998", "sample1+sample2")
    with pytest.raises(UserError, match="Unknown set"):
        samples_of("sample" + "9" * 5000, np.array([1, 2]))
