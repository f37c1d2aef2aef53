"""What a session keeps, refuses and runs, without a browser."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from freelearn.workbench.panels.results import Suspects
from freelearn.workbench.state.question import Question
from freelearn.workbench.state.session import Sessions


def test_ids_are_only_what_the_program_gave_out(sessions, tmp_path):
    for asked in ("", "../../etc", "0123456789abcdef", "0123456789abcdeg", "a" * 300, "/", "\x00"):
        name, session = sessions.get(asked)
        assert name != asked
        assert session.folder.parent == tmp_path / "work"
    again, same = sessions.get(name)
    assert (again, same) == (name, session)


def test_two_sessions_do_not_share_what_was_chosen_and_a_restart_finds_it_again(sessions, tmp_path):
    (one, first), (_, second) = sessions.get(""), sessions.get("")
    first.choose(model="linear", train="all", effects=("twist_offset",))
    assert second.question == Question()
    restarted = Sessions(tmp_path / "work").get(one)[1]
    assert restarted.question == first.question


def test_bands_are_hidden_until_they_are_asked_for_again_and_nothing_is_computed_anew(sessions, tmp_path):
    name, session = sessions.get("")
    asked, version = session.question, session.version
    assert session.banded
    session.show_bands(True)
    assert session.version == version
    session.show_bands(False)
    assert session.version == version + 1
    assert (session.question, session.job) == (asked, None)
    assert not Sessions(tmp_path / "work").get(name)[1].banded
    # A session of former times knows nothing of them.
    state = session.folder / "state.json"
    state.write_text(json.dumps({k: v for k, v in json.loads(state.read_text()).items() if k != "banded"}))
    assert Sessions(tmp_path / "work").get(name)[1].banded


def test_a_file_that_is_too_large_is_refused_in_words(sessions, monkeypatch):
    monkeypatch.setattr("freelearn.workbench.state.session.LARGEST_CSV", 1000)
    session = sessions.get("")[1]
    session.upload("big.csv", b"x" * 1001)
    assert "more than the page takes" in session.problem
    assert session.job is None
    assert not list(session.folder.glob("*.csv"))


TABLE_WITH_FAULTS = (
    b"sample,gamma_deg,inner_radius_mm,step,elongation_mm,twist_deg,pressure_kpa\n1,nonsense,5,0,0,0,0\n"
)


@pytest.mark.slow
def test_an_upload_cannot_choose_where_it_goes_and_its_faults_are_told(sessions, finish):
    session = sessions.get("")[1]
    session.upload("../../evil.csv", TABLE_WITH_FAULTS)
    finish(session)
    assert {path.parent for path in session.folder.parent.parent.rglob("*.csv")} == {session.folder}
    assert "length_mm" in session.problem
    assert not session.sets
    assert not session.ready


@pytest.mark.slow
def test_a_cancelled_job_is_gone_at_once_and_the_next_one_runs(sessions, finish):
    session = sessions.get("")[1]
    session.choose(model="mlp", train="all")
    session.start("train")
    process = session.job.process
    session.cancel()
    assert session.job.status == "canceled"
    assert not process.is_alive()
    session.choose(model="linear", train="sample3")
    session.start("train")
    finish(session)
    assert session.job.status == "done", session.job.text
    assert session.read(session.runs[-1], "results.json")["model"] == "linear"


@pytest.mark.slow
def test_a_mistake_of_the_users_is_told_and_loses_nothing(sessions, finish):
    session = sessions.get("")[1]
    session.choose(model="mlp", effects=("wall_stiffening",))
    session.start("train")
    finish(session)
    assert session.job.status == "failed"
    assert "wall_stiffening" in session.job.text
    assert session.runs == []
    assert session.ready


SUSPECT = {
    "line": 4, "sample": 3, "step": 2, "elongation_mm": 1.0, "twist_deg": 0.0, "pressure_kpa": 20.0, "load": "force",
    "shown": -4.0, "expected": 4.0, "unit": "N", "sigmas": -80.0, "slip": "the sign turned", "lines": [4],
}  # fmt: skip
BLOCK = [SUSPECT | {"line": line, "load": "moment", "lines": [8, 9], "sigmas": 7.0} for line in (8, 9)]


class Done:
    """A job that has ended well as soon as somebody asks."""

    started: ClassVar[list] = []

    def __init__(self, kind, question, folder, fits):
        self.kind, self.folder, self.status, self.text, self.asked = kind, folder, "running", "", False
        self.started.append((kind, question))
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "table.json").write_text(json.dumps({"sets": ["all"], "rows": 9}))

    def poll(self):
        self.status = "done"
        return True

    def cancel(self):
        pass


@pytest.fixture
def searched(sessions, finish, monkeypatch):
    """A session whose latest discovery, with a given effect, suspects SUSPECT and BLOCK."""
    monkeypatch.setattr("freelearn.workbench.state.running.Job", Done)
    Done.started.clear()
    session = sessions.get("")[1]
    session.upload("mine.csv", "\n".join(["sample,force_n", *(f"3,{n}.50" for n in range(9)), ""]).encode())
    finish(session)
    session.choose(effects=("end_clamps",))
    session.start("discover")
    finish(session)
    session.choose(effects=("twist_offset",))
    (session.folder / session.search["folder"] / "discovery.json").write_text(
        json.dumps({"suspects": [SUSPECT, *BLOCK]})
    )
    Done.started.clear()
    return session


# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
OLD_NAMES = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


@OLD_NAMES
def test_suspected_readings_can_be_left_out_and_the_search_goes_again(searched, finish):
    page = Suspects(searched)
    page.refresh()
    assert page.view.visible
    assert list(page.boxes.options) == [
        "line 4: the force shows −4.00 N where +4.00 N was expected (−80 σ): the sign turned",
        "lines 8–9: the moment shows −4.00 N where +4.00 N was expected in line 8 (+7.0 σ): the sign turned",
    ]
    assert page.boxes.value == [0, 1]
    page.boxes.value = []
    assert page.leave_out.disabled
    page.boxes.value = [1]
    assert not page.leave_out.disabled
    before = searched.question
    page.leave_out.clicks += 1
    assert searched.busy
    page.refresh()
    assert (page.boxes.disabled, page.leave_out.disabled) == (True, True)
    finish(searched)
    assert [kind for kind, _ in Done.started] == ["check", "train", "discover"]
    # The question of that search, on another table; the page calls it by its old name.
    asked = searched.question
    assert asked == replace(before, path=asked.path, effects=("end_clamps",))
    assert asked.path != before.path
    assert Path(asked.path).read_text().splitlines() == [
        "sample,force_n,left_out",
        *(f"3,{n}.50,{'1' if n in (6, 7) else ''}" for n in range(9)),
    ]
    assert Path(before.path).read_text().startswith("sample,force_n\n")
    assert searched.search["question"] == asked
    # The new search says nothing of suspects: the list is gone.
    (searched.folder / searched.search["folder"] / "discovery.json").write_text(json.dumps({}))
    page.refresh()
    assert not page.view.visible


def test_results_of_other_data_wait_until_these_are_chosen_again(searched, finish):
    assert len(searched.comparable()) == 1
    name, effects = searched.question.path, searched.question.effects
    searched.upload("other.csv", b"sample,force_n\n1,2.5\n")
    finish(searched)
    assert searched.comparable() == []
    assert searched.discovery() is None
    searched.upload("mine.csv", Path(name).read_bytes())
    finish(searched)
    assert [run["question"].path for run in searched.comparable()] == [name]
    assert searched.question.effects == () != effects


@OLD_NAMES
def test_what_was_ticked_stays_while_the_page_is_drawn_anew(searched):
    page = Suspects(searched)
    page.refresh()
    page.boxes.value = [0]
    searched.save()
    page.refresh()
    assert page.boxes.value == [0]


def test_a_table_that_is_gone_is_told_and_nothing_runs(searched):
    Path(searched.question.path).unlink()
    searched.leave_out([4])
    assert "mine.csv cannot be read" in searched.problem
    assert Done.started == []


def test_what_is_left_out_of_nothing_runs_nothing(searched):
    searched.leave_out([])
    searched.choose(model="linear")
    searched.leave_out([4])
    assert Done.started == []


@pytest.mark.parametrize("path", ["/data/mine.csv", "/data/it's mine, [really] = {x} \\ ü.csv", "/a b/c.csv"])
def test_the_command_and_hydra_read_a_path_as_it_is(path):
    question = Question(data="csv", path=path, name="x", train="all", effects=("twist_offset", "end_clamps"))
    shell = shlex.split(question.command("train"))
    assert shell[:2] == ["python", "train.py"]
    assert shell[2:] == question.overrides("train")
    parsed = {o.key_or_group: o.value() for o in OverridesParser.create().parse_overrides(shell[2:])}
    assert str(parsed["data.path"].text if hasattr(parsed["data.path"], "text") else parsed["data.path"]) == path
    assert parsed["effects"] == ["twist_offset", "end_clamps"]
