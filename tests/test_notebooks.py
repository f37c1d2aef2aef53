"""The notebooks of the documentation run from their first cell to their last, and say what the pages show."""

import re
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs").glob("*.ipynb"))


def printed(notebook) -> list[str]:
    said = [output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", [])]
    return [re.sub(r"[\d.e+−-]+", "#", text) for text in said if text]


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
# The kernel's own messages on sockets; nothing of ours.
@pytest.mark.filterwarnings("ignore")
def test_a_notebook_runs(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    # What is printed is what the page shows, but for digits.
    assert printed(notebook) == printed(nbformat.read(path, as_version=4))
    shown = [data for cell in notebook.cells for o in cell.get("outputs", []) for data in o.get("data", {})]
    assert "text/html" in shown


def test_the_notebooks_are_four_steps_one_after_another():
    assert [path.stem[:2] for path in NOTEBOOKS] == ["1_", "2_", "3_", "4_"]
