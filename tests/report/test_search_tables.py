"""The staircase and the ranking say in table and pictures what the trail and the candidates hold."""

import numpy as np
import pandas as pd
import pytest

from freelearn.report.html.ranking_charts import StaircaseChart
from freelearn.report.plots.discovery_plots import ranking, staircase
from freelearn.report.tables.ranking_tables import ranking_numbers, ranking_table, staircase_table, untested_lines

TRAIL = pd.DataFrame(
    {
        "step": ["model alone", "+ end_clamps"],
        "E_heldout": [0.1234, 0.0056],
        "E_train": [0.12, 0.005],
        "noise_floor": [0.004, np.nan],
        "sigmas_heldout": [31.416, 1.0149],
    }
)


def candidate(effect: str, score: float, step: int = 0, p_value: float = 0.001, error: float | None = None):
    return {"effect": effect, "status": "tested", "reason": "", "step": step, "score": score, "p_value": p_value,
            "E_heldout": error}  # fmt: skip


CANDIDATES = [
    candidate("small", 4.0, p_value=0.4),
    candidate("large", 400.0, error=0.02),
    candidate("large", 1.0, step=1),
    candidate("negative", -1.0, p_value=1.0),
    {"effect": "blind", "status": "not_testable", "reason": "no time", "step": 0},
]


def test_the_staircase_is_one_in_table_picture_and_chart():
    assert staircase_table(TRAIL).rows == (
        ("model alone", "12.000", "12.340", "0.400", "31.42"),
        ("+ end_clamps", "0.500", "0.560", "–", "1.01"),
    )
    assert staircase_table(TRAIL).columns[-1].heading == "misfit in noise standard deviations"
    axes = staircase(TRAIL, simulated=True).axes[0]
    chart = StaircaseChart()
    chart.show(TRAIL)
    drawn = axes.lines[0].get_ydata()
    assert list(drawn) == pytest.approx([12.34, 0.56]) == list(chart.source.data["E"])
    assert axes.get_ylim() == pytest.approx((chart.panel.y_range.start, chart.panel.y_range.end))
    assert [text.get_text() for text in axes.texts] == chart.source.data["label"] == ["12.3 %", "0.56 %"]
    assert axes.get_ylim()[0] < 0.4


def test_the_ranking_is_by_size_and_keeps_steps_apart():
    numbers = ranking_numbers(CANDIDATES)
    assert numbers[["effect", "size"]].to_numpy().tolist() == [["large", 20.0], ["small", 2.0], ["negative", 0.0]]
    assert ranking_table(numbers, 2).rows == (("large", "20.0", "0.001", "2.000"), ("small", "2.0", "0.4", "–"))
    assert ranking_numbers(CANDIDATES, 1)["size"].tolist() == [1.0]
    assert untested_lines(CANDIDATES) == ["blind: no time"]
    assert not ranking_table(ranking_numbers([])).rows


def test_the_pictured_ranking_fills_what_chance_does_not_explain():
    axes = ranking(ranking_numbers(CANDIDATES), ranking_numbers(CANDIDATES, 1), simulated=False).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["negative", "small", "large"]
    filled, open_, _ = axes.lines
    assert (filled.get_xdata().tolist(), filled.get_markerfacecolor()) == ([20.0], filled.get_color())
    # A size of nothing still has a place on a logarithmic axis.
    assert (open_.get_xdata().tolist(), open_.get_markerfacecolor()) == ([0.1, 2.0], "white")
