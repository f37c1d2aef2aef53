"""Some hundred messy files of one small experiment: each gives its numbers, or is refused in a sentence."""

import datetime
import decimal
import gzip
import io
import re
import zipfile

import numpy as np
import openpyxl
import pandas as pd
import pytest
from nightly import chosen
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
    filled(sheet)
    sheet.cell(4, 3).value = datetime.datetime(2026, 2, 25)


def merged_down(sheet, _):
    filled(sheet)
    sheet.merge_cells("A2:A5")


def merged_across(sheet, _):
    filled(sheet)
    sheet.merge_cells("A2:B2")


def names_over_units(sheet, _):
    """Names in one row, units in the next."""
    filled(sheet, ("mm", "kPa", "N"), start=2)
    for place, name in enumerate(("Weg", "Druck", "Kraft"), start=1):
        sheet.cell(1, place).value = name


def with_values(name, values):
    """A further column of such values."""

    def fill(sheet, _):
        filled(sheet)
        for row, value in enumerate([name, *map(values, range(len(TRUE)))], start=1):
            sheet.cell(row, 4).value = value

    return fill


def with_hidden_parts(sheet, _):
    """What a filter hides, and a note on a cell."""
    filled(sheet)
    sheet.row_dimensions[5].hidden = sheet.column_dimensions["B"].hidden = True
    sheet["C4"].comment = openpyxl.comments.Comment("Ventil klemmt", "ann")


def in_percent(sheet, _):
    filled(sheet, ("Dehnung [%]", *PLAIN[1:]))
    for row in range(2, 14):
        sheet.cell(row, 1).value /= 1.5


def one_heading_over_two(sheet, _):
    """Which of two columns the merged heading is about, nobody knows."""
    filled(sheet, ("Soll", "gemessen", "F"), start=2)
    sheet["A1"], sheet["C1"] = "Druck [kPa]", "Kraft [N]"
    sheet.merge_cells("A1:B1")


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


def with_units(file):
    """Names without units, which stand in an attribute of each."""
    for name, unit, values in zip(
        ("dl", "P", "F"), ("mm", np.bytes_("bar"), "N"), (TRUE * np.array(BAR)).T, strict=True
    ):
        file[f"run1/{name}"] = values
        file[f"run1/{name}"].attrs["units"] = unit


def parquet(frame):
    pytest.importorskip("pyarrow")
    out = io.BytesIO()
    frame.to_parquet(out)
    return out.getvalue()


def titled_ods():
    """A title and a blank line above the headings."""
    pytest.importorskip("odf")
    rows = [["Versuch 3", None, None], [None] * 3, list(GERMAN), *(TRUE * np.array(BAR)).tolist()]
    out = io.BytesIO()
    with pd.ExcelWriter(out, engine="odf") as writer:
        pd.DataFrame(rows).to_excel(writer, sheet_name="A", index=False, header=False)
    return out.getvalue()


def as_text_records(file):
    """Records with a word in each, and a note beside them."""
    kinds = [*((name, "f8") for name in PLAIN), ("who", "S2")]
    file["log"] = np.array([(*row, b"ok") for row in TRUE.tolist()], dtype=kinds)
    file["note"] = "rig 2"


def with_others(file):
    """MATLAB's columns beside a text, switches and a cell array, which refers to what lies elsewhere in the file."""
    import h5py

    as_matlab(file)
    for name, kind, values in (("note", "char", [[114], [105]]), ("open", "logical", np.ones((1, 12)))):
        file[name] = np.array(values, dtype="u2" if kind == "char" else "u1")
        file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    file["#refs#/a"] = np.array([[1.0]])
    cells = file.create_dataset("names", (1, 1), dtype=h5py.ref_dtype)
    cells[0, 0] = file["#refs#/a"].ref
    cells.attrs["MATLAB_class"] = np.bytes_("cell")


def deep(file):
    for name, values in zip(PLAIN, TRUE.T, strict=True):
        file[f"entry/data/{name}"] = values


def grouped_by(mark, decimal_mark="."):
    """Pressures in Pa, with such a mark between groups of digits."""
    lines = [
        ";".join(
            (
                f"{x}".replace(".", decimal_mark),
                f"{int(1000 * p):,}".replace(",", mark),
                f"{f}".replace(".", decimal_mark),
            )
        )
        for x, p, f in TRUE.tolist()
    ]
    return text(("dl_mm", "P_Pa", "F_N"), ";", rows=lines)


def stamped(stamp, *heading):
    """A time as somebody's program writes it in front of each row."""
    rows = [f"{stamp(i)};{';'.join(map(str, row))}" for i, row in enumerate(TRUE.tolist())]
    return text((*heading, *PLAIN), ";", rows=rows)


def two_clocks(separator=";", mark=",", change=lambda rig, cell: None):
    """What the rig set [s, mm, bar], beside the force by a clock of its own [ms, N] that runs on for three readings. In
    every row that the table has, both clocks read the same instant."""
    rig = {"Zeit [s]": np.arange(12.0), "Weg [mm]": TRUE[:, 0], "Druck [bar]": 0.01 * TRUE[:, 1]}
    cell = {"Zeit Kraft [ms]": 1000 * np.arange(15.0), "Kraft [N]": np.r_[TRUE[:, 2], 1, 2, 3]}
    rig, cell = ({name: values.tolist() for name, values in part.items()} for part in (rig, cell))
    change(rig, cell)
    columns = {
        name: [value if isinstance(value, str) else f"{value:.15g}".replace(".", mark) for value in values]
        for name, values in (rig | cell).items()
    }
    longest = max(map(len, columns.values()))
    rows = [[values[i] if i < len(values) else "" for values in columns.values()] for i in range(longest)]
    return text(tuple(columns), separator, rows=map(separator.join, rows))


def stamp_twice(_, cell):
    """One stamp a second time, with a force so that the mean of both is right."""
    cell["Zeit Kraft [ms]"].insert(13, 12000.0)
    cell["Kraft [N]"].insert(13, 5.0)


def blanks_in_the_rig(rig, _):
    """Rows without a stamp, as between the sheets of a copied log, and a line between two readings across them."""
    for values in rig.values():
        values[3:3] = ["", ""]


def swapped(rig, _):
    """Two rows in the wrong order."""
    for values in rig.values():
        values[4], values[5] = values[5], values[4]


def jumped(rig, _):
    rig["Zeit [s]"][6:] = [t + 1e6 for t in rig["Zeit [s]"][6:]]


def apart(rig, _):
    rig["Zeit [s]"] = [t + 500 for t in rig["Zeit [s]"]]


def a_word(rig, _):
    rig["Druck [bar]"][4] = "kaputt"


def a_worded_time(rig, _):
    rig["Zeit [s]"][4] = "kaputt"


def dated(rig, _):
    rig["Zeit [s]"] = [f"25.02.2026 10:00:{int(t):02d},000" for t in rig["Zeit [s]"]]


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
    "units as attributes.h5": lambda: hdf5(with_units),
    "table.parquet": lambda: parquet(FRAME),
    "iso stamps.csv": lambda: stamped(lambda i: f"2026-02-25T10:00:{i:02d}.125+01:00", "timestamp"),
    "dates and clocks.csv": lambda: stamped(lambda i: f"25.02.2026;10:00:{i:02d},5", "Datum", "Uhrzeit"),
    "minutes.csv": lambda: stamped(lambda i: f"00:{i:02d}.5", "time"),
    "quoted commas.csv": lambda: text(
        GERMAN, rows=[",".join(f'"{v * f:.4f}"'.replace(".", ",") for v, f in zip(r, BAR, strict=True)) for r in TRUE]
    ),
    "trailing commas.csv": lambda: text().replace("\n", ",,\n"),
    "some windows ends.csv": lambda: text().replace("\n", "\r\n", 5),
    "utf-16 little, no mark.csv": lambda: text(GERMAN, ";", ",", BAR).encode("utf-16-le"),
    "dutch.csv": lambda: text(("Verplaatsing [mm]", "Druk [kPa]", "Kracht [N]")),
    "polish.csv": lambda: text(("Wydłużenie [mm]", "Ciśnienie [kPa]", "Siła [N]"), ";", ","),
    "slashes.csv": lambda: text(("Weg / mm", "Druck / kPa", "Kraft / N")),
    "units after commas.csv": lambda: text(("Weg, mm", "Druck, kPa", "Kraft, N"), ";"),
    "kilogram-force.csv": lambda: text((*PLAIN[:2], "F [kgf]"), factors=(1, 1, 1 / 9.80665)),
    "labview.lvm": lambda: text(PLAIN, "\t", before="LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\n"),
    "excel names over units.xlsx": lambda: book(names_over_units),
    "excel clock.xlsx": lambda: book(with_values("Uhrzeit", lambda i: datetime.time(10, 0, i))),
    "excel durations.xlsx": lambda: book(with_values("t", lambda i: datetime.timedelta(seconds=i))),
    "excel hidden.xlsx": lambda: book(with_hidden_parts),
    "excel percent.xlsx": lambda: book(in_percent),
    "german.ods": lambda: ods({"Tab": pd.DataFrame(TRUE * np.array(BAR), columns=GERMAN)}),
    "title.ods": titled_ods,
    "dates.ods": lambda: ods({"A": FRAME.assign(Zeit=pd.date_range("2026-02-25", periods=12, freq="s"))}),
    "texts.ods": lambda: ods({"A": FRAME.astype(str)}),
    "commas.ods": lambda: ods({"A": FRAME.map(lambda v: f"{v:.2f}".replace(".", ","))}),
    "stamps.parquet": lambda: parquet(
        FRAME.assign(t=pd.date_range("2026-02-25", periods=12, freq="s", tz="Europe/Berlin"))
    ),
    "index.parquet": lambda: parquet(FRAME.set_index(pd.date_range("2026", periods=12, freq="s"))),
    "categories.parquet": lambda: parquet(FRAME.assign(who=pd.Categorical(["a"] * 12))),
    "decimals.parquet": lambda: parquet(FRAME.assign(F_N=[decimal.Decimal(f"{f:.2f}") for f in TRUE[:, 2]])),
    "whole numbers.parquet": lambda: parquet(FRAME.assign(P_kPa=FRAME["P_kPa"].astype("Int64"))),
    "lists.parquet": lambda: parquet(FRAME.assign(v=[[1, 2]] * 12)),
    "words.h5": lambda: hdf5(as_text_records),
    "others.mat": lambda: hdf5(with_others, 512),
    "rows.mat": lambda: mat(**{name: values[None, :] for name, values in zip(PLAIN, TRUE.T, strict=True)}),
    "singles.mat": lambda: mat(**{name: v.astype("f4") for name, v in zip(PLAIN, TRUE.T, strict=True)}),
    "two clocks.csv": lambda: two_clocks().encode("cp1252"),
    "two clocks.tsv": lambda: two_clocks("\t", "."),
    "two clocks, a stamp twice.csv": lambda: two_clocks(change=stamp_twice),
    "two clocks, blanks.csv": lambda: two_clocks(change=blanks_in_the_rig),
    "sheet.ods": lambda: ods({"Tabelle1": FRAME}),
    "form feeds.csv": lambda: text().replace("\n", "\n\f", 3),
    "fixed width.prn": lambda: FRAME.to_string(index=False),
    "singles.parquet": lambda: parquet(FRAME.astype("float32")),
    "sheets.ods": lambda: ods({"Notizen": pd.DataFrame({"Notiz": ["Ventil"]}), "Messung": FRAME}),
}
# What nobody can read without asking: file → what is said.
REFUSED = {
    "two clocks, rows swapped.csv": (lambda: two_clocks(change=swapped), "runs backwards.*put the rows in order"),
    "two clocks, one jumps.csv": (lambda: two_clocks(change=jumped), "jumps from 5 to .*correct the clock"),
    "two clocks apart.csv": (lambda: two_clocks(change=apart), "no time in common.*plus: or minus: seconds"),
    "two clocks, a word.csv": (lambda: two_clocks(change=a_word), "line 6 'kaputt' is not a number"),
    "two clocks, a worded time.csv": (lambda: two_clocks(change=a_worded_time), "line 6 'kaputt' is not a number"),
    "two clocks, dates.csv": (lambda: two_clocks(change=dated), "have no common start.*since 1970"),
    "unknown heading.csv": (lambda: text(("Wert A [mm]", *PLAIN[1:])), "elongation_mm is blank"),
    "two forces.csv": (
        lambda: text(("dl [mm]", "P [kPa]", "F1 [N]", "F2 [N]"), rows=[f"{x},{p},{f},{f + 1}" for x, p, f in TRUE]),
        "columns.force_n names no column",
    ),
    "two pressures.csv": (
        lambda: text(("dl [mm]", "P1 [kPa]", "P2 [kPa]", "F [N]"), rows=[f"{x},{p},{p + x},{f}" for x, p, f in TRUE]),
        r"members\[2\].gamma_deg is blank",
    ),
    "finnish.csv": (lambda: text(("Siirtymä [mm]", "Paine [kPa]", "Voima [N]")), "elongation_mm is blank"),
    "over range.csv": (lambda: lines(n4="0,150,OVLD"), "'OVLD' is not a number"),
    "plus and minus.csv": (lambda: text(rows=[f"{x},{p},{f}±0.1" for x, p, f in TRUE]), "force_n is blank"),
    "lines.json": (lambda: FRAME.to_json(orient="records", lines=True), "stray quote"),
    "markdown.txt": (
        lambda: text(separator=" | ").replace("\n", "\n---|---|---\n", 1),
        "is blank|not a number|values for",
    ),
    "texts.h5": (
        lambda: hdf5(lambda file: file.create_dataset("F_N", data=TRUE[:, 2].astype("S"))),
        "holds no numeric arrays",
    ),
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
    "swiss thousands.csv": (lambda: grouped_by("'"), "thousands|not a number"),
    "german thousands.csv": (lambda: grouped_by(".", ","), "thousands|not a number"),
    "narrow spaces.csv": (lambda: grouped_by("\u202f"), "thousands|not a number"),
    "gap.parquet": (
        lambda: parquet(FRAME.assign(P_kPa=FRAME["P_kPa"].where(FRAME.index != 3))),
        "pressure_kpa is blank",
    ),
    "gap.mat": (
        lambda: mat(dl_mm=TRUE[:, 0], P_kPa=np.where(np.arange(12) == 3, np.nan, TRUE[:, 1]), F_N=TRUE[:, 2]),
        "pressure_kpa is blank",
    ),
    "russian.csv": (
        lambda: text(("Удлинение, мм", "Давление, кПа", "Сила, Н"), ";").encode("cp1251"),
        "pressure_kpa is blank",
    ),
    "chinese.csv": (lambda: text(("位移(mm)", "压力(kPa)", "力(N)")).encode("gb18030"), "elongation_mm is blank"),
    "korean.csv": (lambda: text(("변위(mm)", "압력(kPa)", "힘(N)")).encode("euc-kr"), "elongation_mm is blank"),
    "remark without heading.csv": (lambda: lines(n5=text().splitlines()[5] + ",valve stuck"), "4 values for 3 columns"),
    "in rows.csv": (
        lambda: "".join(f"{n},{','.join(map(str, v))}\n" for n, v in zip(PLAIN, TRUE.T, strict=True)),
        "transpose it",
    ),
    "excel heading over two.xlsx": (lambda: book(one_heading_over_two), "pressure_kpa is blank"),
    "matrix.h5": (lambda: hdf5(lambda file: file.create_dataset("data", data=TRUE)), "pressure_kpa is blank"),
    "no units.h5": (
        lambda: hdf5(
            lambda file: [file.create_dataset(n, data=v) for n, v in zip(("dl", "P", "F"), TRUE.T, strict=True)]
        ),
        "has no unit",
    ),
    "deep.h5": (lambda: hdf5(deep), "holds no numeric arrays"),
    "complex.mat": (lambda: mat(dl_mm=TRUE[:, 0], P_kPa=TRUE[:, 1], F_N=TRUE[:, 2] + 1j), "complex"),
    "three dimensions.mat": (lambda: mat(data=np.dstack([TRUE, TRUE])), "3 dimensions"),
    "packed.csv.gz": (lambda: gzip.compress(text().encode()), "unpack it first"),
    "packed.zip": (lambda: zipped(text()), "unpack it"),
    "page.xls": (lambda: "<html><table><tr><td>1</td></tr></table></html>", "web page"),
    "header alone.csv": (lambda: ",".join(PLAIN) + "\n", "holds no rows"),
    "nul.csv": (lambda: text().encode().replace(b"50", b"5\x00", 1), "binary file"),
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


def zipped(content):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("a.csv", content)
    return out.getvalue()


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_there_are_a_hundred():
    assert len(RIGHT) + len(REFUSED) >= 100


@pytest.mark.parametrize("name", chosen(list(RIGHT), 45))
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
