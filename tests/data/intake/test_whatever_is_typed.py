"""Whatever is typed to the questions about a messy file, and wherever somebody stops: a table or a sentence."""

import random
from io import StringIO

import pytest
from nightly import chosen
from rich.console import Console
from test_messy import REFUSED, RIGHT, write

from freelearn.cli.start_command import start
from freelearn.common.errors import UserError

FILES = RIGHT | {name: make for name, (make, _) in REFUSED.items()}
TYPED = [
    *("", "1", "2", "3", "7", "y", "n", "?", "all", "25", "5", "6", "150", "0", "-3", "d 10", "+1"),
    *("mm", "kPa", "N", "deg", "%", "N·m", "no unit", "1e999", "²"),
]


def somebody(seed):
    """Types at random, mostly Enter, and stops after a while."""
    draw = random.Random(seed)
    left = iter(range(draw.choice([2, 4, 8, 16, 120])))

    def ask(_):
        if next(left, None) is None:
            raise EOFError
        return draw.choice(["", "", *TYPED])

    return ask


@pytest.mark.parametrize("name", chosen(list(FILES), 20))
def test_a_table_or_a_sentence(name, tmp_path):
    raw = write(tmp_path / name, FILES[name]())
    for seed in range(3):
        out, said = tmp_path / f"out{seed}", ""
        try:
            start([raw], out, Console(file=StringIO(), width=100), somebody(f"{name}{seed}"))
        except UserError as mistake:
            said = str(mistake)
        assert said.strip() or list(out.glob("*_table.csv"))
