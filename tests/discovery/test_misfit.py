"""What `train.py` says of a fitted model's residuals."""

import numpy as np
import pytest
import torch
from hidden_tables import MATERIAL, NOISE, table
from nightly import chosen

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import NMM
from freelearn.data.states import States
from freelearn.discovery.residuals.failures import misfit
from freelearn.physics.models.build import build_model

ACCURACY = Accuracy.engineering(**NOISE)


def predicted(data, model):
    with torch.no_grad():
        loads, status = model(States.from_table(data))
    state = np.arange(len(data)) // 10
    return data.assign(
        force_pred_n=loads[:, 0].numpy(),
        moment_pred_nmm=loads[:, 1].numpy() / NMM,
        status=np.where(status.numpy() == 0, "ok", "no_equilibrium"),
        split=np.where(data["buckled"] == 1, "", np.where(state % 5 == 0, "test", "train")),
    )


def error(rows):
    scaled = [(rows[f"{a}_pred_{u}"] - rows[f"{a}_{u}"]) / rows[f"{a}_{u}"].abs().max()
              for a, u in (("force", "n"), ("moment", "nmm"))]  # fmt: skip
    return float(np.sqrt((scaled[0] ** 2 + scaled[1] ** 2).mean()))


def test_the_true_model_stands_on_the_noise_floor():
    model = build_model("continuum", dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    ratios = []
    for seed in chosen(range(12), 4):
        rows = predicted(table({}, seed=seed, share=0.5), model)
        found = misfit(model, rows, ACCURACY)
        ratios.append(error(rows[rows["split"] == "test"]) / found.noise_floor)
    # Each has some 25 held-out states and so 50 position errors: its E scatters by a tenth, their mean by a thirtieth.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)
    assert np.std(ratios) < 0.25


def test_a_planted_error_is_found_where_it_is():
    model = build_model("continuum", dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    data = table({}, share=0.5)
    wrong = (data["twist_deg"] > 60) & (data["sample"] == 3)
    data.loc[wrong, "force_n"] -= 8.0
    worst = misfit(model, predicted(data, model), ACCURACY).failures[0]
    assert worst.mean[0] == pytest.approx(8.0, rel=0.1)
    assert "sample 3" in worst.where
    assert "twist >" in worst.where
    assert worst.sentence().startswith(f"predicted force is {worst.mean[0]:.3g} N too high")


def test_of_few_rows_nothing_is_said():
    model = build_model("continuum", dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    rows = predicted(table({}, share=0.1), model)
    assert misfit(model, rows[:30], ACCURACY) is None
