"""CSV text against pandas' own."""

import io

import numpy as np
import pandas as pd
import pytest

from freelearn.common.csv_text import csv_text
from freelearn.testing.small_tables import random_table


@pytest.mark.parametrize("numbers", ["%.10g", "%.8g"])
def test_the_text_is_pandas_own(numbers):
    table = random_table(200, 0).assign(
        gap=np.where(np.arange(200) % 7, 1e-30, np.nan),
        far=np.where(np.arange(200) % 5, np.inf, -0.0),
        split=np.where(np.arange(200) % 2, "train", 'a "b", c\n'),
        known=np.arange(200) % 3 == 0,
        note=[None, "x"] * 100,
    )
    assert csv_text(table, numbers) == table.to_csv(index=False, float_format=numbers, lineterminator="\n")
    assert csv_text(table[:0], numbers) == table[:0].to_csv(index=False, float_format=numbers, lineterminator="\n")
    assert pd.read_csv(io.StringIO(csv_text(table, numbers)))["split"][0] == 'a "b", c\n'
