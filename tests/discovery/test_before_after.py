"""Errors before and after belong to the same rows."""

import numpy as np
import pytest
import torch
from hidden_tables import MATERIAL, table

from freelearn.data.error import load_scale
from freelearn.data.rows import Rows
from freelearn.discovery.search.before_after import common_errors
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model


def test_models_are_compared_on_rows_that_both_answer():
    data = table({}, share=0.1)
    rows = Rows.from_table(data)
    rows = rows[torch.as_tensor(np.flatnonzero(data["buckled"] == 0))]
    stiff = build_model("continuum", {"C1": MATERIAL[0], "C2": MATERIAL[1]})
    # So soft that it has no equilibrium at high pressure.
    soft = build_model("continuum", {"C1": 2e4, "C2": 2e5})
    with torch.no_grad():
        answers = [model(rows.states) for model in (soft, stiff)]
    both = (answers[0].status == Status.OK) & (answers[1].status == Status.OK)
    assert 0 < int(both.sum()) < len(rows)
    errors = common_errors([soft, stiff], rows)
    for error, answer in zip(errors, answers, strict=True):
        scaled = ((answer.loads - rows.loads)[both] / load_scale(rows.loads)).numpy()
        assert error == pytest.approx(np.sqrt((scaled**2).sum(1).mean()))
    # The better model is not charged for rows that the other leaves out.
    alone = ((answers[1].loads - rows.loads) / load_scale(rows.loads)).square().sum(-1).mean().sqrt()
    assert errors[1] != pytest.approx(float(alone), rel=1e-6)
    assert common_errors([stiff], rows[torch.arange(0)]) == []
