"""Many fits and searches on one page: its memory, threads and open files, and the files on disk, stay as they are."""

import os
from dataclasses import dataclass
from pathlib import Path

import pytest
from attack_page import Tab, serving, waited
from nightly import EVERY
from small_runs import make_csv

pytestmark = pytest.mark.slow

FITS, SEARCHES = (1000, 200) if EVERY else (5, 1)
MODELS = ("continuum", "linear")
# The first ones read libraries, and search with each model that is searched with; further ones leave no new files.
WARM = 50 if EVERY else 3


@dataclass(frozen=True)
class Seen:
    """After so many fits: the page's resident memory [MB], its threads, what it has open, and the files on disk."""

    fits: int
    memory: float
    threads: int
    open: int
    files: int


def look(server, fits):
    process = Path(f"/proc/{server.process.pid}")
    files = sum(path.is_file() for path in server.folder.rglob("*"))
    tasks, handles = len(os.listdir(process / "task")), len(os.listdir(process / "fd"))
    return Seen(fits, server.memory, tasks, handles, files)


async def worked(server, table, fits, searches, told=print):
    """What was seen after each fit. Searches are spread among the fits."""
    tab, seen = await Tab.open(server), []
    await tab.change(tab.find(title="data"), "value", "csv")
    await tab.drop(tab.of("FileDropper")[0], name="mine.csv", data=table, chunk=1, total_chunks=1, type="text/csv")
    await tab.hear("mine.csv: ")
    for n in range(1, fits + 1):
        await tab.change(tab.find(title="model"), "value", MODELS[n % 2])
        await tab.click("Fit")
        await tab.hear("Fitting: done", 120)
        if n % (fits // searches) == 2:
            await tab.click("Find what is missing")
            await tab.hear("Searching: done", 300)
        seen.append(look(server, n))
        told(seen[-1])
    await tab.close()
    return seen


@pytest.mark.nightly
def test_memory_and_files_stay_as_they_are_over_many_fits_and_searches(tmp_path):
    table = make_csv(tmp_path / "mine.csv").read_bytes()
    with serving(tmp_path) as server:
        seen = waited(worked(server, table, FITS, SEARCHES))
        assert "Traceback" not in server.log
    warm, last = seen[WARM], seen[-1]
    assert last.files == warm.files
    assert last.threads <= warm.threads
    assert last.open <= warm.open + 2
    assert last.memory - warm.memory < 40
