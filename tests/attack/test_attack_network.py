"""Every command watched from inside: no connection, no other process, nothing executed, no file outside its folders."""

import json
import pickle
import socket
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from forked_commands import Commands
from small_runs import make_csv
from watched import events

from freelearn.cli.hydra_app import check_words
from freelearn.common.errors import UserError

CODE = "__import__('os').system('touch {0}/executed')"
# Reading a recipe must not make of it what YAML can make of it.
RECIPE = "columns: !!python/object/apply:os.system ['touch {0}/executed']\n"


class Evil:
    """Executes something where it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self):
        import os

        return os.system, (f"touch {self.folder}/executed",)


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """Tables and files that hold code, in words that their readers might take for it."""
    folder = tmp_path_factory.mktemp("watched").resolve()
    table = pd.read_csv(make_csv(folder / "table.csv"))
    code = CODE.format(folder)
    remarks = [f"=cmd|'/c touch {folder}/executed'!A1", code, "${oc.env:HOME}", f"$(touch {folder}/executed)"]
    table["remark"] = [remarks[n % len(remarks)] for n in range(len(table))]
    table.to_csv(folder / "table.csv", index=False)
    questions = table.head(3).assign(force_n="", moment_nmm="")
    questions.to_csv(folder / "questions.csv", index=False)
    raw = ["dl_mm,phi_deg,P_kPa,F_N,M_Nmm,note", "0,0,0,-0.1,0.3," + code]
    raw += ["0,0,30,-2.2,-8.1,x", "2,0,0,-3.1,0.5,x", "2,0,30,-5.0,-8.6,x"]
    (folder / "raw.csv").write_text("\n".join(raw) + "\n")
    (folder / "recipe.yaml").write_text(RECIPE.format(folder))
    (folder / "evil.pickle").write_bytes(pickle.dumps(Evil(folder)))
    config = folder / "config"
    config.mkdir()
    evil = {"callbacks": {"evil": {"_target_": "os.system", "command": f"touch {folder}/executed"}}}
    (config / "train.yaml").write_text(json.dumps({"hydra": evil}))
    # A file beside the data that is named like a module must not be imported.
    (folder / "sitecustomize.py").write_text(f"import os; os.system('touch {folder}/executed')\n")
    (folder / "yaml.py").write_text(f"import os; os.system('touch {folder}/executed')\n")
    return folder


@pytest.fixture(scope="module")
def watched(place, tmp_path_factory):
    log = tmp_path_factory.mktemp("log") / "events"
    before = f"import watched; watched.watch({str(log)!r}, {str(place)!r})"
    with Commands(place, before) as commands:
        commands.run("train", "--help")
        yield commands, log


def good(place: Path) -> list[list[str]]:
    """Commands that work, in this order: later ones read what earlier ones wrote."""
    data = ["data=csv", f"data.path={place / 'table.csv'}", "train=all", f"fits={place / 'fits'}"]
    questions = place / "questions.csv"
    search = [*data[:2], "train=sample3"]
    return [
        ["train", *data, f"hydra.run.dir={place / 'run'}"],
        ["train", "-m", *data, "model=linear,continuum", "figures=false", f"hydra.sweep.dir={place / 'sweep'}"],
        ["discover", *search, f"hydra.run.dir={place / 'search'}"],
        ["predict", f"run={place / 'run'}", f"data.path={questions}", f"hydra.run.dir={place / 'answers'}"],
        ["plan", f"run={place / 'run'}", "rows=4", "goal=narrow", "parameter=C2", f"hydra.run.dir={place / 'plan'}"],
        ["gather", str(place / "sweep"), "--out", str(place / "gathered")],
        ["figures", str(place / "sweep"), "--out", str(place / "figures")],
        ["intake", f"data.path={place / 'raw.csv'}", f"hydra.run.dir={place / 'draft'}"],
    ]


def bad(place: Path) -> list[list[str]]:
    """Commands that would execute something, were they let."""
    run = f"hydra.run.dir={place / 'bad'}"
    return [
        ["intake", f"data.path={place / 'raw.csv'}", f"recipe={place / 'recipe.yaml'}", run],
        ["train", "--experimental-rerun", str(place / "evil.pickle")],
        ["train", "--config-dir", str(place / "config"), run],
        ["train", "--config-path", str(place / "config"), run],
        ["train", f"hydra.searchpath=[file://{place / 'config'}]", run],
        ["train", f"+hydra.callbacks.evil={{_target_:os.system,command:'touch {place}/executed'}}", run],
        ["train", "hydra.job_logging.handlers.evil={class:os.system}", run],
        ["train", f"+hydra.job.env_set.FREELEARN_EFFECTS={place / 'yaml.py'}", run],
        ["train", "hydra.launcher._target_=os.system", run],
        ["predict", f"run={place / 'evil.pickle'}", run],
        ["train", f"data={CODE.format(place)}", run],
        ["train", f"effects=[{CODE.format(place)}]", run],
    ]


@pytest.mark.slow
@pytest.mark.nightly
def test_no_command_connects_starts_executes_or_writes_elsewhere(place, watched):
    commands, log = watched
    for words in good(place):
        ended = commands.run(*words)
        assert ended.status == 0, (words, ended.told)
    for words in bad(place):
        ended = commands.run(*words)
        assert ended.status == 1, (words, ended.told)
        assert ended.err.startswith("error: "), (words, ended.told)
        assert "Traceback" not in ended.told, words
    assert not (place / "executed").exists()
    # Loading the libraries is not the commands' doing.
    assert [event for event in events(log) if event["forked"]] == []


@pytest.mark.slow
def test_what_is_watched_for_would_be_seen(tmp_path):
    (tmp_path / "mine.py").write_text("x = 1\n")
    with socket.create_server(("127.0.0.1", 0)) as server:
        code = (
            f"import watched; watched.watch({str(tmp_path / 'log')!r}, {str(tmp_path)!r})\n"
            f"import socket, os, runpy; socket.create_connection({server.getsockname()!r})\n"
            f"socket.socket().bind(('127.0.0.1', 0)); os.system('true')\n"
            f"runpy.run_path({str(tmp_path / 'mine.py')!r})\n"
            f"open({str(tmp_path.parent / 'elsewhere')!r}, 'w'); socket.getaddrinfo('localhost', 80)\n"
        )
        support = Path(__file__).parents[1] / "support"
        subprocess.run([sys.executable, "-c", code], cwd=support, check=True, timeout=60)
    seen = {event["event"] for event in events(tmp_path / "log")}
    assert seen == {"socket.connect", "socket.bind", "socket.getaddrinfo", "os.system", "exec", "open"}


REFUSED = (
    "hydra.callbacks.x._target_=os.system", "+hydra.callbacks={x:{}}", "hydra/job_logging=default", "~hydra.callbacks",
    "hydra.searchpath=[pkg://evil]", "hydra={}", "++hydra.job.env_set.X=1", "hydra.launcher._target_=os.system",
    "hydra/callbacks@hydra.run=x", "hydra.runtime.x=1", "hydra.job.config={}",
)  # fmt: skip
TAKEN = (
    "hydra.run.dir=a/b", "hydra.sweep.dir=x", "hydra.sweep.subdir=${hydra.job.num}", "hydra/launcher=joblib",
    "hydra.launcher.n_jobs=2", "hydra/sweeper=basic", "model=linear", "data.path=my_target_file.csv", "~experiment",
    "hydra.mode=MULTIRUN",
)  # fmt: skip


@pytest.mark.parametrize("word", REFUSED)
def test_words_that_could_name_code_are_refused(word):
    with pytest.raises(UserError, match="could execute code"):
        check_words(["model=linear", word])


def test_other_words_are_taken():
    check_words(TAKEN)
    with pytest.raises(UserError, match="not UTF-8"):
        check_words(["hydra.run.dir=\udcff"])
