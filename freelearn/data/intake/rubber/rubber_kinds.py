"""What the columns of a test of rubber alone are, and how a stretch and a nominal stress come of them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from freelearn.data.intake.headings import heading
from freelearn.data.intake.words_abroad import plain


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
