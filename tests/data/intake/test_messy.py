"""Forty messy files of one small experiment: each gives its numbers, or is refused in a sentence."""

import io
import re

import numpy as np
import openpyxl
import pandas as pd
import pytest
from scipy.io import savemat

from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.joined import guess_file
from freelearn.data.intake.recipes.recipe_file import recipe_of

# Elongation [mm], pressure [kPa], force [N].
TRUE = np.array([(x, p, 1.5 - 0.25 * p - 2 * x) for x in (0.0, -2.5, -5.0) for p in (0.0, 50.0, 100.0, 150.0)])
PLAIN = ("dl_mm", "P_kPa", "F_N")
ANSWERS = {
    "gamma_deg": 25, "length_mm": 150, "inner_radius_mm": 5, "outer_radius_mm": 6, "twist_deg": 0, "elongation_mm": 0
}  # fmt: skip


def text(header=PLAIN, separator=",", decimal=".", factors=(1, 1, 1), before="", after="", units=None, rows=None):
    """A file of text."""
    lines = [
        separator.join(f"{v * f:.10g}".replace(".", decimal) for v, f in zip(r, factors, strict=True)) for r in TRUE
    ]
    head = [separator.join(header), *([separator.join(units)] if units else [])]
    return before + "\n".join([*head, *(rows or lines)]) + "\n" + after


def lines(**changed):
    """The lines of a plain file, some of them changed by their number."""
    made = text().splitlines()
    for key, line in changed.items():
        made[int(key[1:])] = line
    return "\n".join(made) + "\n"


def book(fill):
    """A workbook, filled by a function of its first sheet."""
    made = openpyxl.Workbook()
    fill(made.active, made)
    out = io.BytesIO()
    made.save(out)
    return out.getvalue()


def filled(sheet, header=PLAIN, start=1, column=1):
    """Writes the table to a sheet."""
    for i, row in enumerate([header, *TRUE.tolist()]):
        for j, value in enumerate(row):
            sheet.cell(start + i, column + j, value)


def titled(sheet, _):
    sheet["A1"] = "Versuch 12, Muskel 3"
    sheet.merge_cells("A1:C1")
    filled(sheet, start=3)


def with_a_second_sheet(sheet, made):
    filled(sheet)
    made.create_sheet("Notizen")["A1"] = "Ventil klemmt"


def text_cells(sheet, _):
    filled(sheet)
    for row in range(2, 14):
        sheet.cell(row, 3).value = str(sheet.cell(row, 3).value)


def decimal_commas(sheet, _):
    """German numbers that were pasted as text, as far as no mark stands before three digits."""
    filled(sheet)
    for row in range(2, 14):
        sheet.cell(row, 3).value = f"{sheet.cell(row, 3).value:.2f}".replace(".", ",")


def thousandths(sheet, _):
    """Pressures in MPa, whose numbers have a mark before three digits; beside whole ones."""
    filled(sheet, ("dl_mm", "P_MPa", "F_kN"))
    for row in range(2, 14):
        sheet.cell(row, 2).value /= 1000
        sheet.cell(row, 3).value /= 1000


def grouped_header(sheet, _):
    """Names of groups merged over the headings, a column of times and one of remarks."""
    import datetime

    filled(sheet, ("Weg [mm]", "Druck [kPa]", "Kraft [N]"), start=4, column=2)
    sheet["A4"], sheet["E4"], sheet["E7"] = "Zeitpunkt", "Bemerkung", "Ventil nachgestellt"
    for row in range(5, 17):
        sheet.cell(row, 1).value = datetime.datetime(2026, 2, 25, 10, row)
    sheet["B3"], sheet["D3"] = "gestellt", "gemessen"
    sheet.merge_cells("B3:C3")


def with_a_mean(sheet, _):
    """A line of means below the readings."""
    filled(sheet, ("Nr.", *PLAIN[1:]))
    for row, x in enumerate(TRUE[:, 0], start=2):
        sheet.cell(row, 4).value, sheet.cell(row, 1).value = x, row - 1
    sheet["D1"] = PLAIN[0]
    sheet["A15"], sheet["C15"] = "Mittelwert", float(TRUE[:, 2].mean())


def with_sums(sheet, _):
    """Lines of sums below the readings, one of them nameless, and a cell beside them; none was ever calculated."""
    filled(sheet)
    sheet["A15"], sheet["C15"], sheet["C16"] = "Summe", "=SUM(C2:C13)", "=MAX(C$2:C$13)-MIN(C$2:C$13)"
    sheet["E2"] = "=STDEV(B2:B13)"


def with_a_date(sheet, _):
    import datetime

    filled(sheet)
    sheet.cell(4, 3).value = datetime.datetime(2026, 2, 25)


def merged_down(sheet, _):
    filled(sheet)
    sheet.merge_cells("A2:A5")


def merged_across(sheet, _):
    filled(sheet)
    sheet.merge_cells("A2:B2")


def mat(**variables):
    out = io.BytesIO()
    savemat(out, variables)
    return out.getvalue()


def ods(sheets):
    pytest.importorskip("odf")
    out = io.BytesIO()
    with pd.ExcelWriter(out, engine="odf") as writer:
        for name, frame in sheets.items():
            frame.to_excel(writer, sheet_name=name, index=False)
    return out.getvalue()


def structures(count=1):
    """The readings in a structure beside one of settings; or an array of structures of a number each."""
    readings = dict(zip(PLAIN, TRUE.T, strict=True))
    if count == 1:
        return mat(data=readings | {"who": "ann"}, setup={"gains": np.arange(3.0), "L0_mm": 150.0}, note="rig 2")
    rows = np.empty((1, len(TRUE)), dtype=[(name, object) for name in PLAIN])
    for row, values in enumerate(TRUE):
        for name, value in zip(PLAIN, values, strict=True):
            rows[0, row][name] = value
    return mat(log=rows)


def as_structures(file):
    """The same as MATLAB's version 7.3 has it."""
    for name, values in zip(PLAIN, TRUE.T, strict=True):
        file[f"data/{name}"] = values.reshape(1, -1)
        file[f"data/{name}"].attrs["MATLAB_class"] = np.bytes_("double")
    file["setup/gains"] = np.arange(3.0).reshape(1, -1)
    file["setup/gains"].attrs["MATLAB_class"] = np.bytes_("double")


def as_table(file):
    """What MATLAB leaves of a table in a file of version 7.3: numbers that mean nothing without MATLAB."""
    file["T"] = np.array([[3707764736, 2, 1, 1, 1, 1]], dtype=np.uint32)
    file["T"].attrs["MATLAB_class"] = np.bytes_("table")


def hdf5(fill, userblock=0):
    h5py = pytest.importorskip("h5py")
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=userblock) as file:
        fill(file)
    content = out.getvalue()
    return b"MATLAB 7.3 MAT-file".ljust(userblock, b" ") + content[userblock:] if userblock else content


def as_matlab(file):
    for name, values in zip(PLAIN, TRUE.T, strict=True):
        file[name] = values.reshape(1, -1)
        file[name].attrs["MATLAB_class"] = np.bytes_("double")


def as_records(file):
    file["log"] = np.array([tuple(row) for row in TRUE], dtype=[(name, "f8") for name in PLAIN])


def as_group(file):
    for name, values in zip(PLAIN, TRUE.T, strict=True):
        file[f"run1/{name}"] = values


def parquet(frame):
    pytest.importorskip("pyarrow")
    out = io.BytesIO()
    frame.to_parquet(out)
    return out.getvalue()


FRAME = pd.DataFrame(TRUE, columns=PLAIN)
GERMAN, FRENCH = ("Weg [mm]", "Druck [bar]", "Kraft [N]"), ("Allongement (mm)", "Pression (bar)", "Force (N)")
ITALIAN, SPANISH = (
    ("Spostamento [mm]", "Pressione [kPa]", "Forza [N]"),
    ("Desplazamiento (mm)", "Presión (MPa)", "Fuerza (N)"),
)
JAPANESE, IMPERIAL = ("変位（ｍｍ）", "圧力（ｋＰａ）", "力（Ｎ）"), ("Stretch [in]", "Pressure (psi)", "Load (lbf)")
BAR, PSI = (1, 0.01, 1), (1 / 25.4, 1 / 6.894757293168361, 1 / 4.4482216152605)
RIGHT = {
    "plain.csv": lambda: text(),
    "german.csv": lambda: text(GERMAN, ";", ",", BAR).encode("cp1252"),
    "german tabs.tsv": lambda: text(GERMAN, "\t", ",", BAR).encode("utf-16"),
    "french.csv": lambda: text(FRENCH, ";", ",", BAR).encode("latin-1"),
    "italian.txt": lambda: text(ITALIAN, "\t", ","),
    "spanish.csv": lambda: text(SPANISH, ";", ",", (1, 0.001, 1)).encode("utf-8-sig"),
    "japanese.csv": lambda: text(JAPANESE).encode("utf-8-sig"),
    "japanese sjis.csv": lambda: text(JAPANESE).encode("cp932"),
    "imperial.csv": lambda: text(IMPERIAL, factors=PSI),
    "units row.csv": lambda: text(("dl", "P", "F"), units=("mm", "kPa", "N")),
    "units in brackets.csv": lambda: text(("dl", "P", "F"), units=("[mm]", "[kPa]", "[N]")),
    "comments.csv": lambda: text(before="# bed 3\n# operator: ann\n\n", after="# end\n"),
    "titles.csv": lambda: text(before="Test 12,,\nMuscle 3,,\n,,\n"),
    "blank lines.csv": lambda: text().replace("\n", "\n\n"),
    "spaces.dat": lambda: text(separator="   "),
    "bars.txt": lambda: text(separator=" | "),
    "quotes.csv": lambda: re.sub(r"[^,\n]+", r'"\g<0>"', text()),
    "sep line.csv": lambda: text(separator=";", before="sep=;\n"),
    "windows ends.csv": lambda: text().replace("\n", "\r\n"),
    "repeated header.csv": lambda: lines(n5="dl_mm,P_kPa,F_N\n" + text().splitlines()[5]),
    "minus signs.csv": lambda: text().replace("-", "−"),
    "exponents.csv": lambda: text(rows=[",".join(f"{v:.6E}" for v in row) for row in TRUE]),
    "time stamps.csv": lambda: text(
        ("Zeitstempel", *PLAIN), rows=[f"2026-02-25 10:00:{i:02d},{','.join(map(str, r))}" for i, r in enumerate(TRUE)]
    ),
    "remarks.csv": lambda: text((*PLAIN, "remark"), rows=[f"{','.join(map(str, r))},ok" for r in TRUE]),
    "excel.xlsx": lambda: book(lambda sheet, _: filled(sheet)),
    "excel title.xlsx": lambda: book(titled),
    "excel shifted.xlsx": lambda: book(lambda sheet, _: filled(sheet, start=4, column=3)),
    "excel sheets.xlsx": lambda: book(with_a_second_sheet),
    "excel merged rows.xlsx": lambda: book(merged_down),
    "excel text.xlsx": lambda: book(text_cells),
    "excel decimal commas.xlsx": lambda: book(decimal_commas),
    "excel thousandths.xlsx": lambda: book(thousandths),
    "excel groups and times.xlsx": lambda: book(grouped_header),
    "excel mean below.xlsx": lambda: book(with_a_mean),
    "excel sums never calculated.xlsx": lambda: book(with_sums),
    "structures.mat": lambda: structures(),
    "array of structures.mat": lambda: structures(len(TRUE)),
    "new structures.mat": lambda: hdf5(as_structures, 512),
    "words.parquet": lambda: parquet(FRAME.assign(who="ann", F_N=[f"{f:.2f}".replace(".", ",") for f in TRUE[:, 2]])),
    "tabs and comments.tsv": lambda: text(separator="\t", before="% rig 2\n% 25.02.2026 10:00\n", after="% end\n"),
    "mac ends.csv": lambda: text().replace("\n", "\r").encode("mac-roman"),
    "utf-16 big.csv": lambda: text(GERMAN, ";", ",", BAR).encode("utf-16-be"),
    "old.mat": lambda: mat(**dict(zip(PLAIN, TRUE.T, strict=True))),
    "structure.mat": lambda: mat(data=dict(zip(PLAIN, TRUE.T, strict=True))),
    "new.mat": lambda: hdf5(as_matlab, 512),
    "records.h5": lambda: hdf5(as_records),
    "group.hdf5": lambda: hdf5(as_group),
    "table.parquet": lambda: parquet(FRAME),
    "sheet.ods": lambda: ods({"Tabelle1": FRAME}),
    "sheets.ods": lambda: ods({"Notizen": pd.DataFrame({"Notiz": ["Ventil"]}), "Messung": FRAME}),
}
# What nobody can read without asking: file → what is said.
REFUSED = {
    "unknown heading.csv": (lambda: text(("Wert A [mm]", *PLAIN[1:])), "elongation_mm is blank"),
    "no units.csv": (lambda: text(("dl", "P", "F")), "has no unit"),
    "gap.csv": (lambda: lines(n4="0,,-30"), "pressure_kpa is blank"),
    "date in a cell.csv": (lambda: lines(n4="0,25.02.2026,-30"), "is a date"),
    "thousands.csv": (lambda: text(separator=";").replace("-23.5", "-1,023.5"), "thousands|not a number"),
    "excel date.xlsx": (lambda: book(with_a_date), "date"),
    "table.mat": (lambda: hdf5(as_table, 512), "table2struct"),
    "merged.xlsx": (lambda: book(merged_across), "merged"),
    "two muscles.csv": (
        lambda: text(("wer", *PLAIN), rows=[f"{'ab'[i % 2]},{','.join(map(str, r))}" for i, r in enumerate(TRUE)]),
        "sample is blank",
    ),
    "damaged.h5": (lambda: b"\x89HDF\r\n\x1a\n" + bytes(300), "HDF5"),
    "damaged.parquet": (lambda: b"PAR1" + bytes(99), "Parquet"),
    "damaged.ods": (lambda: ods({"a": FRAME})[:900], "damaged"),
}


def table_of(path):
    """The table, once the questions of the draft have been answered but for those about columns of the file."""
    found, joined = guess_file(path)
    text = draft(found, (), joined)
    for name, value in ANSWERS.items():
        if name != "elongation_mm":
            text = re.sub(rf"^  {name}:   # TODO.*", f"  {name}: {value}", text, flags=re.MULTILINE)
    return convert(recipe_of(text, "draft"), {path.name: path.read_bytes()}).table


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_there_are_forty():
    assert len(RIGHT) + len(REFUSED) >= 40


@pytest.mark.parametrize("name", RIGHT)
def test_messy_files_give_their_numbers(name, tmp_path):
    table = table_of(write(tmp_path / name, RIGHT[name]()))
    made = table[["elongation_mm", "pressure_kpa", "force_n"]].to_numpy()
    np.testing.assert_allclose(made, TRUE, rtol=1e-6, atol=1e-6)
    assert table["step"].tolist() == [0, 1, 2, 3] * 3


@pytest.mark.parametrize("name", REFUSED)
def test_messy_files_are_refused_in_a_sentence(name, tmp_path):
    make, says = REFUSED[name]
    with pytest.raises(UserError, match=says):
        table_of(write(tmp_path / name, make()))
