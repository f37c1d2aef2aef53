"""docs/effects.md says what the classes say."""

import re

from conftest import ROOT

from freelearn.data.beds import BEDS
from freelearn.physics.effects.registry import EFFECTS
from freelearn.testing.effect_page import effects_page

PAGE = (ROOT / "docs/effects.md").read_text(encoding="utf-8")


def test_the_page_is_made_from_the_classes():
    assert effects_page() == PAGE, "run python -m freelearn.testing.effect_page > docs/effects.md"


def test_what_is_per_sample_is_said_alike_everywhere():
    """The table, the flags, and the parameters that a model of two samples really has."""
    rows = re.findall(r"^\| \w+ \| `(\w+)` \| .*? \| (yes|no) \| .*? \| .* \|$", PAGE, re.MULTILINE)
    assert [name for name, _ in rows] == list(EFFECTS)
    for name, said in rows:
        labels = list(EFFECTS[name]([3, 5]).declared())
        assert {label.endswith(("[3]", "[5]")) for label in labels} == {said == "yes"}, name
    # What belongs to the rig is shared.
    shared = {name for name, said in rows if said == "no"}
    assert {"length_compliance", "twist_compliance", "force_gain", "sensor_crosstalk", "pressure_gain"} <= shared


def test_the_page_says_on_which_beds_an_effect_can_be_told():
    """As the effect itself answers, bed by bed."""
    rows = re.findall(r"^\| \w+ \| `(\w+)` \| .*? \| (?:yes|no) \| (.*?) \| .* \|$", PAGE, re.MULTILINE)
    assert [name for name, _ in rows] == list(EFFECTS)
    for name, said in rows:
        if said.startswith("all"):
            beds = set(BEDS) - set(said.removeprefix("all but ").split(", "))
        else:
            beds = set(said.split(", "))
        assert beds == {bed for bed in BEDS if EFFECTS[name].untold(bed) is None}, name
