"""A recipe to edit, from the guess at a file."""

from __future__ import annotations

import json
from collections.abc import Sequence

from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.guess import HELD, ColumnGuess, Guess
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


def draft(found: Guess, files: Sequence[str] = ()) -> str:
    """The recipe's text. files: names, where the data are a folder of such files. What the guess could not know is left
    blank and marked TODO."""
    bed = BEDS[found.bed]
    lines = [
        f"# How {found.name} becomes a measurement table: a guess. Check every line, then run intake with this recipe.",
        f"bed: {found.bed}   # {', '.join(BEDS)}",
    ]
    lines += _sample(found, files)
    given = _quantities(found)
    design = {name: about for name, about in CONSTANTS.items() if name not in given}
    shared = {n: a for n, a in design.items() if not (found.pressures and n == "gamma_deg")}
    imposed = [
        q.column for q in bed.imposed if q.column not in given and not (found.pressures and q.column == "pressure_kpa")
    ]
    lines.append("constants:" if shared or imposed else "constants: {}")
    lines += [f"  {name}:   # TODO: {about}" for name, about in shared.items()]
    lines += [f"  {name}: 0   # no column says it: check" for name in imposed]
    lines.append("columns:")
    for name, column in given.items():
        lines += _column(name, column)
    if not given:
        lines[-1] = "columns: {}   # TODO: {force_n: {from: …, unit: N}, …}"
    if found.pressures:
        lines.append("members:")
        for column in (c for c in found.columns if c.name in found.pressures):
            lines.append(f"  - pressure: {{from: {quoted(column.name)}, unit: {quoted(column.unit)}}}")
            lines.append("    gamma_deg:   # TODO: fiber angle, negative for the other sense of winding")
    step = found.of("step")
    lines.append(f"step: {{from: {quoted(step.name)}}}   # or: derive" if step else STEPS)
    lines += [f"{mark}: {{{quoted(marked.name)}: 1}}" for mark in MARKS if (marked := found.of(mark))]
    unused = [c.name for c in found.columns if not c.chosen]
    if unused:
        lines.append(f"# Not used: {', '.join(map(quoted, unused))}.")
    return "\n".join(lines) + "\n"


def _sample(found: Guess, files: Sequence[str]) -> list[str]:
    column = found.of("sample")
    if files:
        lines = ["files:   # constants that differ from file to file go here, constants: {gamma_deg: 20}"]
        return [*lines, *(f"  - {{name: {quoted(name)}, sample: {i}}}" for i, name in enumerate(files, start=1))]
    if column is None:
        return ["sample: 1"]
    if column.low == column.low:  # Numbers.
        return [f"sample: {{from: {quoted(column.name)}}}"]
    return [f"sample: {{from: {quoted(column.name)}, as: {{{quoted(column.example)}: 1}}}}   # TODO: the other words"]


def _quantities(found: Guess) -> dict[str, ColumnGuess]:
    """Column of the table → the file's column; a length, stretch or strain becomes an elongation."""
    given = {}
    lengths = ("stretch", "strain", HELD)
    for name in (*DESIGN, "elongation_mm", "twist_deg", "pressure_kpa", *READINGS, *FURTHER):
        column = found.of(name)
        if name == "elongation_mm" and column is None:
            column = next((c for q in lengths if (c := found.of(q))), None)
        if column is not None and not (name == "pressure_kpa" and found.pressures):
            given[name] = column
    return given


def _column(name: str, column: ColumnGuess) -> list[str]:
    keys = [f"from: {quoted(column.name)}"]
    if column.quantity in ("stretch", "strain"):
        keys += [f"unit: {quoted(column.unit)}"] if column.unit else []
        keys += ["times: length_mm", *(["minus: length_mm"] if column.quantity == "stretch" else [])]
    else:
        keys.append(f"unit: {quoted(SPELLED.get(column.unit, column.unit) or unit_of(name))}")
        keys += ["minus: length_mm"] if column.quantity == HELD else []
    remarks = []
    if not column.unit and column.quantity not in ("stretch", "strain"):
        remarks.append("TODO: the heading says no unit")
    if column.confidence != "sure":
        remarks.append(f"{column.confidence}: check")
    if name in ("force_n", "moment_nmm"):
        remarks.append("add sign: -1 if a push is negative here" if name == "force_n" else "sign: -1 turns it")
    remark = f"   # {'; '.join(remarks)}" if remarks else ""
    return [f"  {name}: {{{', '.join(keys)}}}{remark}"]


def quoted(text: str) -> str:
    """A text as YAML takes it for one."""
    plain = text.replace("_", "").isalnum() and text.isascii() and not text[:1].isdigit()
    words = {"null", "true", "false", "yes", "no", "on", "off"}
    return text if plain and text.lower() not in words else json.dumps(text, ensure_ascii=False)
