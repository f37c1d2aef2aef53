"""Work side by side: the same results on any number of cores, errors raised, no process left."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from hidden_tables import table

from freelearn.common.cores import CORES, cores, limited, side_by_side
from freelearn.common.progress import tell, watched
from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import build_model


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    """As on a machine that has them."""
    monkeypatch.setenv(CORES, "2")
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1})


def test_results_come_in_the_order_of_the_jobs():
    told = side_by_side([lambda n=n: (n, os.getpid()) for n in range(50)])
    assert [n for n, _ in told] == list(range(50))
    assert len({process for _, process in told}) <= 2


def children() -> set[str]:
    """Processes that this one has started and that are still there."""
    return set(Path("/proc/thread-self/children").read_text().split())


def test_tensors_come_back_to_the_last_bit():
    made = torch.randn(3, 4, dtype=torch.float64)
    found = side_by_side([lambda: (made / 3, made > 0, torch.tensor(2))] * 4)
    for third, positive, two in found:
        assert torch.equal(third, made / 3)
        assert torch.equal(positive, made > 0)
        assert int(two) == 2


def test_an_error_of_a_job_is_raised_and_no_process_stays():
    def failing():
        raise ArithmeticError("no such thing")

    before = children()
    with pytest.raises(ArithmeticError, match="no such thing"):
        side_by_side([failing] * 6)
    assert children() <= before


def test_what_a_killed_copy_did_is_done_once_more():
    here = os.getpid()

    def job():
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return 7

    assert side_by_side([job] * 5) == [7] * 5


# How long a job takes that is not waited for [s].
JOB = 60
ENDLESS = r"""
import os, sys, time
from freelearn.common.cores import side_by_side
os.sched_getaffinity = lambda process: {0, 1}
def job():
    os.write(1, f"{os.getpid()}\n".encode())  # whole, whoever else writes
    time.sleep({job})
side_by_side([job] * 2)
"""


def test_copies_end_with_a_process_that_is_killed():
    """Else they would hold its folder's lock for as long as their jobs take."""
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS.replace("{job}", str(JOB))], stdout=subprocess.PIPE, text=True
    ) as process:
        working = {int(process.stdout.readline()) for _ in range(2)}
        assert process.pid in working
        process.kill()
        killed = time.monotonic()
        # Its output ends where nobody has it open any more.
        assert process.stdout.read() == ""
        assert time.monotonic() - killed < JOB / 2


def test_a_job_does_not_take_cores_that_are_taken():
    assert side_by_side([cores] * 6) == [1] * 6
    assert cores() == 2


def test_nobody_hears_of_work_in_a_copy():
    here, heard = os.getpid(), []
    with watched(lambda what, done, total: heard.append(os.getpid())):
        side_by_side([lambda: tell("working", 1, 2)] * 8)
    assert set(heard) <= {here}


def test_fewer_cores_can_be_asked_for(monkeypatch):
    with limited(1):
        assert cores() == 1
    monkeypatch.setenv(CORES, "1")
    assert cores() == 1
    monkeypatch.setenv(CORES, "many")
    assert cores() == 2


def told(found):
    models = [(m.effects, m.evidence, m.E_heldout, m.parameters) for m in found.models]
    checks = [(c.name, c.result, c.figure) for c in found.referee.checks]
    return found.verdict, found.effects, models, checks, [step.E_heldout for step in found.steps]


def test_a_search_says_the_same_on_any_number_of_cores():
    rows = Rows.from_table(table({"friction_hysteresis": {"force": 0.6, "moment": 0.02}}, share=0.05))
    library = ["friction_hysteresis", "force_offset", "pressure_gain", "length_offset"]
    asked = Question(lambda names: build_model("continuum", {}, names, [3, 6]), library, rows, PAPER, 0)
    with limited(1):
        alone = told(search(asked))
    assert told(search(asked)) == alone
    assert alone[0] == "named"
