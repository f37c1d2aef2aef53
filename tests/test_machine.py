"""What a computation asks of the machine."""

import os
import resource
import subprocess
import sys

import pytest

READY = """
import resource, torch
from freelearn.common.cores import configure_runtime
configure_runtime()
"""
FAULTS = """
def steps(count):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(count):
        [torch.ones(500_000, dtype=torch.float64) for _ in range(20)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
steps(10)
print(steps(50))
"""


def printed(script, threads):
    others = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    asked = {"OMP_NUM_THREADS": threads} if threads else {}
    how = {"capture_output": True, "text": True, "check": True, "timeout": 120}
    ran = subprocess.run([sys.executable, "-c", script], env=others | asked, **how)
    return int(ran.stdout)


@pytest.mark.skipif("CS_GNU_LIBC_VERSION" not in getattr(os, "confstr_names", {}), reason="asks GNU's C library")
def test_memory_that_a_step_frees_is_there_for_the_next_one():
    """Twenty tensors of four megabytes are 20,000 pages: cleared again in each of 50 steps they would be a million."""
    assert printed(READY + FAULTS, "1") < 80_000_000 / resource.getpagesize()


@pytest.mark.parametrize(("asked", "got"), [("", 1), ("2", 2)])
def test_one_thread_unless_more_are_asked_for(asked, got):
    assert printed(READY + "print(torch.get_num_threads())", asked) == got


def test_where_threads_share_the_work_no_copy_waits_for_them():
    """A copy of a process has none of its threads: the sum of a large tensor would never end in it."""
    large = "float(torch.ones(4_000_000).sum())"
    script = f"{READY}from freelearn.common.cores import side_by_side\n{large}\n"
    assert printed(f"{script}print(int(sum(side_by_side([lambda: {large}] * 3))))", "2") == 12_000_000
