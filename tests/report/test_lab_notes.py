"""The paragraph for the laboratory's notebook: what it says of parameters that the rows do not determine."""

import math

from freelearn.records.estimates import Estimate
from freelearn.report.tables.lab_notes import _parameters


def test_digits_stand_only_where_the_rows_say_something():
    lost = Estimate("C1", 2.2e17, "Pa", 5.8e40, 0.0, math.inf, kind="normal")
    held = Estimate("C2", 1e6, "Pa", 0.0, 1e6, 1e6, kind="normal", beforehand="fixed")
    gain = Estimate("force_gain.gain", -0.0912, "1", 0.0022, -0.095, -0.087, kind="normal")
    assert _parameters([lost, held, gain]) == [
        "Parameters: C1 not determined by these rows, C2 = 1e+06 Pa (fixed), force_gain.gain = (−0.0912 ± 0.0022)."
    ]


def test_what_was_learned_beside_the_parameters_is_counted():
    one = Estimate("C1", 1.3e5, "Pa", 2e4, 9.7e4, 1.8e5, kind="normal")
    assert _parameters([one], 105) == ["Parameters: C1 = (1.3e+05 ± 2e+04) Pa, and 105 learned coefficients."]
