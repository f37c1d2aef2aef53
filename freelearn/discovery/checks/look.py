"""All checks of a table before any search; whether the model answers its rows, and how its repeats differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import torch

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import DEAD_LOAD, bed_of
from freelearn.data.rows import Rows
from freelearn.data.table.unit_suspicions import UnitWarning, unit_warnings
from freelearn.discovery.checks.at_rest import at_rest
from freelearn.discovery.checks.column_readings import DOUBTED, LEAST, SEVERAL, meant
from freelearn.discovery.checks.ends_of_range import NAME as ENDS
from freelearn.discovery.checks.ends_of_range import ends_of_range
from freelearn.discovery.checks.plain_fit import Build, Plain
from freelearn.discovery.checks.rows_order import NAME as ORDER
from freelearn.discovery.checks.rows_order import order
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck, actuator
from freelearn.discovery.checks.zeros_of_places import NAME as ZEROS
from freelearn.discovery.checks.zeros_of_places import zeros_of_places
from freelearn.discovery.fits.estimated_accuracy import FEWEST_REPEATS, repeat_rows, repeat_scale
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.physics.chain.model import Model

# Whether the model answers the rows, and comes anywhere near them.

FEWEST, MOST = 0.9, 0.5


def answers(plain: Plain) -> TableCheck:
    """Share of the rows that have loads at all."""
    share = plain.itself.answered
    if share >= FEWEST:
        return TableCheck("rows answered", PASS, share, FEWEST, "The plain model answers nearly all rows.")
    says = (
        f"The plain model has loads for {100 * share:.0f} % of the rows only: the others ask for a state that no such "
        "tube has; look at the length, the radii, the angle and the units of what is imposed."
    )
    return TableCheck("rows answered", FAIL, share, FEWEST, says)


def leaves(plain: Plain) -> TableCheck:
    """What the plain model leaves of the readings' range."""
    shares = {
        quantity.name: channel
        for quantity, channel in zip(bed_of(plain.table).readings, plain.channels, strict=True)
        if np.isfinite(channel)
    }
    name, worst = max(shares.items(), key=lambda each: each[1], default=("", 0.0))
    if worst <= MOST:
        return TableCheck("range left", PASS, worst, MOST, "The plain model follows the readings roughly.")
    says = (
        f"The plain model misses the {name} by {100 * worst:.0f} % of its range: no effect mends as much; look at "
        "what the column holds, its sign and its unit."
    )
    return TableCheck("range left", FAIL, worst, MOST, says)


# Whether repeats of a state differ as the stated accuracy lets them.

NAME = "stated accuracy"
# Times that repeats may scatter as much as was stated: calibrations differ by one and a half, slips and tails by more.
MOST_SCATTER = 3.5
# Repeats that are looked at, at most.
ENOUGH = 200


def repeated(plain: Plain, accuracy: Accuracy, stated: bool) -> TableCheck:
    """stated: whether the user gave the accuracy; an estimate comes from the repeats themselves."""
    if not stated:
        return TableCheck(NAME, CANNOT, None, MOST_SCATTER, "The accuracy is estimated from the table.")
    rows = Rows.from_table(plain.table)
    groups = repeat_rows(rows)
    if len(groups) < FEWEST_REPEATS:
        few = f"{len(groups)} places were visited again: too few to tell."
        says = few if rows.states.recording is None else "A log's samples have what came before in them: no repeats."
        return TableCheck(NAME, CANNOT, None, MOST_SCATTER, says)
    some = np.sort(np.concatenate(groups[:: max(1, len(groups) // ENOUGH)]))
    rows = rows[torch.as_tensor(some)]
    model = plain.model(rows, plain.itself.values)
    with torch.no_grad():
        missed = rows.readings.missed(model(rows.states).loads)
    state, bed = torch.as_tensor(rows.state), rows.states.bed
    whiten = Whitener(sensitivities(model, rows.states), state, accuracy, None, bed, rows.readings.present)
    scale = repeat_scale(missed, rows, whiten)
    if scale is None or not np.isfinite(scale):
        return TableCheck(NAME, CANNOT, None, MOST_SCATTER, "Too few places were visited again to tell.")
    if scale <= MOST_SCATTER:
        return TableCheck(NAME, PASS, scale, MOST_SCATTER, "Repeats differ no more than the stated accuracy lets them.")
    says = (
        f"Repeats of {len(groups)} places scatter {scale:.2g} times as much as data.accuracy says: state what the bed "
        "really does, or let it be estimated."
    )
    return TableCheck(NAME, FAIL, scale, MOST_SCATTER, says, "data.accuracy=estimate")


# All checks of a table before any search.

# Readings for each number of the model before anything is added, and one more.
READINGS_EACH = 2


def needed_readings(model: Model) -> int:
    """So many, or a fit is good whatever the columns hold."""
    return READINGS_EACH * (len(model.vector()) + 1)


def looked_over(
    table: pd.DataFrame, build: Build, given: Sequence[str], accuracy: Accuracy, stated: bool = True
) -> list[TableCheck]:
    """What an engineer would see at a glance, those that fail first.

    table: a checked measurement table's rows that are looked at, in the order of the file. build: effects → fresh
    continuum model. given: effects that the model has from the start. stated: whether the accuracy is the user's own.
    """
    checks = [actuator(table)]
    if Rows.from_table(table).readings.count < needed_readings(build(given)):
        checks += [*_suspected(table), order(table)]
    else:
        plain = Plain(build, given, table)
        checks += _suspected(table, plain)
        read = list(meant(plain))
        better = max((check.figure or 1.0 for check in failed(read)), default=1.0)
        checks += [*read, at_rest(plain, accuracy, better), zeros_of_places(plain, accuracy), order(table)]
        checks += [ends_of_range(plain, accuracy)]
        checks += [repeated(plain, accuracy, stated), answers(plain), leaves(plain)]
    return sorted(checks, key=lambda check: check.status != FAIL)


# What a column's numbers say by themselves, and what the mechanics say to it.

SUSPECTED = "numbers of a column"


def _suspected(table: pd.DataFrame, plain: Plain | None = None) -> Iterator[TableCheck]:
    """plain: of the same table, where it can be fitted."""
    hung = bed_of(table) is DEAD_LOAD
    for warning in unit_warnings(table):
        # Of loads that hang, whose place is measured, a spring's sign is that of the fit.
        if not isinstance(warning, UnitWarning) or (hung and "sign turned" in warning):
            continue
        better = _better_as_it_stands(plain, warning) if plain is not None else 0.0
        if better < SEVERAL:
            yield TableCheck(SUSPECTED, FAIL, None, None, str(warning))
        else:
            says = f"{str(warning).rstrip('.')}; but a model errs {better:.2g} times less of it as it stands."
            yield TableCheck(SUSPECTED, PASS, better, SEVERAL, says)


def _better_as_it_stands(plain: Plain, warning: UnitWarning) -> float:
    """How many times less the plain model errs of the table than of the one that is suspected, if it follows the table
    and its walls are such as there are; else 0."""
    itself, name = plain.itself, warning.column
    if not name or itself.E >= DOUBTED or itself.stiff > 1 or itself.soft > 1:
        return 0.0
    meant = plain.of(plain.table.assign(**{name: warning.factor * plain.table[name]}))
    return meant.E / max(itself.E, LEAST)


def failed(checks: Sequence[TableCheck]) -> list[TableCheck]:
    """Those that stop a claim."""
    return [check for check in checks if check.status == FAIL]


def useless(checks: Sequence[TableCheck]) -> TableCheck | None:
    """The first that says that no search can tell anything: of rows that were sorted it is not known which are one
    state's, and what came before; of a cell that was zeroed at each place what belongs to the loads; of one at the end
    of its range what it should have read."""
    return next((check for check in failed(checks) if check.name in (ORDER, ZEROS, ENDS)), None)
