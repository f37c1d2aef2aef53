"""Which rows and kinematic states a picture shows."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.data.beds import ELONGATION, PRESSURE, Pair, bed_of
from freelearn.data.columns import SLACK
from freelearn.data.error import load_scale
from freelearn.data.rows import Readings
from freelearn.data.states import kinematic_state
from freelearn.physics.chain.prediction import usable
from freelearn.queries.curves.curve_rows import curves_of, digits, levels, pressures, sweep_text

# A curve through fewer rows shows nothing.
ROWS_FOR_A_CURVE = 4


def places(table: pd.DataFrame) -> pd.DataFrame:
    """One row per kinematic state, in order: sample and the two quantities that the bed imposes on it (the mean of an
    elongation: a bed may creep); index `state`.

    States are numbered as `kinematic_state` numbers those of `table`.
    """
    state = bed_of(table).state
    columns = table[["sample", *(q.column for q in state)]]
    taken = {q.column: "mean" if q is ELONGATION else "first" for q in state}
    return columns.groupby(kinematic_state(table)).agg({"sample": "first", **taken}).rename_axis("state")


def fields(table: pd.DataFrame, over: Pair | None = None) -> tuple[np.ndarray, pd.DataFrame]:
    """Number of each row's field in a picture over two quantities, (N,), and each field's sample and place.

    over: None for each kinematic state a field of its own, at its two quantities. With a pressure among the two, rows
    of nearly the same place share one; and so do an end block's states, which return with other actuators inflated.
    """
    where, state = places(table), kinematic_state(table)
    if over is None or (over == bed_of(table).state and len(pressures(table)) == 1):
        return state, where
    sample = table["sample"].to_numpy()
    pressed = any(q.unit == PRESSURE.unit for q in over)
    keys = pd.DataFrame({"sample": sample})
    for name in (quantity.column for quantity in over):
        exact = pd.Series(where[name].to_numpy()[state] if name in where else table[name].to_numpy(np.float64))
        # Over a pressure, elongations too are read anew in each row.
        keys[name] = exact.groupby(sample).transform(_at_levels) if pressed else exact
    number = keys.groupby(list(keys), sort=True).ngroup().to_numpy()
    return number, keys.groupby(number).first().rename_axis("state")


def _at_levels(values: pd.Series) -> pd.Series:
    """The mean of its level in place of each value, so that marks stand in rows and columns."""
    return values.groupby(levels(values.to_numpy())).transform("mean")


def place_text(place: pd.Series, state: Pair) -> str:
    """A kinematic state's two quantities with their units. Plain hyphens: it also names files and TensorBoard's images.

    >>> from freelearn.data.beds import KINEMATIC
    >>> place_text(pd.Series({"elongation_mm": -1.0, "twist_deg": 40.0}), KINEMATIC.state)
    '-1 mm, +40°'
    """
    return ", ".join(f"{place[q.column]:+.{digits(q)}g}{q.suffix}" for q in state)


def state_title(measured: pd.DataFrame) -> str:
    """What the rows of a state, or of an end block's curve in it, are called."""
    place = places(measured).iloc[0]
    parts = [f"sample {place['sample']:.0f}", place_text(place, bed_of(measured).state), sweep_text(measured)]
    return ", ".join(part for part in parts if part)


def squared_error(predictions: pd.DataFrame) -> pd.Series:
    """Σ ((measured − predicted)/largest)² over what was measured in each usable row, the largest readings being those
    among them; rows without a reading are left out."""
    rows = usable(predictions)
    if not len(rows):
        return pd.Series(dtype=np.float64)
    readings = Readings.from_table(rows)
    missed = readings.missed(Readings.from_table(rows, predicted=True).value)
    squares = (missed / load_scale(readings.value)).square().sum(-1)
    return pd.Series(squares.numpy(), index=rows.index)[readings.present.any(-1).numpy()]


def pick_states(predictions: pd.DataFrame) -> list[np.ndarray]:
    """Positions of all rows, in time order, of kinematic states worth showing, or of an end block's curves in them:
    from the best to the worst predicted.

    Of the states with at least four usable rows in which no tube hangs loose (or, if there is none, with the most of
    them), three evenly spaced ranks of the mean squared error, so the first is the best and the last the worst. None
    where no two rows are of one curve, as of an end block whose pressures were all drawn at random.
    """
    predictions = predictions.reset_index(drop=True)
    state = pd.Series(curves_of(predictions, kinematic_state(predictions)))
    each = squared_error(predictions)
    if not len(each):
        return []
    # Where the tube hangs loose any push is right: a state of such rows alone would be the best of all.
    taut = each.index.map(predictions[SLACK] != 1) if SLACK in predictions else np.ones(len(each), dtype=bool)
    error = pd.DataFrame({"mean": each, "rows": taut}).groupby(state[each.index]).agg({"mean": "mean", "rows": "sum"})
    if not len(error) or error["rows"].max() == 1:
        return []
    enough = error[error["rows"] >= min(ROWS_FOR_A_CURVE, error["rows"].max())]
    ranked = enough.sort_values("mean", kind="stable").index.to_numpy()
    chosen = np.unique(np.linspace(0, len(ranked) - 1, 3).round().astype(int))
    return [np.flatnonzero(state == ranked[i]) for i in chosen]
