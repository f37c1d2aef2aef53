"""Several clocks in what a laboratory took down: the draft sees them, and what is joined by it are the numbers that a
hand joins."""

import json
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from nightly import chosen
from raw_files import taken_path
from rich.console import Console
from test_draft_questions import USUAL, interview
from test_messy import book, hdf5, mat, ods, parquet, table_of, write

from freelearn.api.settings.settings import IntakeData, IntakeSettings
from freelearn.cli.intake_command import take_in
from freelearn.cli.start_command import start
from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.guessed import NO
from freelearn.data.intake.guesses.joined import Guessed, guess_and_table
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.recipes.recipe_file import recipe_of

# What the rig set, by a clock of its own [s, mm, kPa], and the force by another [s, N]: the two begin and end apart.
SET_S, READ_S = np.arange(0, 30, 0.25), np.arange(1.003, 27, 0.04)
ELONGATION, PRESSURE = 4 * np.sin(0.4 * SET_S), 80 + 60 * np.sin(0.9 * SET_S + 1)
FORCE = 20 * np.cos(0.7 * READ_S) - 30


def pairs(header, columns, separator=",", decimal="."):
    """Columns of different lengths side by side, as text."""
    longest = max(map(len, columns))
    cells = [[f"{v:.15g}".replace(".", decimal) if isinstance(v, float) else v for v in c] for c in columns]
    rows = [separator.join(c[i] if i < len(c) else "" for c in cells) for i in range(longest)]
    return "\n".join([separator.join(header), *rows, ""])


def columns(time=1.0, other=1.0, pressure=1.0):
    """Those of the rig and those of the load cell, in units of which so many are one of s, s and kPa."""
    return [(time * SET_S).tolist(), ELONGATION.tolist(), (pressure * PRESSURE).tolist(), (other * READ_S).tolist(),
            FORCE.tolist()]  # fmt: skip


def found_in(text):
    return guess_table(raw_table(text.encode(), "raw.csv"))


def within(time, other):
    return (time >= other[0]) & (time <= other[-1])


def is_joined(table):
    """Against what a hand joins: the load cell's rows, and between two readings of the rig a straight line."""
    inside = within(READ_S, SET_S)
    np.testing.assert_allclose(table["time_s"], READ_S[inside], atol=1e-6)
    np.testing.assert_allclose(table["force_n"], FORCE[inside], rtol=1e-8)
    for name, values in (("elongation_mm", ELONGATION), ("pressure_kpa", PRESSURE)):
        np.testing.assert_allclose(table[name], np.interp(READ_S[inside], SET_S, values), atol=1e-6)


HEADINGS = {
    "english": (("Time [s]", "Extension [mm]", "Pressure [kPa]", "Time cell [ms]", "Force [N]"), 1, 1000, 1),
    "german": (("Zeit [s]", "Weg [mm]", "Druck [bar]", "Zeit Kraft [ms]", "Kraft [N]"), 1, 1000, 0.01),
    "french": (("Temps [min]", "Allongement [mm]", "Pression [bar]", "Temps 2 [s]", "Force [N]"), 1 / 60, 1, 0.01),
    "italian": (("Tempo [s]", "Spostamento [mm]", "Pressione [kPa]", "Tempo [s]", "Forza [N]"), 1, 1, 1),
    "spanish": (("Tiempo [s]", "Desplazamiento [mm]", "Presión [MPa]", "Tiempo F [s]", "Fuerza [N]"), 1, 1, 1e-3),
    "japanese": (("時間[s]", "変位[mm]", "圧力[kPa]", "時間2[s]", "力[N]"), 1, 1, 1),
    "short": (("t_P [s]", "dl_mm", "P_kPa", "t_F [ms]", "F_N"), 1, 1000, 1),
}


@pytest.mark.parametrize("language", HEADINGS)
def test_pairs_in_one_file_are_drafted_with_a_join(language, tmp_path):
    header, time, other, pressure = HEADINGS[language]
    text = pairs(header, columns(time, other, pressure), ";", "," if language != "japanese" else ".")
    found = found_in(text)
    assert [clock.channels for clock in found.clocks] == [(header[4],), (header[1], header[2])]
    (said,) = [note for note in found.notes if "clocks" in note]
    assert f"{header[4]!r} by" in said
    assert "whose rows the table has" in said
    assert repr(header[2]) in said
    is_joined(table_of(write(tmp_path / "raw.csv", text)))
    # And a page can keep the guess.
    assert Guessed.from_plain(json.loads(json.dumps(Guessed(found).plain()))).found.clocks == found.clocks


def test_each_time_may_stand_behind_its_channels(tmp_path):
    first, dl, pressure, second, force = columns()
    header = ("dl_mm", "P_kPa", "t1 [s]", "F_N", "t2 [s]")
    is_joined(table_of(write(tmp_path / "raw.csv", pairs(header, [dl, pressure, first, force, second]))))


def test_three_clocks_and_what_is_asked_of_them():
    warm = 20 + 0.1 * np.arange(0, 28, 1.0)
    header = ("t1 [s]", "dl_mm", "P_kPa", "t2", "F_N", "t3", "Temp [°C]")
    text = pairs(header, [*columns(other=1000), np.arange(0, 28, 1.0).tolist(), warm.tolist()])
    found = found_in(text)
    assert [clock.time for clock in found.clocks] == ["t2", "t1 [s]", "t3"]
    # By milliseconds, and by seconds, they run as the first does; with a unit that nobody can tell they are asked for.
    made, asked, recipe = interview(found, USUAL | {"clock": "2"})
    assert {"clock", "unit.t2", "unit.t3"} <= set(asked)
    assert "TODO" not in recipe
    assert (made["unit.t2"], made["unit.t3"]) == ("ms", "s")
    table = convert(recipe_of(recipe, "r"), {"raw.csv": text.encode()}).table
    # The rig's rows, as was answered.
    inside = within(SET_S, READ_S)
    np.testing.assert_allclose(table["pressure_kpa"], PRESSURE[inside], atol=1e-6)
    np.testing.assert_allclose(table["temperature_c"], np.interp(SET_S[inside], np.arange(0, 28, 1.0), warm), atol=1e-6)
    # Faster than the rows: through the low-pass, which leaves so slow a force.
    np.testing.assert_allclose(table["force_n"][5:-5], 20 * np.cos(0.7 * SET_S[inside][5:-5]) - 30, atol=0.02)
    alone = recipe_of(interview(found, USUAL | {"clock": NO, "gaps": "1"})[2], "r")
    assert not alone.join


def test_clocks_that_begin_apart_are_asked_for_the_seconds_between():
    header = ("t1 [s]", "dl_mm", "P_kPa", "t2 [s]", "F_N")
    text = pairs(header, [*columns()[:3], (READ_S + 5000).tolist(), FORCE.tolist()])
    found = found_in(text)
    drafted = draft(found)
    assert "TODO: 't1 [s]' runs from 0 to 29.75 s, 't2 [s]' from 5001.003" in drafted
    assert "common start" in drafted
    _, asked, recipe = interview(found, USUAL | {"plus.t1 [s]": "5000"})
    assert "plus.t1 [s]" in asked
    assert "TODO" not in recipe
    table = convert(recipe_of(recipe, "r"), {"raw.csv": text.encode()}).table
    is_joined(table.assign(time_s=table["time_s"] - 5000))


def test_what_is_one_clock_is_joined_to_nothing():
    time = SET_S.tolist()
    channels = [ELONGATION.tolist(), PRESSURE.tolist(), np.cos(SET_S).tolist()]
    for other in ((1000 * SET_S).tolist(), (SET_S + 1.77e9).tolist()):
        header = ("t [s]", "dl_mm", "P_kPa", "t_ms", "F_N")
        assert not found_in(pairs(header, [time, *channels[:2], other, channels[2]])).clocks
    # A shift by less than the recording is another clock's; a number of the row is none.
    late = found_in(pairs(("t [s]", "dl_mm", "P_kPa", "t2 [s]", "F_N"), [time, *channels[:2], (SET_S + 0.1).tolist(),
                                                                         channels[2]]))  # fmt: skip
    assert [clock.time for clock in late.clocks] == ["t2 [s]", "t [s]"]
    number = [str(i) for i in range(len(SET_S))]
    assert not found_in(pairs(("t [s]", "dl_mm", "P_kPa", "No.", "F_N"), [time, *channels[:2], number,
                                                                         channels[2]])).clocks  # fmt: skip


def test_doubts_about_joined_channels_change_what_is_joined():
    first, dl, pressure, second, force = columns(pressure=1.0)
    pressure = [v + 101.325 - 20 for v in pressure]
    pressure[7], force[3] = "OL?", "kaputt"
    header = ("t1 [s]", "dl_mm", "P_kPa", "t2 [s]", "F_N")
    text = pairs(header, [first, dl, pressure, second, force])
    _, asked, recipe = interview(found_in(text), USUAL | {"words.F_N": "1", "words.P_kPa": "1", "absolute": "y"})
    assert {"words.F_N", "words.P_kPa", "absolute"} <= set(asked)
    table = convert(recipe_of(recipe, "r"), {"raw.csv": text.encode()}).table
    left, known = np.arange(len(READ_S)) != 3, np.arange(len(SET_S)) != 7
    np.testing.assert_allclose(table["time_s"], READ_S[left], rtol=1e-9)
    expected = np.interp(READ_S[left], SET_S[known], PRESSURE[known] - 20)
    np.testing.assert_allclose(table["pressure_kpa"], expected, atol=1e-6)


def stamps(time, form="iso"):
    """Times [s] as a logger that was started at 9:59:30 writes them."""
    hours = [f"{9 + int(t + 3570) // 3600:02d}:{int(t + 3570) % 3600 // 60:02d}:{(t + 3570) % 60:06.3f}" for t in time]
    if form == "german":
        return [f"25.02.2026 {cell}".replace(".", ",").replace("25,02,2026", "25.02.2026") for cell in hours]
    return [f"2026-02-25{'T' if form == 'zone' else ' '}{cell}{'Z' if form == 'zone' else ''}" for cell in hours]


@pytest.mark.parametrize(("first", "second"), [("iso", "iso"), ("german", "zone")])
def test_clocks_of_dates_need_no_common_start(first, second, tmp_path):
    header = ("Zeitstempel", "dl_mm", "P_kPa", "timestamp", "F_N")
    text = pairs(header, [stamps(SET_S, first), *columns()[1:3], stamps(READ_S, second), FORCE.tolist()], ";")
    table = table_of(write(tmp_path / "raw.csv", text))
    # The table begins at the load cell's first whole second.
    is_joined(table.assign(time_s=table["time_s"] + 1))


def test_dates_beside_seconds_say_what_is_needed():
    header = ("Zeitstempel", "dl_mm", "P_kPa", "t2 [s]", "F_N")
    text = pairs(header, [stamps(SET_S), *columns()[1:]])
    found = found_in(text)
    drafted = draft(found)
    assert "TODO: 'Zeitstempel' holds dates, from 2026-02-25 09:59:30.000 on, and 't2 [s]' counts seconds" in drafted
    for key in ("gamma_deg: 25", "length_mm: 150", "inner_radius_mm: 5", "outer_radius_mm: 6", "twist_deg: 0"):
        drafted = drafted.replace(f"  {key.split()[0]}   #", f"  {key}   #")
    with pytest.raises(
        UserError, match=r"have no common start: join\[1\]\.time holds dates, from .*minus: 1772013570,"
    ):
        convert(recipe_of(drafted, "r"), {"raw.csv": text.encode()})
    with pytest.raises(UserError, match=r"of join\[1\]\.time holds dates.*unit: date"):
        convert(recipe_of(drafted.replace("unit: date", "unit: s"), "r"), {"raw.csv": text.encode()})
    for answer in ("1", "2"):
        _, asked, recipe = interview(found, USUAL | {"clock": answer, "plus.Zeitstempel": "0", "plus.t2 [s]": "0"})
        table = convert(recipe_of(recipe, "r"), {"raw.csv": text.encode()}).table
        assert any(key.startswith("plus.") for key in asked)
        assert "TODO" not in recipe
        if answer == "1":
            is_joined(table)
        else:
            inside = within(SET_S, READ_S)
            np.testing.assert_allclose(table["time_s"], SET_S[inside], atol=1e-6)
            np.testing.assert_allclose(table["pressure_kpa"], PRESSURE[inside], atol=1e-6)


def test_pressures_of_several_actuators_lead_or_are_said_to_go_by_several_clocks():
    header = ("t1 [s]", "dl_mm", "P1_kPa", "P2_kPa", "t2 [s]", "F_N")
    rig = [SET_S.tolist(), ELONGATION.tolist(), PRESSURE.tolist(), (0.5 * PRESSURE).tolist()]
    found = found_in(pairs(header, [*rig, READ_S.tolist(), FORCE.tolist()]))
    assert [clock.time for clock in found.clocks] == ["t1 [s]", "t2 [s]"]
    header = ("t1 [s]", "dl_mm", "P1_kPa", "t2 [s]", "P2_kPa", "F_N")
    found = found_in(pairs(header, [*rig[:3], READ_S.tolist(), READ_S.tolist(), FORCE.tolist()]))
    assert not found.clocks
    assert any("go by several clocks, and those of several actuators are not joined" in note for note in found.notes)


RIG, CELL = ("t_s", "dl_mm", "P_kPa"), ("t_ms", "F_N")


def rig():
    return dict(zip(RIG, (SET_S, ELONGATION, PRESSURE), strict=True))


def cell():
    return dict(zip(CELL, (1000 * READ_S, FORCE), strict=True))


def sheets(made):
    """One for each, and one about the actuator."""

    def fill(sheet, made_book):
        sheet.title = "Notizen"
        sheet["A1"], sheet["B1"] = "Länge unbelastet [mm]", 150
        for name, columns in made.items():
            other = made_book.create_sheet(name)
            for place, (heading, values) in enumerate(columns.items(), start=1):
                for row, value in enumerate([heading, *values.tolist()], start=1):
                    other.cell(row, place, value)

    return book(fill)


def frames(made):
    return {name: pd.DataFrame(columns) for name, columns in made.items()}


def grouped(file):
    for group, columns in (("rig", rig()), ("cell", cell())):
        for name, values in columns.items():
            file[f"{group}/{name}"] = values


def as_structures(file):
    grouped(file)
    for group in ("rig", "cell"):
        for name in list(file[group]):
            values = file[group][name][()]
            del file[group][name]
            file[group][name] = values.reshape(1, -1)
            file[group][name].attrs["MATLAB_class"] = np.bytes_("double")


def lone(file, matlab=False):
    for name, values in (rig() | cell()).items():
        file[name] = values.reshape(1, -1) if matlab else values
        if matlab:
            file[name].attrs["MATLAB_class"] = np.bytes_("double")


PLACES = {
    "sheets.xlsx": lambda: sheets({"Rig": rig(), "Kraft": cell()}),
    "sheets.ods": lambda: ods(frames({"Rig": rig(), "Kraft": cell()})),
    "same name in both.xlsx": lambda: sheets(
        {"Rig": rig(), "Kraft": {"t_s": READ_S, "F_N": FORCE}}
    ),
    "structures.mat": lambda: mat(rig=rig(), cell=cell(), note="rig 2"),
    "arrays.mat": lambda: mat(**rig(), **cell(), L0_mm=150.0),
    "one structure.mat": lambda: mat(log=rig() | cell()),
    "new structures.mat": lambda: hdf5(as_structures, 512),
    "new arrays.mat": lambda: hdf5(lambda file: lone(file, True), 512),
    "groups.h5": lambda: hdf5(grouped),
    "arrays.h5": lambda: hdf5(lone),
    "pairs.parquet": lambda: parquet(
        pd.concat([pd.DataFrame(rig()), pd.DataFrame(cell())], axis=1)
    ),
    "stamps.parquet": lambda: parquet(
        pd.concat([pd.DataFrame(rig()), pd.DataFrame(cell())], axis=1).assign(
            t_s=pd.Series(pd.Timestamp("2026-02-25 09:00:01") + pd.to_timedelta(SET_S, unit="s")),
            t_ms=pd.Series(pd.Timestamp("2026-02-25 09:00:01") + pd.to_timedelta(READ_S.round(3), unit="s")),
        )
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", chosen(list(PLACES), 5))
def test_sheets_structures_groups_and_arrays_of_several_lengths(name, tmp_path):
    path = write(tmp_path / name, PLACES[name]())
    found, _, raw = guess_and_table(path)
    assert len(found.clocks) == 2
    assert any("whose rows the table has" in note for note in found.notes)
    table = table_of(path)
    is_joined(table.assign(time_s=table["time_s"] + (1 if name.startswith("stamps") else 0)))
    # And a page, and a terminal where the other clock is wanted.
    assert Guessed.from_plain(json.loads(json.dumps(Guessed(found).plain()))).found.clocks == found.clocks
    _, _, recipe = interview(found, USUAL | {"clock": "2"}, raw=raw)
    other = convert(recipe_of(recipe, "r"), {name: path.read_bytes()}).table
    inside = within(SET_S, READ_S)
    np.testing.assert_allclose(other["pressure_kpa"], PRESSURE[inside], rtol=1e-9)
    np.testing.assert_allclose(other["force_n"][5:-5], 20 * np.cos(0.7 * SET_S[inside][5:-5]) - 30, atol=0.02)


def test_files_of_one_folder_are_channels_of_one_test(tmp_path):
    raw = tmp_path / "raw"
    raw.mkdir()
    write(raw / "kraft.csv", pairs(("Zeit [ms]", "Kraft [N]"), [(1000 * READ_S).tolist(), FORCE.tolist()], ";", ","))
    header, (first, dl, pressure, *_) = ("Zeit [s]", "Weg [mm]", "Druck [bar]"), columns(pressure=0.01)
    write(raw / "rig.csv", pairs(header, [first, dl, pressure]))
    (raw / "notes.txt").write_text("valve sticks\n")
    drafted = made_by_intake(tmp_path, raw)
    assert "- name: kraft.csv" in drafted or 'name: "kraft.csv"' in drafted
    assert 'file: "rig.csv"' in drafted
    for key in ("gamma_deg: 25", "length_mm: 150", "inner_radius_mm: 5", "outer_radius_mm: 6", "twist_deg: 0"):
        drafted = drafted.replace(f"  {key.split()[0]}   #", f"  {key}   #")
    table, said = taken_path(tmp_path, raw, drafted)
    is_joined(table)
    assert any("joined by time" in one for one in said)


def made_by_intake(tmp_path, raw):
    """The draft that intake writes of a folder."""
    take_in(IntakeSettings(IntakeData(raw), None, None), tmp_path / "drafts", Console(file=StringIO(), width=120))
    return (tmp_path / "drafts" / "raw_recipe.yaml").read_text()


def test_files_of_the_same_quantities_are_several_samples(tmp_path):
    raw = tmp_path / "raw"
    raw.mkdir()
    for name in ("one.csv", "two.csv"):
        write(raw / name, pairs(RIG, list(map(np.ndarray.tolist, rig().values()))))
    drafted = made_by_intake(tmp_path, raw)
    assert "join" not in drafted
    assert "two.csv" in drafted


def test_sheets_of_the_same_quantities_are_still_asked_for(tmp_path):
    path = write(tmp_path / "two.xlsx", sheets({"A": rig() | {"F_N": SET_S}, "B": rig() | {"F_N": SET_S}}))
    found, _, _ = guess_and_table(path)
    assert found.sheets == ("A", "B")
    assert not found.clocks


def test_start_takes_files_of_one_test_and_asks_for_the_rest(tmp_path):
    cells = write(tmp_path / "kraft.csv", pairs(CELL, list(map(np.ndarray.tolist, cell().values()))))
    others = write(tmp_path / "rig.csv", pairs(RIG, list(map(np.ndarray.tolist, rig().values()))))
    said = {
        "Is every line right": "", "What did the rig": "", "Which rows": "", "What are its rows": "",
        "Fiber angle": "25", "braid": "y", "Unloaded length": "150", "inner radius": "5", "outer radius": "6",
        "twist": "0", "pulls": "n", "gauge read at rest": "2", "Enter to go on": "",
    }  # fmt: skip

    asked = []

    def ask(prompt):
        asked.append(prompt)
        assert len(asked) < 40, prompt
        return next(answer for words, answer in said.items() if words in prompt)

    following = start([cells, others], tmp_path / "out", Console(file=StringIO(), width=120), ask)
    assert following.command == "discover"
    made = pd.read_csv(tmp_path / "out" / "kraft_table.csv")
    is_joined(made)
    assert set(made["run"]) == {1}
    again = start([cells, others], tmp_path / "again", Console(file=StringIO(), width=120), ask,
                  recipe=tmp_path / "out" / "kraft_recipe.yaml")  # fmt: skip
    assert again.command == "discover"
