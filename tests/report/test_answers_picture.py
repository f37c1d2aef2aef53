"""The picture of answers shows what was asked, and nothing that says nothing."""

import numpy as np
import pandas as pd

from freelearn.queries.answers import Answers
from freelearn.report.plots.answer_plots import answers_figure


def answers(rows=5, **changed):
    time = np.arange(rows, dtype=float)
    table = pd.DataFrame({"time_s": time, "elongation_mm": -time, "twist_deg": 0.0, "force_n": -10 * time})
    table = table.assign(pressure_kpa=50 * time, pressure_kpa_low=50 * time - 5, pressure_kpa_high=50 * time + 5)
    table = table.assign(moment_nmm=-0.0, solutions=1, **{"status": "ok", **changed})
    return Answers(table, pd.DataFrame(), ("pressure_kpa", "moment_nmm"))


def panels(figure):
    return [axes.get_ylabel().split("\n")[0] for axes in figure.axes]


def test_what_changes_and_what_was_answered_is_drawn_over_time():
    figure = answers_figure(answers())
    # A twist that was held and a moment of nothing say nothing.
    assert panels(figure) == ["elongation Δl", "pressure P", "force F"]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    line = next(line for line in figure.axes[1].lines if line.get_label() == "answered")
    assert line.get_ydata().tolist() == [0, 50, 100, 150, 200]
    assert "95 % band" in [text.get_text() for text in figure.axes[1].get_legend().get_texts()]


def test_rows_without_an_answer_are_marked():
    figure = answers_figure(answers(status=["ok", "unreachable", "ok", "ok", "ok"]))
    labels = [text.get_text() for text in figure.axes[1].get_legend().get_texts()]
    assert "no answer" in labels
    line = next(line for line in figure.axes[1].lines if line.get_label() == "answered")
    assert np.isnan(line.get_ydata()[1])


def test_few_answers_are_read_in_the_table():
    assert answers_figure(answers(2)) is None


def test_recordings_are_lines_of_their_own_end_to_end():
    figure = answers_figure(answers(6, run=[1, 1, 1, 2, 2, 2], time_s=[0.0, 1.0, 2.0, 0.0, 1.0, 2.0]))
    assert figure.axes[-1].get_xlabel() == "time [s], recordings end to end"
    lines = [line for line in figure.axes[1].lines if line.get_label() == "answered"]
    assert [line.get_xdata().tolist() for line in lines] == [[0, 1, 2], [3, 4, 5]]
    assert [text.get_text() for text in figure.axes[1].get_legend().get_texts()] == ["95 % band", "answered"]


def test_recordings_of_one_clock_keep_it():
    figure = answers_figure(answers(6, run=[1, 1, 1, 2, 2, 2], time_s=[0.0, 1.0, 2.0, 10.0, 11.0, 12.0]))
    assert figure.axes[-1].get_xlabel() == "time [s]"
    lines = [line for line in figure.axes[1].lines if line.get_label() == "answered"]
    assert [line.get_xdata().tolist() for line in lines] == [[0, 1, 2], [10, 11, 12]]
