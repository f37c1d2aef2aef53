"""What cannot be is not shown, and each figure says its rows."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch
from fitted_folders import continuum, grid, shown

from freelearn.data.error import Error
from freelearn.physics.models.hybrid import Hybrid
from freelearn.report.html.run_charts import chart_sections
from freelearn.report.plots.simple_plots import parity
from freelearn.report.tables.ranking_tables import staircase, staircase_table
from freelearn.report.tables.run_tables import beside, error_table, misfit_lines

FAILURE = SimpleNamespace(sentence=lambda: "predicted force is too high")


def run(n, of, E=0.0534, floor=0.01):
    table = pd.DataFrame({"elongation_mm": [0.0], "twist_deg": [0.0], "force_n": [1.0], "moment_nmm": [1.0]})
    error = Error(E, (("force", E), ("moment", 0.0)), n, of)
    misfit = SimpleNamespace(noise_floor=floor, failures=[FAILURE])
    return SimpleNamespace(
        table=table, errors={"all": error}, train="all", uncertainty=None, title="continuum", misfit=misfit, method=""
    )


def test_no_error_stands_for_a_set_of_which_few_rows_are_answered():
    few, enough = error_table(run(2, 17)), error_table(run(16, 17))
    assert few.rows[0][1:] == ("–", "–", "–", "2 of 17")
    assert "fewer than half" in few.caption
    assert enough.rows[0][1:] == ("5.34", "5.34", "0.00", "16 of 17")
    assert enough.caption == ""
    assert error_table(run(17, 17)).rows[0][-1] == "17"


def test_where_it_fails_is_not_told_of_a_model_as_good_as_noise():
    assert len(misfit_lines(run(9, 9))) == 2
    (said,) = misfit_lines(run(9, 9, E=0.0))
    assert said.endswith("This one errs by no more than that.")
    (said,) = misfit_lines(run(9, 9, floor=2.01))
    assert "201" not in said


def test_an_error_of_a_model_that_ran_away_has_no_digits():
    trail = pd.DataFrame({"step": ["a", "b"], "E_train": [0.1, 7665.21], "E_heldout": [0.1, 7665.21]})
    trail = trail.assign(noise_floor=[2.01, 0.01], sigmas_heldout=[9.0, 1.0])
    rows = staircase_table(trail).rows
    assert rows[0][1:4] == ("10.000", "10.000", "–")
    assert rows[1][1:4] == ("> 1000", "> 1000", "1.000")
    stairs = staircase(trail)
    assert stairs.labels == ["10 %", "> 1000 %"]
    assert stairs.E.max() == 1000
    assert np.isnan(stairs.floor[0])


def test_what_a_hybrid_has_learned_is_counted():
    model = Hybrid()
    assert model.coefficients == 0
    two = {"amplitude": torch.zeros(2, 7), "sensors": torch.zeros(2, 2, 2), "rubbed": torch.zeros(2, 2)}
    model.take(two)
    assert model.coefficients == 2 * (7 + 4 + 2)
    assert beside(model.coefficients) == "and 26 learned coefficients"


@pytest.mark.parametrize(("n", "of", "tells"), [(2, 17, False), (9, 17, True), (0, 0, True)])
def test_half_of_the_rows_tell(n, of, tells):
    assert Error(0.1, (("force", 0.1), ("moment", 0.1)), n, of).tells is tells


def test_a_model_that_answers_no_row_is_drawn_without_a_word_from_the_libraries():
    table = shown(continuum(), grid())
    blank = {"force_pred_n": np.nan, "moment_pred_nmm": np.nan}
    table = table.assign(**blank, status="no_equilibrium", split="train")
    figure = parity(table, "a title", simulated=False)
    assert not any(axes.get_legend() for axes in figure.axes)
    section = chart_sections(table, [])[-1]
    assert (section.lines, section.charts) == (["The model answers no row."], [])
