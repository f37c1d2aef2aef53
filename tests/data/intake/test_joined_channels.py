"""Channels of several clocks joined by time: as one logger would have written them, and what cannot be joined."""

import json

import numpy as np
import pandas as pd
import pytest
from raw_files import taken

import freelearn as fl
from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.intake.convert import convert
from freelearn.data.intake.recipes.recipe_file import recipe_of

DESIGN = {"gamma_deg": 40, "length_mm": 90, "inner_radius_mm": 4.77, "outer_radius_mm": 6.35}
# Channel → its unit in the file, and how many of it are one of the table's.
UNITS = {
    "elongation_mm": ("m", 1e-3), "twist_deg": ("deg", 1.0), "pressure_kpa": ("bar", 0.01), "force_n": ("mN", 1e3),
    "moment_nmm": ("N·m", 1e-3), "outer_diameter_mm": ("mm", 1.0),
}  # fmt: skip
SHIFT = 12.34


def signal(name: str, time: np.ndarray) -> np.ndarray:
    """What a channel reads, slower than 1 Hz."""
    place = list(UNITS).index(name)
    size = 12.0 if name == "outer_diameter_mm" else 3.0
    return size + np.sin(2 * np.pi * (0.3 + 0.1 * place) * time + place)


def text(names, time, stamp="t", shift=0.0, scale=1.0) -> pd.DataFrame:
    return pd.DataFrame(
        {stamp: scale * (time - shift), **{n: UNITS[n][1] * signal(n, time) for n in names}, "run": "a"}
    )


def csv(frame: pd.DataFrame) -> bytes:
    return frame.to_csv(index=False).encode()


def columns(names) -> dict:
    return {n: {"from": n, "unit": UNITS[n][0]} for n in names}


def recipe(bed, own, join=()):
    made = {"bed": bed, "constants": DESIGN, "carry": ["run"]}
    made |= {"columns": {"time_s": {"from": "t", "unit": "s"}, **columns(own)}} | ({"join": list(join)} if join else {})
    return recipe_of(json.dumps(made), "recipe.yaml")


def of(names, **more) -> dict:
    return {"file": "b.csv", "time": {"from": "t2", "unit": "ms", "plus": SHIFT}, "columns": columns(names)} | more


@pytest.mark.parametrize("bed", list(BEDS))
@pytest.mark.parametrize(("rate", "other"), [(100.0, 37.0), (37.0, 100.0)])
def test_two_loggers_make_the_table_of_one(bed, rate, other):
    imposed, measured = ([q.column for q in kind] for kind in (BEDS[bed].imposed, BEDS[bed].measured))
    time, beside = np.arange(0, 20, 1 / rate), np.arange(2, 18, 1 / other)
    one = convert(recipe(bed, [*imposed, *measured]), {"a.csv": csv(text([*imposed, *measured], time))}).table
    second = text(measured, beside, "t2", SHIFT, 1e3)
    made = convert(recipe(bed, imposed, [of(measured)]), {"a.csv": csv(text(imposed, time)), "b.csv": csv(second)})
    table, (file,) = made.table, made.files
    expected = one[(one["time_s"] >= beside[0]) & (one["time_s"] <= beside[-1])].reset_index(drop=True)
    assert file["lost_by_joining"] == len(one) - len(expected) > 0
    assert list(table) == list(one)
    np.testing.assert_allclose(table["time_s"], expected["time_s"], atol=1e-9)
    for name in imposed:
        np.testing.assert_allclose(table[name], expected[name], atol=1e-9)
    inner = slice(30, -30)
    for name in measured:
        # The largest error of a line is a² / 8 of the second derivative; of the low-pass, its ripple.
        line = (2 * np.pi * 0.8 / other) ** 2 / 8
        np.testing.assert_allclose(table[name][inner], expected[name][inner], atol=1.1 * line if rate > other else 6e-3)
        if rate > other:
            merged = pd.Series(second[name].to_numpy() / UNITS[name][1], index=beside)
            merged = merged.reindex(merged.index.union(table["time_s"])).interpolate("index")[table["time_s"]]
            np.testing.assert_allclose(table[name], merged, atol=1e-8)
    assert any(f"{other:g} Hz onto rows at {rate:g} Hz" in said for said in made.warnings)
    assert file["joined"][0]["from_s"] == pytest.approx(2.0)


def test_what_is_too_fast_for_the_rows_does_not_stand_for_something_slow():
    time, fast = np.arange(0, 20, 0.1), np.arange(0, 20, 0.002)
    second = text(["force_n"], fast, "t2", SHIFT, 1e3)
    second["force_n"] += 1e3 * np.sin(2 * np.pi * 49.7 * fast)
    own = ["elongation_mm", "twist_deg", "pressure_kpa"]
    made = convert(recipe("isometric", own, [of(["force_n"])]), {"a.csv": csv(text(own, time)), "b.csv": csv(second)})
    got = made.table
    np.testing.assert_allclose(got["force_n"][5:-5], signal("force_n", got["time_s"][5:-5]), atol=0.02)
    assert made.files[0]["joined"][0]["filtered_rms"]["force_n"] == pytest.approx(np.sqrt(0.5), rel=0.02)


def test_gaps_blank_readings_and_leave_out_rows_without_what_is_imposed():
    time = np.arange(0, 10, 0.01)
    beside = np.arange(0, 10, 0.05)
    beside = beside[(beside < 4) | (beside > 5)]
    state = ["elongation_mm", "twist_deg"]
    join = of(["pressure_kpa"]), of(["force_n"])
    second = csv(text(["pressure_kpa", "force_n"], beside, "t2", SHIFT, 1e3))
    own = [*state, "pressure_kpa"]
    read = convert(recipe("isometric", own, join[1:]), {"a.csv": csv(text(own, time)), "b.csv": second}).table
    blank = read.loc[read["force_n"].isna(), "time_s"]
    assert (blank.min(), blank.max()) == (pytest.approx(3.96), pytest.approx(5.04))
    both = convert(recipe("isometric", state, join), {"a.csv": csv(text(state, time)), "b.csv": second}).table
    assert len(both) == len(read) - len(blank)
    wide = of(["force_n"], gap_s=2)
    read = convert(recipe("isometric", own, [wide]), {"a.csv": csv(text(own, time)), "b.csv": second}).table
    assert not read["force_n"].isna().any()


def test_pairs_of_columns_in_one_file_with_stamps_twice(tmp_path):
    own = ["elongation_mm", "twist_deg", "pressure_kpa"]
    second = text(["force_n"], np.arange(0, 10, 0.1), "t2").drop(columns="run")
    second.loc[7, "t2"] = second.loc[6, "t2"]
    both = pd.concat([text(own, np.arange(0, 10, 0.02)), second], axis=1)
    join = {"time": {"from": "t2", "unit": "s"}, "columns": columns(["force_n"])}
    made = {"bed": "isometric", "constants": DESIGN, "carry": ["run"], "join": [join]}
    made["columns"] = {"time_s": {"from": "t", "unit": "s"}, **columns(own)}
    table, said = taken(tmp_path, csv(both), json.dumps(made))
    late = table[table["time_s"] > 1]
    np.testing.assert_allclose(late["force_n"], signal("force_n", late["time_s"]), atol=0.03)
    assert any("1 stamps stand there twice" in sentence for sentence in said)
    (tmp_path / "r.yaml").write_text(json.dumps(made))
    read = fl.read_table(tmp_path / "raw.csv", recipe=tmp_path / "r.yaml", bed="isometric")
    np.testing.assert_allclose(read["force_n"], table["force_n"])


def changed(frame: pd.DataFrame, how) -> pd.DataFrame:
    how(frame)
    return frame


BAD = [
    (
        lambda f: f.__setitem__("t2", f["t2"] + 1e6),
        {},
        r"no time in common.* from 1000 to 1009.95 s.*from 0 to .*plus:",
    ),
    (lambda f: f.__setitem__("t2", f["t2"].to_numpy()[::-1]), {}, "runs backwards.*in order"),
    (lambda f: f.loc.__setitem__((f.index > 150, "t2"), f["t2"] + 1e8), {}, "jumps.*correct the clock"),
    (lambda f: f.__delitem__("force_n"), {}, "b.csv has no column 'force_n'"),
    (lambda f: f.__delitem__("t2"), {}, "b.csv has no column 't2'"),
    (lambda f: f.__setitem__("t2", ""), {}, "holds no time"),
    (lambda f: None, {"columns": {"force_n": {"from": "force_n", "unit": "kPa"}}}, "force_n.*kPa"),
    (lambda f: None, {"columns": {"force_n": {"from": "force_n"}}}, "has no unit"),
    (lambda f: None, {"columns": columns(["pressure_kpa"])}, "pressure_kpa is joined, and given a second time"),
    (lambda f: None, {"file": "../b.csv"}, "beside the data"),
    (lambda f: None, {"gap_s": 0}, "give seconds"),
]


@pytest.mark.parametrize(("how", "more", "said"), BAD)
def test_what_cannot_be_joined_is_one_sentence(how, more, said):
    own = ["elongation_mm", "twist_deg", "pressure_kpa"]
    second = changed(text(["force_n", "pressure_kpa"], np.arange(0, 10, 0.05), "t2", SHIFT, 1e3), how)
    with pytest.raises(UserError, match=f"(?s){said}"):
        convert(
            recipe("isometric", own, [of(["force_n"], **more)]),
            {"a.csv": csv(text(own, np.arange(0, 10, 0.1))), "b.csv": csv(second)},
        )


def test_a_file_that_is_not_there_and_rows_without_a_time(tmp_path):
    own = ["elongation_mm", "twist_deg", "pressure_kpa"]
    made = {"bed": "isometric", "constants": DESIGN, "join": [of(["force_n"])]}
    whole = made | {"columns": {"time_s": {"from": "t", "unit": "s"}, **columns(own)}}
    with pytest.raises(UserError, match=r"names b\.csv, which is not beside the data"):
        taken(tmp_path, csv(text(own, np.arange(0, 10, 0.1))), json.dumps(whole))
    with pytest.raises(UserError, match="add time_s to columns"):
        recipe_of(json.dumps(made | {"columns": columns(own)}), "recipe.yaml")
