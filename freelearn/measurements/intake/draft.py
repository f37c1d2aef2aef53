"""A recipe to edit, from the guess at a file."""

from __future__ import annotations

import json
from collections.abc import Sequence

from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.guess import HELD, ColumnGuess, Guess
from freelearn.measurements.intake.headings import INNER_DIAMETER
from freelearn.measurements.intake.joined import DesignGuess
from freelearn.measurements.intake.languages import plain
from freelearn.measurements.intake.recipe import DESIGN, FURTHER, MARKS, READINGS
from freelearn.measurements.intake.units import unit_of

# Units as names of columns write them → as people do.
SPELLED = {"n": "N", "pa": "Pa", "kpa": "kPa", "nmm": "N·mm", "nm": "N·m"}
CONSTANTS = {
    "gamma_deg": "fiber angle to the axis",
    "length_mm": "unloaded length",
    "inner_radius_mm": "unloaded inner radius",
    "outer_radius_mm": "unloaded outer radius",
}
STEPS = "step: derive   # 0, 1, … in consecutive rows of one state"
# A muscle or a braid has two families of fibers.
SECOND = "  # gamma2_deg: …   # a braid (McKibben, Festo) has a second family: minus the first angle"
# A strain beyond it, without a unit, may be one in percent.
LARGEST_STRAIN = 1.5
CONTRACTIONS = ("contract", "kontrakt", "verkurz", "verkuerz", "stauch", "contraz", "contrac", "収縮")


def draft(found: Guess, files: Sequence[str] = (), joined: DesignGuess | None = None) -> str:
    """The recipe's text. files: names, where the data are a folder of such files. joined: designs that stand elsewhere.
    What the guess could not know is left blank and marked TODO."""
    bed = BEDS[found.bed]
    lines = [
        f"# How {found.name} becomes a measurement table: a guess. Check every line, then run intake with this recipe.",
        f"bed: {found.bed}   # {', '.join(BEDS)}",
    ]
    lines += [f"read: {{sheet: {quoted(found.sheet)}}}"] if found.sheet else []
    lines += _design(joined) if joined else _sample(found, files)
    given = quantities_given(found)
    said = {*given, *(joined.columns if joined else ())}
    design = {name: about for name, about in CONSTANTS.items() if name not in said}
    several = len(found.samples) > 1 and not files and "length_mm" in design and not joined
    shared = {n: a for n, a in design.items() if not (found.pressures and n == "gamma_deg")}
    if several:
        lines += ["samples:   # what differs from actuator to actuator; or a file of designs: intake … design=FILE"]
        lines += [f"  {i}: {{length_mm: }}   # TODO: unloaded length of {w}" for i, w in sample_keys(found)]
        del shared["length_mm"]
    imposed = [
        q.column for q in bed.imposed if q.column not in given and not (found.pressures and q.column == "pressure_kpa")
    ]
    lines.append("constants:" if shared or imposed else "constants: {}")
    same = "; if it differs, under samples" if several else ""
    for name, about in shared.items():
        lines.append(f"  {name}:   # TODO: {about}{same}")
    lines += [SECOND] if "gamma2_deg" not in said and not found.pressures and (shared or imposed) else []
    lines += [f"  {name}:   # TODO: no column says it; 0 if it was held at 0" for name in imposed]
    lines.append("columns:")
    for name, column in given.items():
        lines += _column(name, column)
    if not given:
        lines[-1] = "columns: {}   # TODO: {force_n: {from: …, unit: N}, …}"
    if found.pressures:
        lines.append("members:")
        for column in (c for c in found.columns if c.name in found.pressures):
            lines.append(f"  - pressure: {{from: {quoted(column.name)}, unit: {quoted(column.unit)}}}")
            about = f"fiber angle of the actuator at {column.name}, negative for the other sense of winding"
            lines.append(f"    gamma_deg:   # TODO: {about}")
            lines.append("    # gamma2_deg: …   # of a braid: minus the first angle")
    if found.order_by:
        names = ", ".join(map(quoted, found.order_by))
        lines.append(f"order_by: [{names}]   # the rows are sorted by pressure: this puts each state's together")
    step = found.of("step")
    lines.append(f"step: {{from: {quoted(step.name)}}}   # or: derive" if step else STEPS)
    lines += [f"{mark}: {{{quoted(marked.name)}: 1}}" for mark in MARKS if (marked := found.of(mark))]
    unused = [c.name for c in found.columns if not c.chosen]
    if unused:
        lines.append(f"# Not used: {', '.join(map(quoted, unused))}.")
    return "\n".join(lines) + "\n"


def _design(joined: DesignGuess) -> list[str]:
    """Whose rows they are, and where their designs stand."""
    where = f"file: {quoted(joined.file)}" if joined.file else f"sheet: {quoted(joined.sheet)}"
    lines = [f"sample: {{from: {quoted(joined.sample)}}}", "design:", f"  {where}", f"  by: {quoted(joined.by)}"]
    lines.append("  columns:")
    for name, (column, factor) in joined.columns.items():
        unit = quoted(SPELLED.get(column.unit, column.unit)) if column.unit else ""
        scale = "" if factor == 1 else f", scale: {factor:g}"
        remark = "" if column.unit else f"   # TODO: its unit (the table's is {unit_of(name)})"
        lines.append(f"    {name}: {{from: {quoted(column.name)}, unit: {unit}{scale}}}{remark}")
    return lines


def sample_keys(found: Guess) -> list[tuple[int, str]]:
    """The number and the word of each actuator; words that are numbers keep them."""
    if numbered(found):
        return sorted((int(float(word)), word) for word in found.samples)
    return list(enumerate(found.samples, start=1))


def numbered(found: Guess) -> bool:
    """Whether the file numbers its actuators 1, 2, … itself."""
    return all(word.removesuffix(".0").isdigit() and float(word) >= 1 for word in found.samples)


def _sample(found: Guess, files: Sequence[str]) -> list[str]:
    column = found.of("sample")
    if files:
        lines = ["files:   # constants that differ from file to file go here, constants: {gamma_deg: 20}"]
        return [*lines, *(f"  - {{name: {quoted(name)}, sample: {i}}}" for i, name in enumerate(files, start=1))]
    if column is None and found.perhaps:
        name = quoted(found.perhaps)
        return [f"sample:   # TODO: 1 if all rows are of one actuator; {{from: {name}}} if {name} says which"]
    if column is None:
        return ["sample: 1   # all rows are of one actuator; else {from: COLUMN}"]
    if numbered(found):
        return [f"sample: {{from: {quoted(column.name)}}}"]
    words = ", ".join(f"{quoted(word)}: {number}" for number, word in sample_keys(found))
    return [f"sample: {{from: {quoted(column.name)}, as: {{{words}}}}}"]


def quantities_given(found: Guess) -> dict[str, ColumnGuess]:
    """Column of the table → the file's column; a length, stretch or strain becomes an elongation, half an inner
    diameter the inner radius."""
    given = {}
    stand_in = {"elongation_mm": ("stretch", "strain", HELD), "inner_radius_mm": (INNER_DIAMETER,)}
    for name in (*DESIGN, "elongation_mm", "twist_deg", "pressure_kpa", *READINGS, *FURTHER):
        column = found.of(name)
        if column is None:
            column = next((c for q in stand_in.get(name, ()) if (c := found.of(q))), None)
        if column is not None and not (name == "pressure_kpa" and found.pressures):
            given[name] = column
    return given


def _column(name: str, column: ColumnGuess) -> list[str]:
    keys, remarks = [f"from: {quoted(column.name)}"], []
    ratio = column.quantity in ("stretch", "strain")
    if column.unit:
        keys.append(f"unit: {quoted(SPELLED.get(column.unit, column.unit))}")
    elif not ratio:
        keys.append("unit: ")
        remarks.append(f"TODO: the heading says no unit (the table's is {unit_of(name).replace('*', '·')})")
    elif column.quantity == "strain" and max(abs(column.low), abs(column.high)) > LARGEST_STRAIN:
        keys.append('unit: "?"')
        remarks.append('TODO: % or "1"')
    if ratio:
        keys += ["times: length_mm", *(["minus: length_mm"] if column.quantity == "stretch" else [])]
    if name == "elongation_mm" and any(word in plain(column.name) for word in CONTRACTIONS):
        keys.append("sign: -1")
        remarks.append("a contraction shortens")
    keys += ["minus: length_mm"] if column.quantity == HELD else []
    keys += ["scale: 0.5"] if column.quantity == INNER_DIAMETER else []
    if column.confidence != "sure":
        remarks.append(f"{column.confidence}: check")
    if name in ("force_n", "moment_nmm"):
        remarks.append("add sign: -1 if a push is negative here" if name == "force_n" else "sign: -1 turns it")
    remark = f"   # {'; '.join(remarks)}" if remarks else ""
    return [f"  {name}: {{{', '.join(keys)}}}{remark}"]


def quoted(text: str) -> str:
    """A text as YAML takes it for one."""
    plain_word = text.replace("_", "").isalnum() and text.isascii() and not text[:1].isdigit()
    words = {"null", "true", "false", "yes", "no", "on", "off"}
    return text if plain_word and text.lower() not in words else _escaped(json.dumps(text, ensure_ascii=False))


def _escaped(text: str) -> str:
    """Characters that no YAML may hold, as their numbers."""
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)
