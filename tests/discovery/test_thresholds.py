"""The documentation's table of thresholds names each one there is, and none that is gone."""

import re
from pathlib import Path

from freelearn.discovery import thresholds

PAGE = Path(__file__).parents[2] / "docs" / "discovery.md"


def test_the_page_lists_every_threshold():
    decisions = PAGE.read_text().split("## Thresholds")[1].split("Those of the estimates")[0]
    assert set(re.findall(r"`([A-Z_]+)`", decisions)) == {name for name in vars(thresholds) if name.isupper()}


def test_the_thresholds_of_estimates_are_in_their_modules():
    estimates = PAGE.read_text().split("Those of the estimates")[1]
    listed = re.findall(r"\[\w+\.py\]\(\.\./([\w/]+\.py)\) \| (`[^|]*)\|", estimates)
    assert len(listed) > 10
    for module, names in listed:
        code = (PAGE.parents[1] / module).read_text()
        for name in re.findall(r"`([A-Z_]+)`", names):
            assert re.search(rf"^([A-Z_]+, )*{name}(, [A-Z_]+)* = ", code, re.MULTILINE), (module, name)
