"""What a recipe says of its files and of the actuators in them: how to read them, which rows are whose."""

from __future__ import annotations

from collections.abc import Mapping

from freelearn.data.intake.recipes.recipe import DESIGN, Column, Constants, Design, Join, Member, Part, Reading, Sample
from freelearn.data.intake.recipes.recipe_columns import column_of, columns_of, conditions_of, constants_of
from freelearn.data.intake.recipes.recipe_section import Section

READ = ("sheet", "variables", "encoding", "separator", "decimal", "thousands", "header", "names", "units_row")

JOIN = ("file", "read", "time", "gap_s", "columns")


def reading_of(section: Section) -> Reading:
    """How the file is to be read."""
    section.only(READ)
    decimal = section.text("decimal") or None
    if decimal not in (None, ".", ","):
        section.say(f"is {decimal!r}: write '.' or ','", "decimal")
    separator = section.text("separator") or None
    if separator and len(separator) != 1:
        section.say(f'is {separator!r}: write one character, "\\t" for tabs', "separator")
    return Reading(
        sheet=section.text("sheet") or None,
        variables=section.texts("variables"),
        encoding=section.text("encoding") or None,
        separator=separator,
        decimal=decimal,
        thousands=section.text("thousands") or None,
        header=section.integer("header", 1),
        names=section.texts("names"),
        units_row=section.switch("units_row"),
    )


def sample_of(section: Section) -> Sample | None:
    """Which actuator rows are of; None where the section does not say."""
    if "sample" not in section:
        if "sample" in section.content:
            section.say("is blank: write 1 if all rows are of one actuator, or {from: COLUMN}", "sample")
        return None
    if not isinstance(section.content["sample"], Mapping):
        return Sample(number=section.integer("sample", 1))
    inner = section.section("sample")
    inner.only(("from", "as"))
    if "from" not in inner:
        inner.say("names no column of the file: add from:")
    if "as" not in inner:
        return Sample(source=inner.text("from"))
    names = inner.section("as")
    numbers = {word: names.integer(word, 1) for word, _ in names.items()}
    return Sample(source=inner.text("from"), numbers={w: n for w, n in numbers.items() if n is not None})


def files_of(root: Section) -> tuple[Part, ...]:
    """The files that the recipe lists, with what differs."""
    parts: list[Part] = []
    for section in root.sections("files"):
        section.only(("name", "sample", "constants", "columns", "read", "drop", "join", "beside"))
        name = section.text("name")
        if ("name" in section or "read" not in section) and (not name or _is_elsewhere(name)):
            section.say(f"is {name!r}: give the name of a file in the folder", "name")
        part = Part(
            name=name,
            sample=sample_of(section),
            constants=constants_of(section.section("constants")),
            columns=columns_of(section.section("columns")),
            reading=_own_reading(section),
            drop=conditions_of(section, "drop"),
            join=joins_of(section),
            beside=tuple(map(_beside, section.sections("beside"))),
        )
        if (name, part.reading) in [(other.name, other.reading) for other in parts]:
            section.say(f"names {name or 'one place'} a second time: name each file once, or say what is read of it")
        parts.append(part)
    return tuple(parts)


def _beside(section: Section) -> tuple[str, Reading | None]:
    """Where the channels of a join stand for one part."""
    section.only(("file", "read"))
    return _file_of(section, "in the folder"), _own_reading(section)


def _own_reading(section: Section) -> Reading | None:
    return reading_of(section.section("read")) if "read" in section else None


def _file_of(section: Section, where: str) -> str:
    """The name of a file. where: it has to lie."""
    file = section.text("file")
    if _is_elsewhere(file):
        section.say(f"is {file!r}: give the name of a file {where}", "file")
    return file


def joins_of(root: Section) -> tuple[Join, ...]:
    """Channels of other clocks, joined by time."""
    joins = []
    for section in root.sections("join"):
        section.only(JOIN)
        file = _file_of(section, "beside the data")
        if "time" not in section:
            section.say("has no clock: add time: {from: COLUMN, unit: s}")
        if "columns" not in section:
            section.say("joins nothing: add columns:")
        gap = section.number("gap_s")
        if gap is not None and gap <= 0:
            section.say(f"is {gap:g}: give seconds", "gap_s")
        time = column_of(section.section("time"), "time_s") if "time" in section else Column("")
        columns = columns_of(section.section("columns"))
        for name, column in columns.items():
            if name == "time_s":
                section.say("is the rows' clock: name this one under time:", "columns.time_s")
            if column.offset == "rest" or column.blank_where:
                section.say("cannot say offset: rest or blank_where: give a number, or blanks:", f"columns.{name}")
        joins.append(Join(time, columns, file, _own_reading(section), gap))
    return tuple(joins)


def _is_elsewhere(file: str) -> bool:
    """Whether a name leads out of the data's folder."""
    return "\\" in file or file.startswith("/") or not {".", "..", ""}.isdisjoint(file.split("/") if file else ())


def samples_of(section: Section) -> dict[int, Constants]:
    """Constants by number of the sample."""
    for key, _ in section.items():
        if not key.isdecimal():
            section.say("is no number of a sample", key)
    return {int(key): constants_of(section.section(key)) for key, _ in section.items() if key.isdecimal()}


def design_of(root: Section) -> Design | None:
    """Where the actuators' designs stand, joined by name."""
    if "design" not in root:
        return None
    section = root.section("design")
    section.only(("file", "sheet", "by", "columns"))
    file = _file_of(section, "beside the data, or design=FILE to intake")
    if "by" not in section:
        section.say("says no column of names: add by: COLUMN")
    if not file and "sheet" not in section:
        section.say("says no file: add file: NAME, or sheet: of the data's own workbook")
    inner = section.section("columns")
    inner.only(DESIGN, "part of the design")
    columns = {name: column_of(inner.section(name), name) for name, _ in inner.items() if name in DESIGN}
    return Design(section.text("by"), columns, file, section.text("sheet"))


def members_of(root: Section) -> tuple[Member, ...]:
    """The actuators that share an end block."""
    members = []
    for section in root.sections("members"):
        section.only(("pressure", *DESIGN))
        design = Section({k: v for k, v in section.items() if k in DESIGN}, section.place, root.mistakes)
        if "pressure" not in section:
            section.say("has no pressure: add pressure: {from: …, unit: …}")
        pressure = column_of(section.section("pressure"), "pressure_kpa") if "pressure" in section else Column("")
        members.append(Member(pressure, constants_of(design)))
    return tuple(members)
