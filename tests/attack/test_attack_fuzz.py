"""Whatever stands in a table's file or on a command line, the answer is a table, or settings, or one UserError."""

from __future__ import annotations

import contextlib
import copy
import tempfile
import time
from pathlib import Path

import pytest
from attack_tables import HEADER, good
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nightly import EVERY

from freelearn.api.settings.configuration import FILES as CONFIGURATIONS
from freelearn.api.settings.configuration import composed
from freelearn.api.settings.configuration import settings as settings_of
from freelearn.api.settings.parse import parse
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.columns import Columns
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess
from freelearn.data.specimen_table import read_specimens
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members
from freelearn.data.table.questions import read_questions
from freelearn.data.table.records import mark_left_out

CORPUS = Path(__file__).with_name("corpus")
# Files that once failed, or are odd in a way of their own: tables as they are, overrides a line each.
TABLES = sorted(CORPUS.glob("tables/*"))
OVERRIDES = sorted(CORPUS.glob("settings/*"))
# No file of a few thousand bytes takes longer [s], on a machine that does other things besides.
SOON = 20.0


def fuzzed(examples: int):
    """The same examples in every usual run; more, and others each time, where every attack is wanted."""
    return settings(
        max_examples=20 * examples if EVERY else examples,
        derandomize=not EVERY,
        database=None,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )


# --- tables ----------------------------------------------------------------------------------------------------------

GOOD = good()
LINES = GOOD.split(b"\r\n")
CELLS = st.sampled_from(
    [
        "",
        " ",
        "0",
        "1",
        "-1",
        "30.0",
        "1e160",
        "1e-300",
        "5e-324",
        "-0",
        "nan",
        "inf",
        "1_0",
        "1,5",
        "0x1",
        "１",
        "−1",
        "=1+1",
        "#N/A",
        '"',
        '""',
        "'",
        "\x1a",
        "\u2028",
        "\ufeff",
        "a",
        "é",
        "sep=",
        "step",
        "force_n",
        "9" * 50,
    ]
)
NUMBERS = st.floats(allow_nan=True, allow_infinity=True).map(repr) | st.integers().map(str) | CELLS
# Bytes that mean something to a reader of text.
PIECES = st.sampled_from(
    [
        b",",
        b";",
        b"\t",
        b'"',
        b"\n",
        b"\r",
        b"\r\n",
        b"\0",
        b"\xef\xbb\xbf",
        b"\xff\xfe",
        b"\xfe\xff",
        b"\x1a",
        b"sep=,\n",
        b"\xff",
        b"\xc3",
        b"\xed\xa0\x80",
        b"\xe2\x80\x8b",
        b"\xc2\xa0",
        b"PK\x03\x04",
        b"\x80\x04",
        b"#",
        b"1",
        b"e",
        b"-",
    ]
)


@st.composite
def tables(draw: st.DrawFn) -> bytes:
    """Rows under the contract's header, with any cells."""
    names = draw(st.permutations(HEADER)) if draw(st.booleans()) else list(HEADER)
    names += draw(
        st.lists(st.sampled_from([*HEADER, "time_s", "left_out", "slack", "temperature_c", "bed", ""]), max_size=3)
    )
    rows = draw(st.lists(st.lists(NUMBERS, min_size=len(names), max_size=len(names)), max_size=6))
    separator = draw(st.sampled_from([",", ",", ",", ";", "\t"]))
    return "\n".join(separator.join(row) for row in [names, *rows]).encode()


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """The good table with some pieces put in, taken away or exchanged."""
    content = GOOD
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(content)))
        cut = draw(st.sampled_from([0, 0, 1, 2, 40, 400]))
        piece = draw(PIECES | st.binary(max_size=8) | NUMBERS.map(str.encode))
        content = content[:place] + piece + content[place + cut :]
    return content


@st.composite
def one_column(draw: st.DrawFn) -> bytes:
    """The good table with other values in one column: each valid by itself perhaps, and odd together."""
    column, value = draw(st.integers(0, len(HEADER) - 1)), draw(NUMBERS)
    every = draw(st.integers(1, 5))
    rows = [line.split(b",") for line in LINES[:-1]]
    for row in rows[1::every]:
        row[column] = value.encode()
    return b"\r\n".join(map(b",".join, rows))


FILES = st.one_of(tables(), damaged(), one_column(), st.binary(max_size=300), st.text(max_size=300).map(str.encode))


def answered(content: bytes) -> None:
    """Reads a file in every way in which the program reads tables of that kind."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        path.write_bytes(content)
        begun = time.monotonic()
        for bed in BEDS.values():
            with contextlib.suppress(UserError):
                read = read_table(path, bed)
                assert len(read.table) == len(read.lines) > 0
                path.write_bytes(mark_left_out(content, [int(read.lines[0])]))
                with contextlib.suppress(UserError):  # all left out, perhaps
                    assert read_table(path, bed).table["left_out"].iloc[0] == 1
                path.write_bytes(content)
        for reader in (lambda p: read_questions(p, Columns()), read_members, lambda p: read_specimens([f"UT={p}"])):
            with contextlib.suppress(UserError):
                reader(path)
        with contextlib.suppress(UserError):
            draft(guess(content, "raw.csv"))
        assert time.monotonic() - begun < SOON


@fuzzed(15)
@given(FILES)
def test_any_file_is_a_table_or_a_mistake(content: bytes):
    answered(content)


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.name)
def test_a_kept_file_is_a_table_or_a_mistake(path: Path):
    answered(path.read_bytes())


def test_there_is_a_corpus():
    assert len(TABLES) >= 10
    assert len(OVERRIDES) >= 3


# --- settings --------------------------------------------------------------------------------------------------------

NAMES = st.sampled_from(
    [
        "seed",
        "train",
        "test",
        "effects",
        "model",
        "model.C1",
        "model.name",
        "data",
        "data.path",
        "data.seed",
        "data.hidden",
        "data.accuracy",
        "data.accuracy.force_n",
        "data.bed",
        "data.members",
        "data.truth",
        "data.truth_effects",
        "device",
        "split",
        "split.train",
        "split.name",
        "fit",
        "fit.max_epochs",
        "figures",
        "bands",
        "constituent",
        "fits",
        "exclude",
        "ruled_out",
        "per_sample",
        "hydra.run.dir",
        "nothing",
        "",
        "data.name",
        "+data.x",
        "~data",
        "~model.C1",
        "a.b.c",
    ]
)
TYPED = st.sampled_from(
    [
        "",
        "null",
        "true",
        "1",
        "-1",
        "1e400",
        "nan",
        "inf",
        "1_000",
        "0x10",
        "[]",
        "{}",
        "[a,b]",
        "[[1],[2]]",
        "{a:1}",
        "???",
        "{a:{b:1}}",
        "csv",
        "virtual",
        "random",
        "estimate",
        "none",
        "all",
        "sample3",
        "${seed}",
        "${oc.env:HOME}",
        "${x}",
        "${seed}${seed}",
        "'",
        '"',
        "a=b",
        "a,b",
        "1,2",
        "range(3)",
        "choice(1,2)",
        "\\",
        "$",
        "${",
        "example:x",
        "x" * 400,
        "{end_clamps:{length:0.001}}",
        "{end_clamps:null}",
        "{1:2}",
        "[1,null]",
        "1e5",
        "９",
        "\u202e",
        "a\tb",
        "{a:[1,2]}",
        "10" * 200,
        "sample" + "9" * 400,
        "/dev/zero",
        "!!python/object:os.system",
        "a\u0000b",
    ]
)
VALUES = TYPED | st.text(max_size=20) | st.integers().map(str) | st.floats().map(repr)
KINDS = st.sampled_from([TrainSettings, DiscoverSettings])


def settled(kind: type, overrides: list[str]) -> None:
    """Composes and parses the words of a command line."""
    with contextlib.suppress(UserError):
        assert isinstance(settings_of(kind, overrides), kind)


@fuzzed(15)
@given(KINDS, st.lists(st.builds("{}={}".format, NAMES, VALUES), min_size=1, max_size=3))
def test_any_override_is_a_setting_or_a_mistake(kind: type, overrides: list[str]):
    settled(kind, overrides)


@fuzzed(15)
@given(KINDS, st.lists(st.text(max_size=30), max_size=3))
def test_any_words_are_settings_or_a_mistake(kind: type, overrides: list[str]):
    settled(kind, overrides)


@pytest.mark.parametrize("path", OVERRIDES, ids=lambda path: path.name)
def test_kept_overrides_are_settings_or_a_mistake(path: Path):
    for word in path.read_text(encoding="utf-8").splitlines():
        settled(TrainSettings, [word])


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["virtual", "csv", "random", "estimate", "none", "rows", 10**400, -0.0, 1e308]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6) | st.integers(), inner, max_size=3),
    max_leaves=6,
)
CONFIGURED = {kind: composed(name) for kind, name in CONFIGURATIONS.items()}


@fuzzed(150)
@given(KINDS, st.data())
def test_any_plain_values_are_settings_or_a_mistake(kind: type, data: st.DataObject):
    """Of a composed configuration: what a page, a notebook or a kept file may hold in its places."""
    content = copy.deepcopy(CONFIGURED[kind])
    for _ in range(data.draw(st.integers(1, 3))):
        place, key = content, data.draw(st.sampled_from(sorted(content)))
        while isinstance(place[key], dict) and place[key] and data.draw(st.booleans()):
            place = place[key]
            key = data.draw(st.sampled_from(sorted(place, key=str)))
        place[key] = data.draw(PLAIN)
    with contextlib.suppress(UserError):
        assert isinstance(parse(kind, content), kind)
