"""Whether a log's recordings were sampled often enough for the times that a model has in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from freelearn.data.logs import RUN, TIME, is_log, run_numbers
from freelearn.physics.chain.model import Model


def sampling_notes(model: Model[Any], table: pd.DataFrame) -> list[str]:
    """A sentence, where there is need of one, on times of a model's history that are over before a recording's next
    row.

    table: the rows that it was fitted on. Of what is over so soon a log shows at most that something comes late: a lag
    of a tenth of a row cannot be told from any other, nor from a delay. Delays themselves may be as short as they like.
    """
    times = _times(model)
    if not times or not is_log(table):
        return []
    run, time = run_numbers(table), table[TIME].to_numpy(np.float64)
    same = run[1:] == run[:-1]
    step = pd.Series(np.diff(time)[same]).groupby(run[1:][same]).median()
    slow = step[step > min(times.values())]
    if not len(slow):
        return []
    row = int(np.argmax(run == slow.idxmax()))
    short = [name for name, value in times.items() if value < slow.max()]
    told = " and ".join(f"{name} = {times[name]:.2g} s" for name in short)
    others = f" and in {len(slow) - 1} more" if len(slow) > 1 else ""
    return [
        f"In run {table[RUN].iloc[row]}, sampled every {slow.max():.2g} s,{others} {told} "
        f"{'is' if len(short) == 1 else 'are'} over before the next row and cannot be seen: record (or keep, rate_hz) "
        f"several rows within that time, or leave {' and '.join(dict.fromkeys(n.split('.')[0] for n in short))} out."
    ]


def _times(model: Model[Any]) -> dict[str, float]:
    """Time constants and periods of the effects of the history by label [s], those that have any."""
    history = {effect.name for effect in model.effects if effect.port == "history"}
    values = model.scalars()
    return {
        name: values[name]
        for name, spec in model.declared.items()
        if spec.unit == "s" and spec.lower >= 0 and name.split(".")[0] in history and values[name] > 0
    }
