"""Two runs side by side: their parameters, and their errors on the same rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.api.fitted_run import FittedRun
from freelearn.common.errors import UserError
from freelearn.data.beds import bed_of
from freelearn.data.columns import usable_rows

# What tells one row of a table from another: the state, and what was read there.
PLACE = ("sample", "step", "elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm", "outer_diameter_mm")


@dataclass(frozen=True)
class Compared:
    """names: of the two runs. parameters: a row for each parameter, SI, blank where a run has none. errors: E of each
    run (fractions) by set of rows, and the number of rows. rows: those that both have, with each one's predictions
    under NAME_a and NAME_b. learned: coefficients or weights beside the parameters."""

    names: tuple[str, str]
    parameters: pd.DataFrame
    errors: pd.DataFrame
    rows: pd.DataFrame
    learned: tuple[int, int]


def compared(runs: Sequence[FittedRun]) -> Compared:
    """The two runs side by side. Raises UserError where they have no row in common."""
    first, second = runs
    tables = [_marked(one) for one in runs]
    keys = [name for name in PLACE if name in tables[0] and name in tables[1]]
    # A reading that is whole in one table may have digits in the other.
    whole = {name: np.float64 for name in keys if name != "sample"}
    tables = [table.astype(whole) for table in tables]
    predicted = [q.predicted for q in bed_of(tables[0]).measured if q.predicted in tables[0]]
    other = tables[1][[*keys, "seen", *(name for name in predicted if name in tables[1])]]
    rows = tables[0].merge(other.drop_duplicates(keys), on=keys, how="inner", suffixes=("_a", "_b"))
    if rows.empty:
        raise UserError(
            f"{first.folder} and {second.folder} have no row in common: compare runs of one table, or of tables that "
            "share rows."
        )
    measured = rows.drop(columns=[name for name in rows if name.endswith(("_a", "_b"))])
    unseen = ~(rows["seen_a"] | rows["seen_b"]).to_numpy()
    usable = usable_rows(measured) if "buckled" in measured else np.ones(len(rows), dtype=bool)
    sets = {"all rows of both": usable, "of them seen by neither": usable & unseen}
    errors = [
        {"rows": name, "a": first.error(part), "b": second.error(part), "n": int(chosen.sum())}
        for name, chosen in sets.items()
        if chosen.any() and (part := measured[chosen].reset_index(drop=True)) is not None
    ]
    names, learned = (str(first.folder), str(second.folder)), (_learned(first), _learned(second))
    return Compared(names, _parameters(first, second), pd.DataFrame(errors), rows, learned)


def _learned(one: FittedRun) -> int:
    """Coefficients, or weights, that its fit has learned beside the physical parameters."""
    content = one.run.content
    return int(content.get("learned", 0)) or len(content.get("parameters", {})) - len(one.frame())


def _marked(one: FittedRun) -> pd.DataFrame:
    """The run's rows, and which of them its fit saw."""
    return one.run.table.assign(seen=one.run.seen)


def _parameters(first: FittedRun, second: FittedRun) -> pd.DataFrame:
    """value and stderr of each, by parameter, and whether their rows say nothing of it; unit."""
    left, right = first.frame(), second.frame()
    names = list(dict.fromkeys([*left.index, *right.index]))
    both = {
        "a": left["value"].reindex(names),
        "a_stderr": left["stderr"].reindex(names),
        "b": right["value"].reindex(names),
        "b_stderr": right["stderr"].reindex(names),
        "a_untold": [name in first.untold for name in names],
        "b_untold": [name in second.untold for name in names],
        "unit": left["unit"].reindex(names).fillna(right["unit"].reindex(names)),
    }
    return pd.DataFrame(both)
