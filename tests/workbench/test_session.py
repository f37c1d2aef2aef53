"""What a session keeps, refuses and runs, without a browser."""

import shlex
import time

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from freelearn.workbench import session as module
from freelearn.workbench.question import Question
from freelearn.workbench.session import Sessions


@pytest.fixture
def sessions(tmp_path):
    sessions = Sessions(tmp_path / "work")
    yield sessions
    sessions.close()


def finish(session, seconds=90):
    end = time.monotonic() + seconds
    while session.busy and time.monotonic() < end:
        session.poll()
        time.sleep(0.05)
    assert not session.busy


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


def test_a_file_that_is_too_large_is_refused_in_words(sessions, monkeypatch):
    monkeypatch.setattr(module, "LARGEST_CSV", 1000)
    session = sessions.get("")[1]
    session.upload("big.csv", b"x" * 1001)
    assert "more than the page takes" in session.problem
    assert session.job is None
    assert not list(session.folder.glob("*.csv"))


@pytest.mark.slow
def test_an_upload_cannot_choose_where_it_goes_and_its_faults_are_told(sessions):
    session = sessions.get("")[1]
    session.upload("../../evil.csv", b"sample,gamma_deg\n1,nonsense\n")
    finish(session)
    assert {path.parent for path in session.folder.parent.parent.rglob("*.csv")} == {session.folder}
    assert "length_mm" in session.problem
    assert not session.sets
    assert not session.ready


@pytest.mark.slow
def test_a_cancelled_job_is_gone_at_once_and_the_next_one_runs(sessions):
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
def test_a_mistake_of_the_users_is_told_and_loses_nothing(sessions):
    session = sessions.get("")[1]
    session.choose(model="mlp", effects=("wall_stiffening",))
    session.start("train")
    finish(session)
    assert session.job.status == "failed"
    assert "wall_stiffening" in session.job.text
    assert session.runs == []
    assert session.ready


@pytest.mark.parametrize("path", ["/data/mine.csv", "/data/it's mine, [really] = {x} \\ ü.csv", "/a b/c.csv"])
def test_the_command_and_hydra_read_a_path_as_it_is(path):
    question = Question(data="csv", path=path, name="x", train="all", effects=("twist_offset", "end_clamps"))
    shell = shlex.split(question.command("train"))
    assert shell[:2] == ["python", "train.py"]
    assert shell[2:] == question.overrides("train")
    parsed = {o.key_or_group: o.value() for o in OverridesParser.create().parse_overrides(shell[2:])}
    assert str(parsed["data.path"].text if hasattr(parsed["data.path"], "text") else parsed["data.path"]) == path
    assert parsed["effects"] == ["twist_offset", "end_clamps"]
