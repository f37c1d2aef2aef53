"""How sure a search's claim is, on the page: checks, sets that are as good, shares; and an undecided table."""

import json
from dataclasses import replace
from html import unescape

import pytest
from written_searches import write_search

from freelearn.workbench.panels.effects_panel import Effects
from freelearn.workbench.panels.outcome import Answer, Outcome
from freelearn.workbench.panels.results import Claim

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")

SEARCH = "discover_0123456789"
CHECKS = [
    {"name": "stability", "result": "pass", "figure": 0.0, "threshold": 0.333, "says": "No other comes near.",
     "decides": True},
    {"name": "order of measuring", "result": "cannot_tell", "figure": None, "threshold": None,
     "says": "Too few rows.", "decides": False},
    {"name": "black box", "result": "cannot_tell", "figure": 0.12, "threshold": 0.08,
     "says": "A <b>forest</b> would see nothing either.", "decides": True},
]  # fmt: skip
MODELS = [
    {"effects": ["end_clamps", "twist_offset"], "E_heldout": 0.0123, "evidence": -3.0, "parameters": {},
     "probability": 0.75},
    {"effects": [], "E_heldout": 0.0125, "evidence": -4.0, "parameters": {}, "probability": 0.25},
]  # fmt: skip
UNDECIDED = {
    "verdict": "undecided", "says": "Undecided: there are too few rows.", "effects": ["end_clamps"],
    "referee": CHECKS, "models": MODELS, "shares": {"end_clamps": 0.75, "twist_offset": 0.7, "force_gain": 1e-7},
}  # fmt: skip


@pytest.fixture
def searched(sessions):
    """A session after a search, of which discovery.json says this as well."""

    def made(**more):
        session = sessions.get("")[1]
        write_search(session.folder / SEARCH)
        path = session.folder / SEARCH / "discovery.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | more))
        session.search = {"folder": SEARCH, "question": session.question}
        session.save()
        return session

    return made


def shown(part):
    part.refresh()
    return part


def test_checks_sets_and_shares_are_shown_and_what_stands_against_the_claim_first(searched):
    page = shown(Claim(searched(**UNDECIDED)))
    assert page.view.visible
    assert page.against.object.count("<p") == 1
    assert "black box, cannot tell: A <b>forest</b> would see nothing either." in unescape(page.against.object)
    # Text of a file is text.
    assert "<b>" not in page.against.object + page.checks.object
    names = [page.checks.object.index(f">{name}<") for name in ("black box", "stability", "order of measuring")]
    assert names == sorted(names)
    assert "<td>0.12</td><td>0.08</td>" in page.checks.object
    assert ">cannot tell<" in page.checks.object
    assert ">end_<wbr>clamps + twist_<wbr>offset</td><td>75.0</td><td>1.230</td>" in page.models.object
    assert ">no effect</td><td>25.0</td>" in page.models.object
    assert ">twist_<wbr>offset</td><td>70.0</td>" in page.shares.object
    # One in ten million is nothing to tell.
    assert "force_gain" not in page.shares.object


def test_a_search_of_former_times_and_none_at_all_show_nothing(searched, sessions):
    assert not shown(Claim(searched())).view.visible
    assert not shown(Claim(sessions.get("")[1])).view.visible


def test_of_an_undecided_table_nothing_is_said_to_be_found_or_to_be_complete(searched):
    session = searched(**UNDECIDED)
    session.adopt()
    outcome, effects = Outcome(session), shown(Effects(session))
    outcome.refresh(False)
    assert "Undecided: there are too few rows." in outcome.verdict.object
    assert outcome.use.name == "Add what it is most probably"
    assert "cannot tell" in effects.where.object
    assert "Nothing systematic is left" not in effects.where.object
    proposed = searched()
    proposed.adopt()
    outcome, effects = Outcome(proposed), shown(Effects(proposed))
    outcome.refresh(False)
    assert outcome.use.name == "Add what was found"
    assert "Nothing systematic is left" in effects.where.object


def test_the_sealed_answer_opens_after_a_search_and_is_closed_again_for_another(searched):
    session = searched()
    page = shown(Answer(session))
    # Of data that hide nothing there is none.
    assert not page.view.visible
    session.question = replace(session.question, data="hidden")
    session.search = session.search | {"question": session.question}
    for name, hidden in ((SEARCH, {"force_gain": {"gain": 0.03}}), ("discover_fedcba9876", {})):
        write_search(session.folder / name)
        (session.folder / name / "sealed_answer.json").write_text(json.dumps({"hidden": hidden}))
        session.search = session.search | {"folder": name}
        page.refresh()
        assert page.view.visible
        assert page.open.visible
        assert "Hidden was" not in page.told.object
        page.open.clicks += 1
        assert not page.open.visible
        said = "force_gain (gain = 0.03)" if hidden else "nothing"
        assert f"Hidden was: {said}." in page.told.object
    session.search = None
    assert not shown(page).view.visible
