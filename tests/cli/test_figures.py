"""`python -m freelearn.figures` on a small sweep."""

import json

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from small_runs import make_csv, run

from freelearn.cli.paper_figures import _rows, draw_folder
from freelearn.common.errors import UserError
from freelearn.report.tables.picture_numbers import admissible_table, load_vector_table


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    csv = make_csv(folder / "table.csv", rows=1200)
    for number, (model, train) in enumerate((m, t) for m in ("continuum", "linear") for t in ("sample3", "sample6")):
        run(folder / str(number), f"model={model}", f"train={train}", "data=csv", f"data.path={csv}", "figures=false")
    return folder


def test_every_picture_has_its_numbers_and_the_tables_are_those_of_the_runs(sweep, tmp_path):
    with open(tmp_path / "terminal.txt", "w") as file:
        draw_folder(sweep, tmp_path, "sample6", None, Console(file=file, width=90))
    for name in ("admissible", "load_vectors", "curves"):
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
        assert len(pd.read_csv(tmp_path / f"{name}.csv"))
    drawn = pd.read_csv(tmp_path / "curves.csv")
    assert set(drawn["what"]) == {"measured", "continuum", "linear"}
    inside = drawn[(drawn["extrapolated"] == False) & (drawn["what"] != "measured")]  # noqa: E712
    assert (inside["force_n_low"] < inside["force_n"]).all()
    assert (inside["force_n"] < inside["force_n_high"]).all()
    assert list(pd.read_csv(tmp_path / "designs.csv")["sample"]) == [3, 6]
    fitted = pd.read_csv(tmp_path / "parameters.csv")
    assert len(fitted) == 2 * 2 + 2 * 3
    one = json.loads((sweep / "1" / "results.json").read_text())["parameters"]["C2"]
    row = fitted[(fitted["model"] == "continuum") & (fitted["train"] == "sample6") & (fitted["parameter"] == "C2")]
    assert row["value"].item() == pytest.approx(one["value"], rel=1e-6)
    moved = pd.read_csv(tmp_path / "spread.csv").set_index("parameter")
    both = fitted[fitted["parameter"] == "C1"]["value"]
    assert moved.loc["C1", "max / min"] == pytest.approx(both.max() / both.min(), rel=1e-6)
    assert "how far they move" in (tmp_path / "terminal.txt").read_text()


def test_a_chosen_state_is_the_nearest_one_and_a_single_run_will_do(sweep, tmp_path):
    table = pd.read_csv(sweep / "0" / "predictions.csv")
    wanted = table[table["sample"] == 6].iloc[35]
    state = [6, wanted["elongation_mm"] + 1e-3, wanted["twist_deg"] - 1e-2]
    with open(tmp_path / "terminal.txt", "w") as file:
        draw_folder(sweep / "0", tmp_path, "", state, Console(file=file), banded=False)
    assert "force_n_low" not in pd.read_csv(tmp_path / "curves.csv")
    shown = pd.read_csv(tmp_path / "curves.csv").query("what == 'measured'")
    own = table[(table["sample"] == 6) & (table["twist_deg"] == wanted["twist_deg"])]
    np.testing.assert_allclose(shown["force_n"], own["force_n"], rtol=1e-6)


def test_wrong_folders_sets_and_samples_are_said(sweep, tmp_path):
    for folder, train, state, message in (
        (tmp_path / "nothing", "", None, "No results in"),
        (sweep, "sample9", None, "No run was trained on 'sample9'"),
        (sweep, "", [9, 0, 0], "no sample 9"),
    ):
        with pytest.raises(UserError, match=message):
            draw_folder(folder, tmp_path / "out", train, state, Console(quiet=True))


def test_shares_and_vectors_are_those_of_the_rows():
    table = pd.DataFrame(
        {
            "sample": 1, "elongation_mm": [0.0] * 4 + [1.0] * 4, "twist_deg": 5.0, "step": [0, 1, 2, 3] * 2,
            "pressure_kpa": [0.0, 10, 20, 5] * 2, "force_n": np.arange(8.0), "moment_nmm": -np.arange(8.0),
            "buckled": [1, 0, 0, 0, 1, 1, 1, 1],
        }
    )  # fmt: skip
    assert list(admissible_table(table)["share"]) == [0.75, 0.0]
    vectors = load_vector_table(table).set_index("end")
    assert vectors.loc["low", "force_n"] == 3.0
    assert vectors.loc["high", "force_n"] == 2.0
    assert len(vectors) == 2


@pytest.mark.parametrize(("train", "sample"), [("even", 4), ("without4", 1), ("without1", 4), ("constituent", 1)])
def test_the_state_drawn_is_one_of_the_training_sets_own(train, sample):
    """The middling one of the set's states by error: least in three of sample 1, most in one of sample 4."""
    rows = [
        {"sample": number, "elongation_mm": float(state), "twist_deg": 0.0, "step": step, "pressure_kpa": 10.0 * step,
         "force_n": step - 2.0, "moment_nmm": 1.0, "force_pred_n": step - 2.0 + error, "moment_pred_nmm": 1.0}
        for number, error in ((1, 0.1), (2, 1.0), (4, 3.0)) for state in range(3 if number == 1 else 1)
        for step in range(5)
    ]  # fmt: skip
    table = pd.DataFrame(rows).assign(buckled=0, status="ok", split="train")
    drawn = table.iloc[_rows(table, None, train)]
    assert (drawn["sample"] == sample).all()
    assert len(drawn) == 5
