"""A recipe of tests of rubber alone: the section `tests`, and how a stretch and a nominal stress come of its
columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from freelearn.data.intake.headings import heading
from freelearn.data.intake.recipes.recipe import Column, Condition, Constants, Reading
from freelearn.data.intake.recipes.recipe_columns import column_of, conditions_of
from freelearn.data.intake.recipes.recipe_parts import reading_of
from freelearn.data.intake.recipes.recipe_section import Section, refuse_mistakes
from freelearn.data.intake.words_abroad import plain
from freelearn.data.specimen_schema import MODES, SHEAR, mode_name
from freelearn.data.specimen_tests import TIME


@dataclass(frozen=True)
class Kind:
    """words: as people call it. unit: of what kind. needs: constants of the specimen."""

    words: str
    unit: str
    needs: tuple[str, ...] = ()


ALONG = {
    "stretch": Kind("stretch (length over unloaded length)", "ratio"),
    "strain": Kind("strain (elongation over unloaded length)", "ratio"),
    "true_strain": Kind("true strain (logarithm of the stretch)", "ratio"),
    "elongation_mm": Kind("elongation", "length", ("length_mm",)),
}
STRESSES = {
    "stress_mpa": Kind("nominal stress (force over unloaded area)", "pressure"),
    "true_stress_mpa": Kind("true stress (force over present area)", "pressure"),
    "force_n": Kind("force", "force", ("width_mm", "thickness_mm")),
}
KINDS = {**ALONG, **STRESSES}
SPECIMEN = {
    "length_mm": "unloaded length between the marks",
    "width_mm": "unloaded width",
    "thickness_mm": "unloaded thickness",
}
TRUE = ("true", "cauchy", "log", "hencky", "wahr", "vrai", "reale", "verdader", "真")
NOMINAL = ("nominal", "eng", "nenn", "ingen", "ingegn", "techni", "pk1", "公称")
# Modes by words of a heading, a sheet or a file; the first that fits.
MODE_WORDS = {
    "pure_shear": r"\bps\b|pure ?shear|planar|(reiner? )?scher|rein\w* schub|cisaillement|taglio|cortante|せん断|strip",
    "equibiaxial": r"\b(et|bt|eb)\b|equi|aequi|biax|zweiachs|bulge|balloon|二軸",
    "uniaxial": r"\b(ut|ua)\b|uni ?ax|einachs|uniass|zug|tensile|tension|traction|trazione|traccion|単軸|引張",
}


def kind_of(name: str, unit: str = "") -> tuple[str, bool]:
    """The kind of a column, "" for none, and whether its heading leaves no doubt.

    >>> kind_of("Eng. stress [kPa]"), kind_of("True Strain"), kind_of("Spannung [MPa]")
    (('stress_mpa', True), ('true_strain', True), ('stress_mpa', False))
    """
    said, text = heading(name, unit), plain(name)
    true, nominal = (any(word in text for word in words) for words in (TRUE, NOMINAL))
    if said.quantity in ("strain", "contraction"):
        return ("true_strain", True) if true else ("strain", True)
    if said.quantity == "stress":
        return ("true_stress_mpa", True) if true else ("stress_mpa", nominal)
    if said.quantity == "pressure_kpa" and re.match(r"(p|s|t)\d*([\s_(\[]|$)", text):
        # In the literature P is the nominal stress.
        return "stress_mpa", False
    if said.quantity in ("elongation_mm", "stretch", "force_n"):
        return said.quantity, bool(said.unit) or said.quantity == "stretch"
    return "", False


def mode_in(text: str) -> str:
    """The mode that a text names, "" for none.

    >>> mode_in("Pure shear 3"), mode_in("Reiner Schub"), mode_in("UT_test.csv"), mode_in("Tabelle1")
    ('pure_shear', 'pure_shear', 'uniaxial', '')
    """
    spoken = re.sub(r"[_\W]+", " ", plain(text))
    return next((mode for mode, words in MODE_WORDS.items() if re.search(words, spoken)), "")


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
    refuse_mistakes(mistakes, name)
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
