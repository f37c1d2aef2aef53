"""per_sample=false: one value for all samples, and for all members of an end block."""

import json

import beds
import pytest
from nightly import usually
from rich.console import Console
from small_runs import make_csv, run

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.physics.effects.registry import EFFECTS


def parameters(folder) -> dict:
    return json.loads((folder / "results.json").read_text())["parameters"]


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """What reads a table of three actuators on one end block, whose braid angles are all off by 0.03 rad."""
    return beds.write("block", {"fiber_misalignment": {"angle": 0.03}}, tmp_path_factory.mktemp("block"))


def test_members_share_their_values_where_samples_do(block, tmp_path):
    effects = ["train=all", "effects=[fiber_misalignment,off_axis]", "figures=false"]
    run(tmp_path / "own", *block, *effects)
    run(tmp_path / "shared", *block, *effects, "per_sample=false")
    own, shared = parameters(tmp_path / "own"), parameters(tmp_path / "shared")
    for name in ("fiber_misalignment.angle", "off_axis.squared_distance"):
        assert {f"{name}[{n}]" for n in (1, 2, 3)} <= set(own)
        assert name not in own
        assert name in shared
        assert f"{name}[1]" not in shared
    # They were built with the same error, and all three together tell it better than each its own.
    angle = shared["fiber_misalignment.angle"]
    assert abs(angle["value"] - 0.03) < 4 * angle["stderr"]
    assert angle["stderr"] < min(own[f"fiber_misalignment.angle[{n}]"]["stderr"] for n in (1, 2, 3))


@pytest.mark.parametrize("shared", usually(True, nightly=[False]))
def test_a_search_asks_for_one_value_or_one_of_each_member(shared, block, tmp_path):
    candidates = ["fiber_misalignment", "force_gain", "wall_stiffening", "wall_modulus"]
    overrides = [*block, "train=all", "figures=false", f"per_sample={'false' if shared else 'true'}"]
    overrides += [f"ruled_out=[{','.join(sorted(set(EFFECTS) - set(candidates)))}]"]
    with open(tmp_path / "terminal.txt", "w") as file:
        discover(settings(DiscoverSettings, overrides), tmp_path / "search", Console(file=file, width=100))
    found = json.loads((tmp_path / "search/discovery.json").read_text())
    assert found["effects"] == ["fiber_misalignment"]
    labels = {name for name in found["trail"][-1]["parameters"] if name.startswith("fiber_misalignment.")}
    each = {f"fiber_misalignment.angle[{n}]" for n in (1, 2, 3)}
    assert labels == ({"fiber_misalignment.angle"} if shared else each)
    # How much stiffer one tube is than the first is no question where all are alike.
    reasons = [entry["reason"] for entry in found["candidates"] if entry["effect"] == "wall_modulus"]
    assert any("alike" in str(reason) for reason in reasons) is shared


def test_samples_share_their_values_too(tmp_path):
    path = make_csv(tmp_path / "two.csv", 1200)
    given = ["data=csv", f"data.path={path}", "train=all", "effects=[twist_offset,force_gain]", "figures=false"]
    run(tmp_path / "own", *given)
    run(tmp_path / "shared", *given, "per_sample=false")
    assert {"twist_offset.angle[3]", "twist_offset.angle[6]", "force_gain.gain"} <= set(parameters(tmp_path / "own"))
    assert {"twist_offset.angle", "force_gain.gain"} <= set(parameters(tmp_path / "shared"))
    assert "twist_offset.angle[3]" not in parameters(tmp_path / "shared")
