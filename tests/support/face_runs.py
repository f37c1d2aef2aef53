"""One table, one fit and one search of it for all tests of the face, which change none of them."""

import tempfile
from functools import cache
from pathlib import Path

import pandas as pd
from outside_tables import measured

import freelearn as fl

HIDDEN = {"force_offset": {"force": 2.0}}


@cache
def hidden_table() -> pd.DataFrame:
    """A sample whose load cell is off by 2 N."""
    return measured(effects=HIDDEN, samples=(3,)).table


@cache
def fitted_run() -> fl.FittedRun:
    """The model with what was hidden."""
    return fl.fit(hidden_table(), effects=["force_offset"], seed=3)


@cache
def found_search() -> fl.Found:
    """The search for it, in a folder of its own."""
    return fl.discover(hidden_table(), folder=Path(tempfile.mkdtemp(prefix="freelearn-found-")), checks="off")
