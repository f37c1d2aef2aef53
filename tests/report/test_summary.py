"""Models are compared on the same rows only."""

import pandas as pd
import pytest
import torch

from freelearn.data.error import common, set_error
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.report.tables.sweep_tables import (
    CAPTION,
    beside_the_paper,
    cells,
    summary,
    summary_table,
    where_they_differ,
)
from freelearn.testing.small_tables import random_table


def gathered(*rows: tuple[str, str, str, float, int, int]) -> pd.DataFrame:
    """A sweep's table. rows: label, train, test, E, n, seed."""
    table = pd.DataFrame(rows, columns=["label", "train", "test", "E", "n", "seed"])
    return table.assign(error="", parameters=2)


def best_of(table: pd.DataFrame) -> set[tuple[str, str]]:
    shown = cells(table)
    return set(zip(shown.loc[shown["best"], "label"], shown.loc[shown["best"], "test"], strict=True))


def test_a_model_that_leaves_rows_unanswered_is_best_nowhere():
    table = gathered(
        ("whole", "sample1", "sample1", 0.20, 100, 0),
        ("gaps", "sample1", "sample1", 0.10, 60, 0),
        ("worse", "sample1", "sample1", 0.30, 100, 0),
        ("whole", "sample1", "sample2", 0.20, 80, 0),
        ("gaps", "sample1", "sample2", 0.10, 80, 0),
        ("worse", "sample1", "sample2", 0.30, 80, 0),
    )
    assert best_of(table) == {("whole", "sample1"), ("gaps", "sample2")}
    share = summary(table).set_index("label")["best_share"]
    assert share.to_dict() == {"whole": 0.5, "gaps": 0.5, "worse": 0.0}
    shown = summary_table(summary(table))
    assert "answer every row" in shown.caption == CAPTION
    assert [row[-2] for row in shown.rows] == ["50", "50", "0"]


def test_every_seed_counts_and_seeds_differ_in_their_rows():
    # A split by states draws other test rows at every seed: only rows of one seed compare.
    table = gathered(
        ("one", "all", "all", 0.2, 100, 0),
        ("other", "all", "all", 0.1, 100, 0),
        ("one", "all", "all", 0.2, 90, 1),
        ("other", "all", "all", 0.1, 80, 1),
    )
    shown = cells(table).set_index("label")
    assert shown["complete"].to_dict() == {"one": True, "other": False}
    assert shown["best"].to_dict() == {"one": True, "other": False}
    assert shown["n"].to_dict() == {"one": 95.0, "other": 90.0}
    assert best_of(table[table["seed"] == 0]) == {("other", "all")}


def test_common_rows_take_the_advantage_of_a_gap_away():
    loads = torch.tensor([[1.0, 1.0], [2.0, 2.0], [4.0, 4.0]]).double()
    measured = Rows.whole(States.from_table(random_table(3, 0)), loads)
    predicted = loads + torch.tensor([0.0, 0.0, 2.0])[:, None]
    whole, gap = torch.tensor([True, True, True]), torch.tensor([True, True, False])
    assert set_error(measured, predicted, whole).E > set_error(measured, predicted, gap).E
    both = common(whole, gap)
    assert both.tolist() == [True, True, False]
    assert set_error(measured, predicted, both) == set_error(measured, predicted, gap)


def test_a_constituent_row_stands_under_its_model():
    table = gathered(("continuum", "constituent", "all", 0.4, 10, 0), ("continuum", "all", "all", 0.2, 10, 0))
    rows = summary_table(summary(table)).rows
    assert rows[1] == ("continuum, constituents", "40.0", "–", "–", "–", "–", "0")
    assert float(rows[0][1]) == pytest.approx(20.0)


def test_the_papers_figures_stand_beside_ours_for_its_models_alone():
    one, two = "sample1", "sample2"
    cell = [(one, one, 0.1), (one, two, 0.4), (two, one, 0.3), (two, two, 0.2)]
    rows = [
        {"label": label, "train": a, "test": b, "E": factor * E, "error": "", "seed": 0, "n": 10, "parameters": 2}
        for label, factor in (("continuum", 1.0), ("linear", 2.0), ("hybrid", 0.5))
        for a, b, E in cell
    ]
    grouped, numbers = cells(pd.DataFrame(rows)), summary(pd.DataFrame(rows))
    table = beside_the_paper(numbers)
    assert {row[0] for row in table.rows} == {"continuum", "linear"}
    # Mean 25 % against the paper's 18.1 %.
    assert ("continuum", "mean", "25.0", "18.1", "1.38") in table.rows
    lines = where_they_differ(grouped, numbers, simulated=True)
    assert "E over all cells, the best first: here continuum < linear; paper continuum < linear as well." in lines
    assert any(line.startswith("Largest of linear: sample1 on sample2 80 %") for line in lines)
    assert beside_the_paper(numbers[numbers["label"] == "hybrid"]) is None
