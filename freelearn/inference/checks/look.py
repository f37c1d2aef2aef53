"""All checks of a table before any search."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd

from freelearn.inference.checks.actuator import actuator
from freelearn.inference.checks.answers import answers, leaves
from freelearn.inference.checks.at_rest import at_rest
from freelearn.inference.checks.check import FAIL, TableCheck
from freelearn.inference.checks.meant import meant
from freelearn.inference.checks.order import order
from freelearn.inference.checks.plain import Build, Plain
from freelearn.inference.checks.repeated import repeated
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.beds import DEAD_LOAD, bed_of
from freelearn.measurements.plausibility import UnitWarning, unit_warnings


def looked_over(
    table: pd.DataFrame, build: Build, given: Sequence[str], accuracy: Accuracy, stated: bool = True
) -> list[TableCheck]:
    """What an engineer would see at a glance, those that fail first.

    table: a checked measurement table's rows that are looked at, in the order of the file. build: effects → fresh
    continuum model. given: effects that the model has from the start. stated: whether the accuracy is the user's own.
    """
    plain = Plain(build, given, table)
    checks = [actuator(table), *_suspected(table), *meant(plain), at_rest(plain, accuracy), order(table)]
    checks += [repeated(plain, accuracy, stated), answers(plain), leaves(plain)]
    return sorted(checks, key=lambda check: check.status != FAIL)


def _suspected(table: pd.DataFrame) -> Iterator[TableCheck]:
    """What a column's numbers say by themselves."""
    hung = bed_of(table) is DEAD_LOAD
    for warning in unit_warnings(table):
        # Of loads that hang, whose place is measured, a spring's sign is that of the fit.
        if isinstance(warning, UnitWarning) and not (hung and "sign turned" in warning):
            yield TableCheck("numbers of a column", FAIL, None, None, str(warning))


def failed(checks: Sequence[TableCheck]) -> list[TableCheck]:
    """Those that stop a claim."""
    return [check for check in checks if check.status == FAIL]
