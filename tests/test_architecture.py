"""The rooms import one way, and the drawing of them says the same as the rule."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import tomllib
from conftest import ROOT

from freelearn.common.package import VERSION

if sys.version_info < (3, 11):
    pytest.skip("tomllib came with Python 3.11", allow_module_level=True)


def rooms() -> list[set[str]]:
    """The contract's layers, from the foundation up."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [set(layer.split(" | ")) for layer in reversed(layers)]


def test_every_room_imports_only_rooms_above_it_and_there_are_no_circles():
    check = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run([check, "--no-cache"], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout
    assert "4 kept, 0 broken" in done.stdout


def test_the_drawing_is_the_rule():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    (drawing,) = re.findall(r"```\n(common.*?)```", text, re.DOTALL)
    drawn = [set(re.split(r" · ", re.split(r"\s{2,}", line)[0])) for line in drawing.splitlines() if line.strip(" │")]
    assert drawn == rooms()


def test_every_part_of_the_package_has_its_room():
    there = {p.stem for p in (ROOT / "freelearn").iterdir() if p.suffix == ".py" or (p / "__init__.py").exists()}
    assert there - {"__init__"} == set().union(*rooms())


def test_tests_and_experiments_do_not_import_each_other():
    for path in (ROOT / "tests").rglob("*.py"):
        assert not re.search(r"(from|import) (experiments|benchmark|hidden_effects)\b", path.read_text()), path
    names = {p.stem for p in (ROOT / "tests").rglob("*.py")}
    for path in (ROOT / "experiments").rglob("*.py"):
        imported = set(re.findall(r"^(?:from|import) (\w+)", path.read_text(), re.MULTILINE))
        assert imported.isdisjoint(names - {"search", "models", "commands"}), path


def test_the_package_and_its_metadata_have_one_version():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == VERSION
