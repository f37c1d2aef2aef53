"""A recipe of tests of rubber alone: the section `tests`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from freelearn.common.errors import UserError
from freelearn.data.intake.recipes.recipe import Column, Condition, Constants, Reading
from freelearn.data.intake.recipes.recipe_columns import column_of, conditions_of
from freelearn.data.intake.recipes.recipe_parts import reading_of
from freelearn.data.intake.recipes.recipe_section import Section
from freelearn.data.intake.rubber.rubber_kinds import ALONG, SPECIMEN, STRESSES
from freelearn.data.specimen_schema import MODES, SHEAR, mode_name
from freelearn.data.specimen_tests import TIME

KEYS = ("mode", "file", "read", "columns", "constants", "drop", "until")
FURTHER = ("stretch_2", "stress_2_mpa", TIME)
# What a sheared layer's columns are: its amount of shear, and the force on it over its area.
SHEARED = ("strain", "stress_mpa", TIME)
LARGEST = "largest stress"


@dataclass(frozen=True)
class RubberTest:
    """mode: a name of MODES. file: "" of the only one. columns: one of ALONG, one of STRESSES, of a biaxial test
    stretch_2 and stress_2_mpa, and time_s of a recording. constants: of the specimen [mm]. whole: whether what follows
    the largest stress counts, too."""

    mode: str
    columns: Mapping[str, Column]
    file: str = ""
    reading: Reading = field(default_factory=Reading)
    constants: Constants = field(default_factory=dict)
    drop: tuple[Condition, ...] = ()
    whole: bool = True


def is_rubber(content: Any) -> bool:
    """Whether the plain values of a recipe are of tests of rubber."""
    return isinstance(content, Mapping) and "tests" in content


def parse_tests(content: Mapping[str, Any], name: str) -> tuple[RubberTest, ...]:
    """The tests of a recipe. Raises UserError with every mistake."""
    mistakes: list[str] = []
    root = Section(content, "", mistakes)
    root.only(("about", "tests"))
    tests = tuple(_test(section) for section in root.sections("tests"))
    if not tests and not mistakes:
        root.say("lists no tests: add tests: with an entry for each")
    if mistakes:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        raise UserError("\n  ".join([f"{name} has {count}:", *dict.fromkeys(mistakes)]))
    return tests


def _test(section: Section) -> RubberTest:
    section.only(KEYS)
    mode = mode_name(section.text("mode"))
    if mode is None:
        section.say(f"is {section.text('mode')!r}: write one of {', '.join(MODES)}", "mode")
    columns = _columns(section.section("columns"))
    if mode == SHEAR and set(columns) - set(SHEARED):
        section.say(f"is of {SHEAR}, which takes {', '.join(SHEARED)}: the strain is the amount of shear", "columns")
    until = section.text("until")
    if until not in ("", LARGEST):
        section.say(f"is {until!r}: write {LARGEST}, or leave it out", "until")
    return RubberTest(
        mode=mode or "",
        columns=columns,
        file=section.text("file"),
        reading=reading_of(section.section("read")),
        constants=_constants(section.section("constants"), columns),
        drop=conditions_of(section, "drop"),
        whole=not until,
    )


def _columns(section: Section) -> dict[str, Column]:
    section.only((*ALONG, *STRESSES, *FURTHER), "column of a test")
    columns = {name: column_of(section.section(name), name) for name, _ in section.items()}
    for kinds in (ALONG, STRESSES):
        if len([name for name in columns if name in kinds]) != 1:
            section.say(f"needs one of {', '.join(kinds)}")
    return columns


def _constants(section: Section, columns: Mapping[str, Column]) -> dict[str, float]:
    section.only(tuple(SPECIMEN), "size of a specimen")
    needed = [name for kind in {**ALONG, **STRESSES}.items() if kind[0] in columns for name in kind[1].needs]
    constants = {}
    for name in needed:
        value = section.number(name)
        if value is None or value <= 0:
            section.say(f"gives no {name}: add the {SPECIMEN[name]}, a positive number")
        else:
            constants[name] = value
    return constants
