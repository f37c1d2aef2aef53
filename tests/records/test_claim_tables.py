"""How sure a claim is, as tables and in one sentence."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from freelearn.discovery.referee.case import PASS, Check
from freelearn.discovery.referee.referee import Referee
from freelearn.records.claims import RefereedRun, check_lines, checks_table, models_table, shares_table
from freelearn.records.verdict_words import verdict_in_words

GOOD = Check("stability", "pass", 0.0, 1 / 3, "Nothing else comes near.")
BAD = Check("bands", "fail", 0.7, 0.85, "95 % bands hold 70 %.")
OPEN = Check("black box", "cannot_tell", None, None, "There are too few rows.")
SEEN_IN_ROWS = Check("black box, rows left out", "fail", 0.6, 0.1, "A regression predicts 60 %.")
NOT_IN_ROWS = Check("black box, rows left out", "pass", 0.02, 0.1, "A regression predicts 2 %.")
NOT_IN_STATES = Check("black box, states left out", "pass", 0.01, 0.1, "A regression predicts 1 %.")
ASIDE = Check("parameters determined", "cannot_tell", None, 0.7, "The rows hardly determine C2.", decides=False)


def plain(*checks):
    return [check.plain() for check in checks]


def test_what_refutes_a_claim_stands_first_and_what_is_no_part_of_it_with_what_passed():
    table = checks_table(plain(ASIDE, GOOD, OPEN, BAD))
    assert [row[0] for row in table.rows] == ["bands", "black box", "parameters determined", "stability"]
    assert table.rows[0] == ("bands", "fail", "0.7", "0.85", "95 % bands hold 70 %.")
    assert table.rows[1][1:4] == ("cannot tell", "–", "–")
    assert [len(row) for row in checks_table(plain(GOOD), says=False).rows] == [4]
    assert check_lines(plain(ASIDE, GOOD, OPEN, BAD)) == [
        "bands, fail: 95 % bands hold 70 %.",
        "black box, cannot tell: There are too few rows.",
    ]


def test_checks_of_another_model_than_the_last_say_which_they_were_asked_of():
    (check,) = plain(Check("bands", PASS, 0.9, 0.8, "Fine."))
    assert checks_table([check]).caption == ""
    asked = checks_table([check], asked=["end_taper", "twist_offset"]).caption
    assert asked == "Asked of the model with end_taper + twist_offset; the last model keeps what of it stands."


def test_what_stands_of_a_claim_is_one_sentence():
    def said(claimed, verdict):
        return RefereedRun(Path(), claimed, verdict, []).stands()

    assert said("named", "named") == "What was claimed (named) stands."
    assert said("named", "unexplained") == "What was claimed (named) does not stand: unexplained."
    assert said("unexplained", "unexplained") == "Nothing was claimed (unexplained)."
    assert said("", "") == "Nothing was claimed."


def test_nothing_to_show_is_no_table():
    assert (checks_table([]), models_table([]), shares_table({}), shares_table({"end_clamps": 1e-4})) == (None,) * 4


def test_the_most_probable_effect_stands_first():
    rows = shares_table({"twist_offset": 0.2, "end_clamps": 0.9, "force_gain": 0.001}).rows
    assert rows == (("end_clamps", "90.0"), ("twist_offset", "20.0"))


def findings(verdict, claimed, effects=(), checks=(), shares=(), doubted=(), best=None, E=0.1, beside=()):
    """As far as the sentence looks at them. best: effects and error of the set that predicts best; E: what stands."""
    answer = SimpleNamespace(shares=dict(shares), doubted=list(doubted), beside=list(beside))
    return SimpleNamespace(
        verdict=verdict, claimed=claimed, effects=list(effects), classes=[], proposals=[], answer=answer,
        referee=Referee(list(checks)), final=SimpleNamespace(E_heldout=E),
        predicts_best=SimpleNamespace(effects=best[0], E_heldout=best[1]) if best else None,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("found", "told"),
    [
        (findings("undecided", "named", ["end_clamps"], [OPEN]),
         "Undecided: there are too few rows. If anything is missing, it is end_clamps."),
        (findings("undecided", "adequate", [], [GOOD], {"end_clamps": 0.5, "twist_offset": 0.3}),
         "Undecided: something may be missing, and these rows cannot tell what: "
         "end_clamps (50 %), twist_offset (30 %)."),
        (findings("unexplained", "named", ["end_clamps"], [GOOD, BAD]),
         "Unexplained: 95 % bands hold 70 %. end_clamps explains a part of it."),
        (findings("unexplained", "unexplained", [], [BAD]),
         "Unexplained: something systematic is left that no effect in the library accounts for."),
        (findings("unexplained", "unexplained", [], [SEEN_IN_ROWS, NOT_IN_STATES]),
         "Unexplained: what is left is the same in all rows of a state and tells nothing of another state: places that "
         "were set otherwise than the table says, or a load cell that was zeroed at each of them."),
        (findings("unexplained", "unexplained", [], [NOT_IN_ROWS, NOT_IN_STATES]),
         "Unexplained: something is left that no effect in the library accounts for, and that no regression predicts "
         "of other rows: errors that go on from row to row, such as a zero that wanders, would look like that."),
        (findings("undecided", "named", ["end_clamps"], [GOOD], {"end_clamps": 0.9, "twist_offset": 0.1},
                  ["end_clamps"]),
         "Undecided: one effect or several others together would explain these rows equally well: "
         "end_clamps (90 %), twist_offset (10 %)."),
        (findings("unexplained", "unexplained", ["end_clamps"], [BAD], best=(["end_clamps", "off_axis"], 0.0418)),
         "Unexplained: something systematic is left that no effect in the library accounts for. end_clamps explains a "
         "part of it. Of the sets looked at, end_clamps + off_axis predicts what was left out best (4.18 %), and "
         "explains nothing yet."),
        (findings("unexplained", "unexplained", [], [BAD], best=(["end_clamps"], 0.09)),
         "Unexplained: something systematic is left that no effect in the library accounts for."),
    ],
)  # fmt: skip
def test_the_sentence_says_what_keeps_a_claim_from_standing(found, told):
    assert verdict_in_words(found, []) == told


def test_a_claim_nothing_was_looked_for_beside_says_so():
    assert verdict_in_words(findings("named", "named", ["end_clamps"], [GOOD]), []) == (
        "Named: end_clamps was missing; whether more is missing these rows cannot tell."
    )
    seen = Check("black box, rows left out", "pass", 0.0, 0.1, "It sees nothing.")
    assert verdict_in_words(findings("named", "named", ["end_clamps"], [seen]), []) == (
        "Named: end_clamps was missing; with it nothing systematic is left."
    )


def test_what_a_model_needs_and_is_not_claimed_is_named():
    seen = Check("black box, rows left out", "pass", 0.0, 0.1, "It sees nothing.")
    found = findings("named", "named", ["sensor_lag"], [seen], beside=["force_offset"])
    assert verdict_in_words(found, []) == (
        "Named: sensor_lag was missing; with it and force_offset, which other forms of it may be, nothing systematic "
        "is left."
    )
