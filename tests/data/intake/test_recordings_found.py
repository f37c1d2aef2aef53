"""Several recordings of one test, in folders, files, sheets, structures and matrices: all of them are in the table,
each with its channels joined by time."""

import io

import numpy as np
import openpyxl
import pandas as pd
import pytest
from nightly import chosen
from rich.console import Console
from scipy.io import savemat
from test_messy import write

import freelearn as fl
from freelearn.cli.start_command import start
from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.joined import Guessed, guess_and_table
from freelearn.data.intake.guesses.recordings_found import recordings_of
from freelearn.data.intake.guesses.side_by_side import of_files
from freelearn.data.intake.readers.raw_files import table_files
from freelearn.data.intake.readers.raw_table import Place
from freelearn.data.intake.recipes.recipe_file import recipe_of

NUMBERS = (1, 2, 10)


def recording(number, step=0.05):
    """Time [s], pressure [kPa], force [N] of one of them."""
    time = np.arange(0, 6 + number, step)
    return time, 60 - 60 * np.cos(0.9 * time), -30 * np.cos(0.7 * time) - number


def csv(header, *columns):
    rows = (",".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))
    return "\n".join([header, *rows, ""])


def channels(number):
    """The two files of one recording, each at its own rate."""
    time, _, force = recording(number, 0.1)
    set_at, pressure, _ = recording(number)
    return csv("t [s],P [kPa]", set_at, pressure), csv("t [s],F [N]", time, force)


def whole(number):
    return csv("t [s],P [kPa],F [N]", *recording(number))


def in_folders(folder):
    for number in NUMBERS:
        (folder / f"test{number}").mkdir(parents=True)
        for name, text in zip(("pressure", "force"), channels(number), strict=True):
            write(folder / f"test{number}" / f"{name}.csv", text)
    return folder


def in_one_folder(folder):
    folder.mkdir()
    for number in NUMBERS:
        for name, text in zip(("pressure", "force"), channels(number), strict=True):
            write(folder / f"{number}_{name}.csv", text)
    return folder


def in_files(folder):
    folder.mkdir()
    for number in NUMBERS:
        write(folder / f"muscle {number}.csv", whole(number))
    write(folder / "notes.txt", "the valve sticks\n")
    return folder


def matlab(**variables):
    out = io.BytesIO()
    savemat(out, variables)
    return out.getvalue()


def in_sheets(folder):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for number in NUMBERS:
        sheet = book.create_sheet(f"Run {number}")
        sheet.append(["t [s]", "P [kPa]", "F [N]"])
        for row in zip(*(column.tolist() for column in recording(number)), strict=True):
            sheet.append(row)
    out = io.BytesIO()
    book.save(out)
    return write(folder.with_suffix(".xlsx"), out.getvalue())


def in_structures(folder):
    tests = np.zeros((1, 3), dtype=[("who", object), ("t_s", object), ("P_kPa", object), ("F_N", object)])
    for place, number in enumerate(NUMBERS):
        tests[0, place] = ("ann", *(column[:, None] for column in recording(number)))
    return write(folder.with_suffix(".mat"), matlab(test=tests, L0=150.0))


def in_matrices(folder):
    of = {f"test{number}": np.column_stack(recording(number)) for number in NUMBERS}
    return write(folder.with_suffix(".mat"), matlab(**of, L=150.0))


def in_pairs(folder):
    of = {}
    for number in NUMBERS:
        time, _, force = recording(number, 0.1)
        set_at, pressure, _ = recording(number)
        of |= {f"F{number}": np.column_stack([time, force]), f"P{number}": np.column_stack([set_at, pressure])}
    return write(folder.with_suffix(".mat"), matlab(**of))


def in_numpy(folder):
    out = io.BytesIO()
    np.savez(out, **{f"test{number}": np.column_stack(recording(number)) for number in NUMBERS})
    return write(folder.with_suffix(".npz"), out.getvalue())


WAYS = [in_folders, in_one_folder, in_files, in_sheets, in_structures, in_matrices, in_pairs, in_numpy]
SAID = {
    "Is every line right": "", "all of them: each is a recording": "4", "Which rows": "", "What are its rows": "",
    "Fiber angle": "25", "braid": "y", "Unloaded length of": "140", "Unloaded length": "150", "inner radius": "5",
    "outer radius": "6", "the same fiber angle": "y", "held throughout": "0", "actuator pulls": "n", "exactly 0": "n",
    "'column 2' (": "pressure", "'column 3' (": "force", "the time (": "s", "the force (": "N", "the pressure (": "kPa",
    "Enter to go on": "",
}  # fmt: skip


def started(raws, folder, said):
    asked = []

    def ask(prompt):
        asked.append(prompt)
        assert len(asked) < 40, prompt
        return next(answer for words, answer in said.items() if words in prompt)

    start(raws, folder, Console(file=io.StringIO(), width=120), ask)
    return asked


def table_in(folder):
    return pd.read_csv(next(folder.glob("*_table.csv")))


@pytest.mark.parametrize("way", chosen(list(WAYS), 4))
def test_recordings_of_one_actuator_are_one_log(way, tmp_path):
    raw = way(tmp_path / "raw")
    asked = started([raw], tmp_path / "out", {"Of which actuators": "1"} | SAID)
    assert any("3 recordings" in prompt for prompt in asked)
    made = table_in(tmp_path / "out")
    assert made["run"].drop_duplicates().tolist() == [1, 2, 3]
    assert set(made["sample"]) == {1}
    for (_, own), number in zip(made.groupby("run"), NUMBERS, strict=True):
        time, pressure, force = recording(number, 0.1 if way in (in_folders, in_one_folder, in_pairs) else 0.05)
        # What is joined ends with the sooner of the two.
        kept = len(own)
        assert kept >= len(time) - 1
        np.testing.assert_allclose(own["time_s"], time[:kept], atol=1e-7)
        np.testing.assert_allclose(own["force_n"], force[:kept], atol=1e-6)
        # Joined through a low-pass for half the rate.
        np.testing.assert_allclose(own["pressure_kpa"], pressure[:kept], atol=0.05)
    # And the recipe alone makes the log that read_table gives.
    recipe = next((tmp_path / "out").glob("*_recipe.yaml"))
    read = fl.read_table(raw, bed="isometric", recipe=recipe)
    assert read["run"].astype(int).tolist() == made["run"].tolist()
    np.testing.assert_array_equal(read["force_n"], made["force_n"])


@pytest.mark.parametrize("way", [in_folders, in_files, in_sheets])
def test_recordings_of_several_actuators_have_designs_of_their_own(way, tmp_path):
    asked = started([way(tmp_path / "raw")], tmp_path / "out", {"Of which actuators": "2"} | SAID)
    assert sum("Unloaded length of" in prompt for prompt in asked) == 3
    made = table_in(tmp_path / "out")
    assert made["sample"].drop_duplicates().tolist() == [1, 2, 3]
    assert set(made["length_mm"]) == {140}


def test_one_sheet_of_several_alike_may_be_meant_alone(tmp_path):
    said = SAID | {"all of them: each is a recording": "2"}
    started([in_sheets(tmp_path / "raw")], tmp_path / "out", said)
    made = table_in(tmp_path / "out")
    np.testing.assert_allclose(made["force_n"], recording(2)[2], atol=1e-9)


def test_files_named_one_by_one_are_recordings_too(tmp_path):
    folder = in_files(tmp_path / "raw")
    started(sorted(folder.glob("*.csv")), tmp_path / "out", {"Of which actuators": "1"} | SAID)
    assert table_in(tmp_path / "out")["run"].nunique() == 3


def test_a_draft_lists_them_and_a_page_can_keep_the_guess(tmp_path):
    folder = in_folders(tmp_path / "raw")
    files = table_files(folder)
    assert files[:2] == ["test1/force.csv", "test1/pressure.csv"]
    assert files[-1] == "test10/pressure.csv", "in the order of people"
    found, _ = of_files([folder / name for name in files], folder)
    text = draft(found)
    assert 'name: "test10/force.csv", sample: 1, beside: [{file: "test10/pressure.csv"}]' in text
    assert Guessed.from_plain(Guessed(found).plain()).found.recordings == found.recordings


def test_what_has_no_partner_is_no_recording():
    def places(*names):
        return [(Place(name), (name.rpartition("/")[2].strip("0123456789"),)) for name in names]

    assert len(recordings_of(places("a/f.csv", "a/p.csv", "b/f.csv", "b/p.csv"))) == 2
    assert recordings_of(places("a/f.csv", "a/p.csv", "b/f.csv")) == ((Place("a/f.csv"),), (Place("b/f.csv"),))
    assert recordings_of(places("a/f.csv", "a/p.csv", "b/f.csv", "c/p.csv")) == ()
    assert recordings_of(places("a/f.csv", "a/p.csv")) == ()


def test_a_folder_of_strangers_and_a_list_that_does_not_fit_say_so(tmp_path):
    folder = tmp_path / "raw"
    folder.mkdir()
    write(folder / "a.csv", csv("t [s],P [kPa],F [N]", *recording(1)))
    write(folder / "b.csv", csv("n,M [N·m],phi [deg]", *recording(1)))
    with pytest.raises(UserError, match="neither recordings of one form nor channels"):
        started([folder], tmp_path / "out", SAID)
    with pytest.raises(UserError, match="is a folder: name it alone"):
        started([folder, folder / "a.csv"], tmp_path / "out", SAID)
    recipe = (
        "bed: isometric\nconstants: {gamma_deg: 20, length_mm: 90, inner_radius_mm: 5, outer_radius_mm: 6, "
        "elongation_mm: 0, twist_deg: 0}\ncolumns: {time_s: {from: t, unit: s}, force_n: {from: F, unit: N}}\n"
        "join: [{file: p.csv, time: {from: t, unit: s}, columns: {pressure_kpa: {from: P, unit: kPa}}}]\n"
        "files: [{name: f1.csv, beside: [{file: p1.csv}, {file: p2.csv}]}]\n"
    )
    with pytest.raises(UserError, match=r"beside of f1.csv says where .* one for each of its 1"):
        recipe_of(recipe, "r")
    with pytest.raises(UserError, match="give the name of a file in the folder"):
        recipe_of(recipe.replace("p1.csv}, {file: p2.csv", "../p1.csv"), "r")
    with pytest.raises(UserError, match="a second time"):
        recipe_of("bed: isometric\nfiles: [{read: {sheet: a}}, {read: {sheet: a}}]\n", "r")


def test_numpys_objects_are_not_opened(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{"t": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(UserError, match=r"a\.npy cannot be read .*"):
        guess_and_table(tmp_path / "a.npy")
