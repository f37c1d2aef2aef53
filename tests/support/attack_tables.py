"""The table zoo: kinds of bad, odd and good tables, each made of a good one by a small change, and what it is answered.

Refused: one UserError in which a word stands. Warned of: read, with a warning in which a word stands. Accepted: read
without a word about the change, its values those of the good table where the change is none of the values'.
"""

from __future__ import annotations

import csv
import gzip
import io
import pickle
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import NMM
from freelearn.data.states import States
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.small_tables import random_table

REFUSE, WARN, ACCEPT = "refuse", "warn", "accept"
Cells = list[list[str]]


@dataclass(frozen=True)
class Kind:
    """made: the file's bytes. says: stands in the answer. same: whether the values read are the good table's. fits:
    whether train and discover can do something with it; else they too give one clear error."""

    name: str
    made: Callable[[], bytes]
    answer: str
    says: str = ""
    same: bool = False
    fits: bool = True


@lru_cache(1)
def good_table() -> pd.DataFrame:
    """Two actuators, four states each, ten pressures up and down, loads of a continuum model with noise."""
    table = random_table(60, 4).sort_values("sample", kind="stable")
    table = pd.concat([table[table["sample"] == n].head(4) for n in (3, 6)])
    table = table.loc[np.repeat(table.index, 10)].reset_index(drop=True)
    table["step"] = np.arange(len(table)) % 10
    table["pressure_kpa"] = np.array([0, 10, 20, 30, 40, 50, 60, 70, 35, 1.0])[table["step"]]
    with torch.no_grad():
        loads = Continuum(1e6, 2e7)(States.from_table(table)).loads.numpy()
    loads = loads * (1 + 0.02 * np.random.default_rng(0).normal(size=loads.shape))
    table["force_n"], table["moment_nmm"] = loads[:, 0], loads[:, 1] / NMM
    return table.round({"elongation_mm": 3, "twist_deg": 2, "force_n": 4, "moment_nmm": 3})


HEADER = list(good_table().columns)
# A cell whose number is known, for other ways of writing it.
LINE, COLUMN, NUMBER = 5, "pressure_kpa", "30.0"


def cells() -> Cells:
    """The good table's cells, the header first: line n is cells()[n - 1]."""
    return list(csv.reader(io.StringIO(good_table().to_csv(index=False))))


def written(of: Cells, end: str = "\r\n", quoting: int = csv.QUOTE_MINIMAL, separator: str = ",") -> bytes:
    """Cells as a file."""
    text = io.StringIO()
    csv.writer(text, lineterminator=end, quoting=quoting, delimiter=separator).writerows(of)
    return text.getvalue().encode()


def good() -> bytes:
    """The good table's file."""
    return written(cells())


def with_cell(line: int, column: str, text: str) -> bytes:
    """The good table with another text in one cell."""
    changed = cells()
    changed[line - 1][HEADER.index(column)] = text
    return written(changed)


def with_raw(text: str) -> bytes:
    """The good table with this written for the known number, unquoted."""
    lines = good().decode().split("\r\n")
    row = lines[LINE - 1].split(",")
    assert row[HEADER.index(COLUMN)] == NUMBER
    row[HEADER.index(COLUMN)] = text
    lines[LINE - 1] = ",".join(row)
    return "\r\n".join(lines).encode()


def table(**columns: object) -> bytes:
    """The good table with columns set, or made of the table by a function."""
    return good_table().assign(**columns).to_csv(index=False).encode()


def text(change: Callable[[str], str]) -> bytes:
    """The good table's text, changed."""
    return change(good().decode()).encode()


def header(old: str, new: str) -> bytes:
    """The good table with another name of a column."""
    return good_table().rename(columns={old: new}).to_csv(index=False).encode()


def line(at: int, new: str | None) -> bytes:
    """The good table with another line, or without it."""
    lines = good().decode().split("\r\n")
    lines[at - 1 : at] = [] if new is None else [new]
    return "\r\n".join(lines).encode()


ZOO: dict[str, Kind] = {}


def add(
    name: str, answer: str, says: str, made: Callable[[], bytes], same: bool | None = None, fits: bool = True
) -> None:
    """Puts a kind into the zoo. same: by default of what is accepted."""
    assert name not in ZOO, name
    ZOO[name] = Kind(name, made, answer, says, answer == ACCEPT if same is None else same, fits)


def refuse(name: str, says: str, made: Callable[[], bytes]) -> None:
    """Puts a kind into the zoo that is refused."""
    add(name, REFUSE, says, made)


# --- cells that are no numbers ---------------------------------------------------------------------------------------

NO_NUMBERS = {
    **dict.fromkeys(["1_000", "1e5_0", "3_0.0"], "without _"),
    **dict.fromkeys(["３０", "٣٠", "३०"], "is not a number"),
    **dict.fromkeys(
        ["0x10", "0b11", "0o17", "1e", "e5", "--5", "+-5", "1.2.3", "1e5.2", "5 5", "."], "is not a number"
    ),
    **dict.fromkeys(["inf", "-Infinity", "infinity", "nan", "NaN", "+nan", "∞", "NA", "n/a", "null", "None"], "finite"),
    "1e999": "larger than a computer holds",
    "9" * 400: "larger than a computer holds",
    **{"1,5": "decimal comma: write 1.5", "-0,25": "write -0.25", "1,234": "write 1.234 or 1234"},
    **dict.fromkeys(["1,234.5", "1.234,5", "1 234", "1\u00a0234", "1\u2009234", "1\u202f234", "1'234"], "thousands"),
    **dict.fromkeys(["=1+1", "=A1", "@SUM(A1)", "=cmd|' /C calc'!A0"], "it is a formula"),
    **dict.fromkeys(["#DIV/0!", "#N/A", "#REF!", "#VALUE!", "#NUM!", "#NAME?", "#NULL!", "#####"], "spreadsheet shows"),
    **dict.fromkeys(["5%", "5 %"], "percent sign"),
    **dict.fromkeys(["5 N", "5N", "5 kPa", "72.5kPa"], "without a unit"),
    **dict.fromkeys(["\u22125", "\u20135.5", "\u20145"], "dash for a minus sign"),
    **dict.fromkeys(["1.5\u200b", "1\ufeff", "3\u00ad0"], "not seen"),
    **dict.fromkeys(
        ["true", "TRUE", "yes", "x", "'1.5", "25.02.2026", "12:30", "(5)", "<0.1", "~5", "1/2", "½"], "number"
    ),
    **dict.fromkeys(["+1+1", "-", "--", "?", "\x1b[31m5", "<b>1</b>", "<script>1</script>", "${1}", "5;6"], "number"),
    **dict.fromkeys(
        ["__import__('os').system('true')", "!!python/object:os.system", "1e5j", "1d5", "٫5", "💧"], "number"
    ),
    " ": "is blank",
    "": "is blank",
    '30"': "is not a number",
    "a" * 100_000: "is not a number",
}
for cell, word in NO_NUMBERS.items():
    refuse(f"cell {cell[:20]!r}", word, lambda cell=cell: with_cell(LINE, COLUMN, cell))

# --- other ways to write the same number -----------------------------------------------------------------------------

for cell in (
    "30",
    "+30.0",
    "030.0",
    "3e1",
    "3.0E+01",
    "300e-1",
    "30.",
    " 30.0",
    "30.0  ",
    "\t30.0",
    "\u00a030.0\u2009",
):
    add(f"number {cell!r}", ACCEPT, "", lambda cell=cell: with_raw(cell))
add("number in quotes", ACCEPT, "", lambda: with_raw('"30.0"'))
add("number of 5000 digits", ACCEPT, "", lambda: with_raw("30." + "0" * 5000))
add("numbers that need no point", ACCEPT, "", lambda: table(sample=lambda t: t["sample"].map("{}.0".format)))

# --- values that no bed can have -------------------------------------------------------------------------------------

BEYOND = {
    "gamma_deg": ("1e-9", "1e160", "90", "-91", "0"),
    "length_mm": ("1e9", "1e-9", "-98", "0"),
    "inner_radius_mm": ("1e9", "1e-300", "-4", "0"),
    "outer_radius_mm": ("1e160", "4.77", "4.7700000001", "1"),
    "elongation_mm": ("1e160", "-1e9", "-98.42", "-500", "1e6"),
    "twist_deg": ("1e9", "-1e300"),
    "pressure_kpa": ("1e160", "1e8", "-102", "-1e160"),
    "force_n": ("1e160", "-1e300", "1e10"),
    "moment_nmm": ("1e160", "-1e13"),
    "sample": ("0", "-3", "1.5", "1e300", "1e10"),
    "step": ("-1", "0.5", "1e300"),
    "buckled": ("2", "-1", "0.5"),
}
for name, values in BEYOND.items():
    for value in values:
        refuse(f"{name} {value}", f"line {LINE}, {name}", lambda n=name, v=value: with_cell(LINE, n, v))
for name, low, high in (("force_n", 1e-300, 1e160), ("moment_nmm", 1e-300, 1e300)):
    refuse(f"all {name} tiny", "the largest is below", lambda n=name, f=low: table(**{n: good_table()[n] * f}))
    refuse(f"all {name} huge", "no bed measures", lambda n=name, f=high: table(**{n: good_table()[n] * f}))
refuse("all loads denormal", "the largest is below", lambda: table(force_n=5e-324, moment_nmm=-5e-324))
refuse(
    "all loads 1e160 and 1e-300",
    "no bed measures",
    lambda: table(force_n=good_table()["force_n"] * 1e160, moment_nmm=good_table()["moment_nmm"] * 1e-300),
)
refuse("all pressures 1e200", "no wall holds", lambda: table(pressure_kpa=good_table()["pressure_kpa"] * 1e200))
refuse("every length tiny", "no tube is so short", lambda: table(length_mm=1e-200, elongation_mm=0))
refuse("time beyond", "no test lasts", lambda: table(time_s=1e200))
refuse("time blank", "is blank", lambda: table(time_s=["", *range(79)]))
refuse("temperature beyond", "no actuator bears", lambda: table(temperature_c=1e9))
refuse("colder than nothing", "absolute zero", lambda: table(temperature_c=-300))
refuse("a second family at 0°", "gamma2_deg", lambda: table(gamma2_deg=0))
add("one load denormal", ACCEPT, "", lambda: with_cell(LINE, "force_n", "5e-324"), same=False)
add("one load below what floats hold", ACCEPT, "", lambda: with_cell(LINE, "force_n", "1e-400"), same=False)

# --- another unit, another sign, another order -----------------------------------------------------------------------


def scaled(**factors: float) -> Callable[[], bytes]:
    """The good table with columns times a factor."""
    return lambda: table(**{name: good_table()[name] * factor for name, factor in factors.items()})


def in_time(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[], bytes]:
    """The good table with a column of time, changed."""
    return lambda: table(time_s=change(20.0 * np.arange(len(good_table()))))


def slipped(column: str, factor: float, *places: int) -> Callable[[], bytes]:
    """The good table with readings of some rows times a factor."""

    def made() -> bytes:
        values = good_table()[column].copy()
        values.iloc[list(places)] *= factor
        return table(**{column: values})

    return made


UNITS = {
    "length in m": ("looks like meters", {"length_mm": 1e-3, "elongation_mm": 1e-3}),
    "length in cm": ("inches or centimeters", {"length_mm": 0.1, "elongation_mm": 0.1}),
    "radii in m": ("looks like meters", {"inner_radius_mm": 1e-3, "outer_radius_mm": 1e-3}),
    "radii in inches": ("may be in inches", {"inner_radius_mm": 1 / 25.4, "outer_radius_mm": 1 / 25.4}),
    "elongation in m": ("elongation_mm may be in meters", {"elongation_mm": 1e-3}),
    "fiber angle in rad": ("gamma_deg looks like radians", {"gamma_deg": np.pi / 180}),
    "twist in rad": ("twist_deg may be in radians", {"twist_deg": np.pi / 180}),
    "pressure in Pa": ("looks like pascals", {"pressure_kpa": 1e3}),
    "pressure in bar": ("may be in bar", {"pressure_kpa": 0.01}),
    "pressure in psi": ("may be in psi", {"pressure_kpa": 1 / 6.894757}),
    "force in kN": ("may be in kN", {"force_n": 1e-3}),
    "force in MN": ("may be in kN", {"force_n": 1e-6}),
    "force in mN": ("may be in mN", {"force_n": 1e3}),
    "moment in N·m": ("may be in N·m", {"moment_nmm": 1e-3}),
}
for name, (word, factors) in UNITS.items():
    # Sizes that no model answers at end in one clear error instead.
    add(
        name,
        WARN,
        word,
        scaled(**factors),
        fits=name not in ("length in m", "length in cm", "radii in m", "force in mN"),
    )
add("both loads in k", WARN, "force_n may be in kN", scaled(force_n=1e-3, moment_nmm=1e-3))
add("absolute pressure", WARN, "may be absolute", lambda: table(pressure_kpa=good_table()["pressure_kpa"] + 101.3))
for constant in (0, 1, 7):
    add(f"step always {constant}", WARN, f"step is {constant} in every row", lambda c=constant: table(step=c))
add("step never changes at a place", WARN, "step never changes", lambda: table(step=np.repeat(np.arange(8), 10)))
add("time runs backwards", WARN, "runs backwards at line 3 (78 times", in_time(lambda t: t[::-1]))
add("time begins anew", WARN, "runs backwards at line 22 (1 times", in_time(lambda t: t - 1000 * (t >= 400)))
add("one time slipped", WARN, "runs backwards at line 12", in_time(lambda t: np.where(np.arange(len(t)) == 10, 0, t)))
for load in ("force_n", "moment_nmm"):
    for factor in (1e6, -1e6, 1e4):
        add(f"{load} once {factor:g} times", WARN, f"{load} on line 9 is up to", slipped(load, factor, 7))
add("force twice 1e6 times", WARN, "force_n on line 9, line 52 is up to", slipped("force_n", 1e6, 7, 50))
add("pressure once 1e5 times", WARN, "pressure_kpa on line 9 is up to", slipped("pressure_kpa", 1e5, 7))
add("no forces", WARN, "has no force_n", lambda: good_table().drop(columns="force_n").to_csv(index=False).encode())
add(
    "no moments",
    WARN,
    "has no moment_nmm",
    lambda: good_table().drop(columns="moment_nmm").to_csv(index=False).encode(),
)
add("nearly time_s", WARN, "'times_s'", lambda: table(times_s=1))
add("nearly temperature_c", WARN, "'temperature_C'", lambda: table(temperature_C=21))

# --- columns and header ----------------------------------------------------------------------------------------------

for name in HEADER:
    if name not in ("force_n", "moment_nmm"):
        missing = lambda n=name: good_table().drop(columns=n).to_csv(index=False).encode()  # noqa: E731
        refuse(f"without {name}", f"{name}: column is missing", missing)
    refuse(f"{name} twice", "appears 2 times", lambda n=name: written([[*r, r[HEADER.index(n)]] for r in cells()]))
for name in ("force_n", "pressure_kpa", "sample"):
    refuse(f"{name} in capitals", "rename", lambda n=name: header(n, n.upper()))
    refuse(f"{name} misspelled", "rename", lambda n=name: header(n, n.replace("e", "ee")))
    refuse(f"{name} with a space without width", "rename", lambda n=name: header(n, n + "\u200b"))
refuse(
    "no loads at all",
    "missing",
    lambda: good_table().drop(columns=["force_n", "moment_nmm"]).to_csv(index=False).encode(),
)
refuse("units in the header", "rename", lambda: header("force_n", "force [N]"))
refuse(
    "a nameless column", "has no name", lambda: written([[*r, "1"] if i else [*r, ""] for i, r in enumerate(cells())])
)
refuse("blank columns behind", "has no name", lambda: written([[*r, "", "", ""] for r in cells()]))
refuse(
    "commas behind the rows",
    "15 values for 12",
    lambda: written([[*r, "", "", ""] if i else r for i, r in enumerate(cells())]),
)
refuse("a row of units", "is not a number", lambda: line(1, ",".join(HEADER) + "\r\n" + ",".join(["-"] * 12)))
refuse("a title above", "missing", lambda: line(1, "Bed 3" + "," * 11 + "\r\n" + ",".join(HEADER)))
refuse("no header", "no header", lambda: line(1, None))
refuse("header twice", "is not a number", lambda: line(30, ",".join(HEADER)))
refuse("only a header", "holds no rows", lambda: (",".join(HEADER) + "\n").encode())
refuse("quantities in rows", "column appears", lambda: written([list(r) for r in zip(*cells(), strict=True)]))
refuse("20,000 columns", "more than any table", lambda: written([[*r, *["1"] * 20_000] for r in cells()]))
refuse("another bed's", "says that its bed is 'isometric'", lambda: table(bed="isometric"))
add("columns in another order", ACCEPT, "", lambda: good_table()[HEADER[::-1]].to_csv(index=False).encode())
add("spaces in the header", ACCEPT, "", lambda: written([[f"  {c} " for c in r] for r in cells()]))
add("a note", ACCEPT, "", lambda: table(note='<img src=x onerror=alert(1)>, "=1+1"\n\u2028 ünï'))
add("a column of formulas", ACCEPT, "", lambda: table(remark='=HYPERLINK("http://x")'))
add(
    "300 more columns",
    ACCEPT,
    "",
    lambda: written([[*r, *[f"c{k}" if i == 0 else "0.5" for k in range(300)]] for i, r in enumerate(cells())]),
)
add("a column named like a method", ACCEPT, "", lambda: table(index=1, values="x", __class__="y", T=3))
add("temperature", ACCEPT, "", lambda: table(temperature_c=21.5))
add("time", ACCEPT, "", in_time(lambda t: t))
add("time of the clock", ACCEPT, "", in_time(lambda t: t + 1.7e9))
add("time from below zero", ACCEPT, "", in_time(lambda t: t - 1e4))
add("a second family", ACCEPT, "", lambda: table(gamma2_deg=-good_table()["gamma_deg"]))
add("marks of rows left out", ACCEPT, "", lambda: table(left_out=["1", "", " ", "0", "1.0", *[""] * 75]))

# --- rows ------------------------------------------------------------------------------------------------------------

refuse("a row twice", "duplicate of line 7", lambda: good() + good().split(b"\r\n")[6] + b"\r\n")
refuse("the table twice", "is not a number", lambda: good() + good())
refuse("a row cut off", "values for 12 columns", lambda: good()[:-25])
refuse("a value too many", "13 values for 12", lambda: line(LINE, good().decode().split("\r\n")[LINE - 1] + ",1"))
refuse("a decimal comma unquoted", "13 values for 12", lambda: with_raw("30,0"))
refuse("rows of commas below", "blank but for its commas", lambda: good() + b",,,,,,,,,,,\r\n" * 3)
refuse("sums below", "is blank", lambda: good() + b"Sum,,,,,,,,,1.5,2.5,\r\n")
refuse("a remark below", "values for 12", lambda: good() + b"measured by Ann\r\n")
refuse("a comment", "values for 12", lambda: line(LINE, "# pump changed"))
refuse("merge marks", "values for 12", lambda: line(LINE, "<<<<<<< HEAD"))
refuse("all buckled", "buckled", lambda: table(buckled=1))
refuse("all left out", "left out", lambda: table(left_out=1))
refuse("nothing measured", "no reading", lambda: table(force_n="", moment_nmm=""))
refuse("one design differs", "differs from", lambda: with_cell(LINE, "gamma_deg", "41"))
refuse("radii swapped", "above inner", lambda: table(inner_radius_mm=7, outer_radius_mm=5))
refuse("buckled blank", "is blank", lambda: with_cell(LINE, "buckled", ""))
add("blank lines between", ACCEPT, "", lambda: text(lambda t: t.replace("\r\n", "\r\n\r\n")))
add("blank lines before and behind", ACCEPT, "", lambda: b"\r\n\n" + good() + b"\r\n\r\n\n")
add("no end of the last line", ACCEPT, "", lambda: good().rstrip())
add(
    "some forces blank",
    ACCEPT,
    "",
    lambda: table(force_n=good_table()["force_n"].where(np.arange(80) % 3 > 0)),
    same=False,
)
add("all forces blank", ACCEPT, "", lambda: table(force_n=""), same=False)
add("slack rows", ACCEPT, "", lambda: table(slack=(good_table()["force_n"] > 3).astype(int)))
add("every load zero", ACCEPT, "", lambda: table(force_n=0, moment_nmm=0), same=False, fits=False)
add("forces zero", ACCEPT, "", lambda: table(force_n=0), same=False, fits=False)
add("all loads the same", ACCEPT, "", lambda: table(force_n=2.5, moment_nmm=-3), same=False, fits=False)
add("pressure zero throughout", ACCEPT, "", lambda: table(pressure_kpa=0), same=False, fits=False)
add(
    "loads below any noise",
    ACCEPT,
    "",
    lambda: table(force_n=good_table()["force_n"] * 1e-2, moment_nmm=0),
    same=False,
    fits=False,
)
add("one place", ACCEPT, "", lambda: table(elongation_mm=0, twist_deg=0, step=np.arange(80)), same=False, fits=False)
for rows in (1, 3, 4, 5, 10):
    few = lambda n=rows: good_table().head(n).to_csv(index=False).encode()  # noqa: E731
    add(f"{rows} rows", ACCEPT, "", few, same=False, fits=False)
add("one sample", ACCEPT, "", lambda: good_table().head(40).to_csv(index=False).encode(), same=False)
add("rows backwards", ACCEPT, "", lambda: good_table().iloc[::-1].to_csv(index=False).encode(), same=False, fits=False)
add("steps with gaps", ACCEPT, "", lambda: table(step=3 * good_table()["step"]), same=False)
add("large sample numbers", ACCEPT, "", lambda: table(sample=good_table()["sample"] + 999_999_000), same=False)
add(
    "fibers wound the other way",
    ACCEPT,
    "",
    lambda: table(
        gamma_deg=-good_table()["gamma_deg"],
        twist_deg=-good_table()["twist_deg"],
        moment_nmm=-good_table()["moment_nmm"],
    ),
    same=False,
)
add("forces all large", WARN, "may be in mN", scaled(force_n=1e7, moment_nmm=1e7), fits=False)

# --- files and their encodings ---------------------------------------------------------------------------------------

BOM = b"\xef\xbb\xbf"
for count in (1, 2, 3):
    add(f"{count} marks of byte order", ACCEPT, "", lambda n=count: BOM * n + good())
add("a mark of byte order and a blank line", ACCEPT, "", lambda: BOM + b"\r\n" + good())
add("a mark before quoted cells", ACCEPT, "", lambda: BOM + written(cells(), quoting=csv.QUOTE_ALL))
refuse("a mark inside", "not seen", lambda: text(lambda t: t.replace("\r\n3,", "\r\n\ufeff3,", 1)))
for end, name in (("\n", "Unix"), ("\r", "an old Macintosh"), ("\r\r\n", "an editor's mistake")):
    add(f"line ends of {name}", ACCEPT, "", lambda e=end: written(cells(), end=e))
add("mixed line ends", ACCEPT, "", lambda: good().replace(b"\r\n", b"\n", 7))
add("everything quoted", ACCEPT, "", lambda: written(cells(), quoting=csv.QUOTE_ALL))
add("Excel's line for commas", ACCEPT, "", lambda: b"sep=,\r\n" + good())
add("Excel's line after a mark", ACCEPT, "", lambda: BOM + b"sep=,\r\n" + good())
refuse("Excel's line for semicolons", "semicolons", lambda: b"sep=;\r\n" + written(cells(), separator=";"))
refuse("Excel's line for tabs", "tabs", lambda: b"sep=\t\r\n" + written(cells(), separator="\t"))
refuse("only Excel's line", "holds no rows", lambda: b"sep=,\r\n")
refuse("semicolons", "semicolons", lambda: written(cells(), separator=";"))
refuse(
    "semicolons and decimal commas",
    "semicolons",
    lambda: good_table().to_csv(index=False, sep=";", decimal=",").encode(),
)
refuse("tabs", "tabs", lambda: written(cells(), separator="\t"))
refuse("bars", "bars", lambda: written(cells(), separator="|"))
refuse("spaces", "spaces", lambda: written(cells(), separator=" "))
refuse("a stray quote", "stray quote", lambda: good() + b'4,"40')
refuse("a quote within", "stray quote", lambda: with_raw('"30".0'))
for code in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-be"):
    refuse(code, "UTF-8", lambda c=code: good().decode().encode(c))
refuse(
    "UTF-16 as spreadsheets save it",
    "UTF-16",
    lambda: b"\xff\xfe" + written(cells(), separator="\t").decode().encode("utf-16-le"),
)
refuse(
    "Latin 1",
    "not UTF-8 text (line 2)",
    lambda: good_table().assign(note="Prüfstand").to_csv(index=False).encode("latin-1"),
)
refuse("a broken character", "not UTF-8 text (line 5)", lambda: good().replace(b"30.0", b"3\xff0", 1))
refuse("half a surrogate", "not UTF-8", lambda: good().replace(b"30.0", b"\xed\xa0\x80", 1))
refuse("a NUL", "line 5 holds a NUL", lambda: good().replace(b"30.0", b"3\x000", 1))
refuse("NULs behind", "NUL", lambda: good() + b"\0" * 512)
refuse("an end of file of DOS", "values for 12", lambda: good() + b"\x1a")
refuse("empty", "is empty", lambda: b"")
refuse("blank", "is empty", lambda: b" \r\n\t\n")
refuse("only a mark of byte order", "is empty", lambda: BOM * 2)
refuse("gzip", "not UTF-8", lambda: gzip.compress(good(), mtime=0))
refuse("PDF", "", lambda: b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n" + b"\0" * 99)
refuse("PNG", "not UTF-8", lambda: b"\x89PNG\r\n\x1a\n" + b"\0" * 99)
refuse("pickle", "", lambda: pickle.dumps(print))
refuse("HTML", "missing", lambda: b"<html><table><tr><td>1</td></tr></table></html>\n" * 3)
refuse("JSON", "", lambda: b'[{"sample": 1, "force_n": 2}]')
refuse("YAML", "", lambda: b"!!python/object/apply:os.system ['true']\nsample: 1\n")
refuse("a word", "holds no rows", lambda: b"sample")


def _workbook() -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("xl/workbook.xml", "<x/>")
    return content.getvalue()


refuse("a workbook", "", _workbook)
refuse("one endless line", "", lambda: b"1" * 1_000_000)
refuse("one endless cell in quotes", "not valid CSV", lambda: b'"' + good() * 30)
refuse("a million commas", "more than any table", lambda: b"," * 1_000_000 + b"\n1\n")
refuse("twenty thousand short rows", "has 20000 faults", lambda: good() + b"1\r\n" * 20_000)
KINDS = list(ZOO.values())
