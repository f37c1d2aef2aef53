"""Whatever is in a file or a recipe, the answer is a table or a UserError, and soon."""

import contextlib
import io

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import EVERY
from raw_files import RECIPE, raw_text
from scipy.io import savemat

from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess
from freelearn.data.intake.recipes.recipe_file import recipe_of

CELLS = st.sampled_from(
    ["1", "-2.5", "1,5", "", "x", "#", "NaN", "1e5", '"', "kPa", "a b", "--", "1_0", "\t", "é", "0"]
)
TEXTS = st.lists(st.lists(CELLS, max_size=6), max_size=12).flatmap(
    lambda rows: st.sampled_from([",", ";", "\t", " ", "|"]).map(lambda s: "\n".join(s.join(row) for row in rows))
)
FILES = st.one_of(TEXTS.map(str.encode), st.binary(max_size=200), st.text(max_size=200).map(str.encode))
MATLAB = io.BytesIO()
savemat(MATLAB, {"a": np.arange(9.0), "b": np.arange(9.0)})


def answered(call) -> None:
    with contextlib.suppress(UserError):
        call()


@settings(deadline=None, max_examples=200 if EVERY else 20)
@given(FILES, st.sampled_from(["raw.csv", "raw.xlsx", "raw.mat", "raw.txt", "raw"]))
def test_any_bytes(content, name):
    answered(lambda: draft(guess(content, name)))


@settings(deadline=None, max_examples=200 if EVERY else 40)
@given(st.integers(0, 500), st.binary(max_size=6))
def test_a_damaged_file(place, patch):
    whole = raw_text().encode()
    content = whole[:place] + patch + whole[place + len(patch) :]
    answered(lambda: convert(recipe_of(RECIPE, "r"), {"raw.csv": content}))


# Each is read by a process of its own: SciPy's reader ends, with some of these, the process that it runs in.
@settings(deadline=None, max_examples=10 if EVERY else 4)
@given(st.integers(128, 700), st.binary(min_size=1, max_size=6))
def test_a_damaged_matlab_file(place, patch):
    whole = MATLAB.getvalue()
    content = whole[:place] + patch + whole[place + len(patch) :]
    answered(lambda: guess(content, "raw.mat"))


@settings(deadline=None, max_examples=200 if EVERY else 40)
@given(st.integers(0, len(RECIPE)), st.text(max_size=8), st.integers(0, 12))
def test_a_damaged_recipe(place, patch, cut):
    text = RECIPE[:place] + patch + RECIPE[place + cut :]
    answered(lambda: convert(recipe_of(text, "r"), {"raw.csv": raw_text().encode()}))


VALUES = st.recursive(
    st.sampled_from([None, True, 1, -2.5, "rest", "first", "F_N", "length_mm", "N", "derive", 10**400, "pressure_kpa"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["from", "unit", "pressure_on", "is", "below", "force_n", "of", "F_N", "as"]), inner
        )
    ),
    max_leaves=6,
)
KEYS = ["sample", "samples", "files", "constants", "members", "keep", "drop", "order_by", "plateaus", "rest", "read"]


@settings(deadline=None, max_examples=200 if EVERY else 40)
@given(st.dictionaries(st.sampled_from([*KEYS, "state_tolerance", "step", "slack", "carry", "about"]), VALUES))
def test_a_recipe_of_odd_values(changes):
    import yaml

    text = RECIPE + yaml.safe_dump(changes) if changes else RECIPE
    text = "\n".join(
        [line for line in text.splitlines() if not (line.startswith("constants: {") and "constants" in changes)]
    )
    answered(lambda: convert(recipe_of(text, "r"), {"raw.csv": raw_text().encode()}))
