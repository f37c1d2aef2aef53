"""What a picture draws of a log: its rows, by what each remembers, and nothing between two recordings."""

import numpy as np
import torch

from freelearn.data.columns import usable_rows
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.queries.curves.model_curves import model_curve
from freelearn.testing.small_tables import recordings


def test_a_curve_of_a_log_goes_through_what_is_predicted_of_its_rows():
    """Between two rows nobody knows what is remembered: a line through what would be there swung far off the rows."""
    table = recordings().assign(buckled=0)
    states, usable = States.from_table(table), usable_rows(table)
    model = build_model("continuum", {"supply_lag.time": 0.5}, ["supply_lag"]).requires_grad_(False)
    curve = model_curve(model, states, usable, usable)
    between = curve["force_pred_n"].isna().to_numpy()
    # Recordings of two samples, two of each.
    begins = np.flatnonzero(table["run"].diff().fillna(0) != 0)
    assert len(begins) == 3
    np.testing.assert_array_equal(np.flatnonzero(between), begins + np.arange(len(begins)))
    rows = curve[~between]
    np.testing.assert_allclose(rows["pressure_kpa"], table["pressure_kpa"], rtol=1e-12)
    with torch.no_grad():
        force = model(states).loads[:, 0].numpy()
    np.testing.assert_allclose(rows["force_pred_n"], force, rtol=1e-9)
