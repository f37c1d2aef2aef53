"""The package in Python: the same numbers as the commands, tables in and out, faults in one error."""

import re
import signal

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from face_runs import fitted_run, found_search, hidden_table

import freelearn

TUBE = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")


@pytest.fixture(scope="module")
def table():
    return hidden_table()


@pytest.fixture(scope="module")
def run():
    return fitted_run()


@pytest.fixture(scope="module")
def found():
    return found_search()


def test_a_search_of_a_data_frame_names_what_is_missing(found):
    assert found.verdict == "named"
    assert found.effects == ["force_offset"]
    errors = found.frame()["E_heldout"]
    assert errors.iloc[-1] < 0.5 * errors.iloc[0]
    assert found.models["effects"].iloc[0] == ["force_offset"]
    assert "force_offset" in found.summary()
    assert "named" in found._repr_html_()
    assert set(found.referee["result"]) >= {"pass"}


def test_what_was_found_predicts_new_rows(found, table):
    few = table.iloc[::50][["sample", "elongation_mm", "twist_deg", "pressure_kpa"]]
    predicted = found.predict(few)
    assert len(predicted) == len(few)
    read = table.iloc[::50]["force_n"].to_numpy()
    inside = (predicted["force_pred_n_low"] <= read) & (read <= predicted["force_pred_n_high"])
    assert inside.mean() > 0.8


def test_a_fit_knows_what_was_hidden(run):
    fitted = run
    # The offset that was hidden, within its stated error four times over.
    stderr = np.sqrt(np.diag(fitted.covariance))[list(fitted.parameters).index("force_offset.force")]
    assert fitted.parameters["force_offset.force"] == pytest.approx(2.0, abs=4 * stderr)


def test_a_parameter_is_fixed_and_another_known_beforehand(table):
    fitted = freelearn.fit(table, fix={"C2": 1e8}, priors={"C1": (1e5, 1.0)})
    assert fitted.parameters["C2"] == 1e8
    assert fitted.parameters["C1"] == pytest.approx(1e5, rel=1e-3)


def test_an_interrupted_fit_leaves_ctrl_c_as_it_was(table, monkeypatch):
    """Lightning would end the process, and hears no Ctrl-C while it shuts down: in a notebook neither may last."""
    import lightning as L

    class Stopped(L.Callback):
        def on_train_batch_end(self, *_):
            raise KeyboardInterrupt

    monkeypatch.setattr("freelearn.api.shown_progress.Shown.epochs", lambda self, fit: Stopped)
    heard = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        freelearn.fit(table)
    assert signal.getsignal(signal.SIGINT) is heard
    monkeypatch.undo()
    assert freelearn.fit(table).parameters["C1"] > 0


def test_nested_options_are_named_as_on_the_command_line(table):
    one = freelearn.fit(table, **{"fit.tolerance": 1e-6})
    other = freelearn.fit(table, fit={"tolerance": 1e-6})
    assert one.parameters == other.parameters


def test_a_table_lacks_its_design_and_is_told_it(table):
    rows = table.drop(columns=list(TUBE))
    tube = {name: float(table[name].iloc[0]) for name in TUBE}
    checked = freelearn.read_table(rows, design=tube)
    pd.testing.assert_series_equal(checked["force_n"], table["force_n"], check_index=False)
    assert isinstance(checked.attrs["warnings"], list)
    with pytest.raises(freelearn.UserError, match="gamma_deg"):
        freelearn.read_table(rows)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"model": "continum"}, "continuum"),
        ({"effects": ["end_clamp"]}, "end_clamps"),
        ({"lenght": 3}, "lenght"),
        ({"fix": {"C7": 1.0}}, "C7"),
        ({"bed": "hanging"}, "dead_load"),
    ],
)
def test_a_mistake_is_one_error_that_says_what_to_do(table, options, says):
    with pytest.raises(freelearn.UserError, match=says):
        freelearn.fit(table, **options)


def test_the_first_page_as_written(table, tmp_path, monkeypatch):
    """CSV → what is missing → picture → prediction of a new row → what to measure next, in ten lines."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "index.md").read_text(encoding="utf-8"), re.DOTALL)
    assert code.count("\n") <= 10
    monkeypatch.chdir(tmp_path)
    table.assign(sample=1).to_csv("mine.csv", index=False)
    names = {}
    exec(code, names)
    assert names["found"].effects == ["force_offset"]
    assert {path.name for path in tmp_path.iterdir()} == {"mine.csv"}


@pytest.mark.slow
@pytest.mark.nightly
def test_the_page_in_python_as_written(tmp_path, monkeypatch, capsys):
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    assert code.count("\n") <= 16
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    told = capsys.readouterr().out
    assert "force_pred_n_low" in told
    # Three effects leave the noise of this muscle, and so do others together.
    assert told.startswith("Undecided")
    assert not list(tmp_path.iterdir())
