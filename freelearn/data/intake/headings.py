"""What a column's heading says, in nine languages: which quantity, in which unit."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from freelearn.data.intake.laboratory_units import dimension
from freelearn.data.intake.words_abroad import CONTRACTIONS, FULL_WIDTH, WORDS_OF_LANGUAGES, plain


def words_of(quantity: str, english: str) -> re.Pattern[str]:
    """The words of a quantity in all languages."""
    return re.compile("|".join(filter(None, (english, *(words.get(quantity, "") for words in WORDS_OF_LANGUAGES)))))


Confidence = Literal["sure", "likely", "unsure"]
# No quantity of the table: half of it is the inner radius.
INNER_DIAMETER = "inner_diameter"
# The recording that a row of a log is of.
RUN = "run"
# Nor is the thickness of the wall: with the inner radius it makes the outer one.
WALL = "wall"

# Words → quantity. The first whose words fit counts; a unit of another kind rules a quantity out.
ENGLISH: tuple[tuple[str, str], ...] = (
    (INNER_DIAMETER, r"id|inner ?diameter|inside ?diameter|bore"),
    (WALL, r"wall( ?thickness)?|thickness"),
    ("outer_diameter_mm", r"od|outer ?diameter|outside ?diameter|diameter"),
    ("inner_radius_mm", r"ir|inner ?radius|ri"),
    ("outer_radius_mm", r"or|outer ?radius|ro|radius"),
    ("gamma2_deg", r"gamma ?2"),
    ("gamma_deg", r"gamma|fib(er|re) ?angle|braid ?angle|winding ?angle"),
    ("elongation_mm", r"d ?l|delta ?l(ength)?|elongation|extension|displacement|disp|stroke|travel|s|z|dz"),
    (
        "length_mm",
        r"((held|unloaded|rest(ing)?|initial|free|active|original|nominal) ?)?length|l ?0?|len|gauge ?length",
    ),
    ("stretch", r"lambda( ?z)?|stretch( ?ratio)?|axial ?stretch"),
    ("strain", r"((nominal|eng|engineering|true|logarithmic) ?)*strain|contraction|shortening|eps(ilon)?"),
    ("twist_deg", r"d ?phi|phi|twist|rotation|rot\d*|angle|w|theta|turn"),
    ("stress", r"((nominal|eng|engineering|true|cauchy|tensile) ?)*stress|sigma|σ"),
    ("pressure_kpa", r"p\w{0,4}?\d*|(gauge|internal|inner|supply|air) ?pressure|pressure\w*|press|gauge"),
    ("force_n", r"f|fz|force|load|axial ?(force|load)|pull|tension|thrust|(tensile|pulling) ?force"),
    ("moment_nmm", r"m|mz|tz|torque|moment|torsion|load"),
    ("time_s", r"t|time|elapsed|(time|date)? ?stamp|date ?time|epoch|unix ?time"),
    ("temperature_c", r"temp|temperature"),
    ("step", r"step"),
    ("buckled", r"buckled"),
    ("slack", r"slack"),
    ("left_out", r"left ?out"),
    ("sample", r"sample|specimen|muscle|actuator|tube"),
    (RUN, r"run( ?(no|nr|number|id))?|recording|trial|take|(test|experiment)( ?(no|nr|number|id))?"),
)
# A stretch or a strain with a unit of length is an elongation; an elongation in percent is a strain.
BY_UNIT = {"elongation_mm": "strain", "strain": "elongation_mm", "stretch": "elongation_mm"}
WORDS = tuple((quantity, words_of(quantity, pattern)) for quantity, pattern in ENGLISH)
_TIME = dict(WORDS)["time_s"]
KIND = {
    INNER_DIAMETER: "length",
    WALL: "length",
    "outer_diameter_mm": "length",
    "inner_radius_mm": "length",
    "outer_radius_mm": "length",
    "gamma2_deg": "angle",
    "gamma_deg": "angle",
    "elongation_mm": "length",
    "length_mm": "length",
    "stretch": "ratio",
    "strain": "ratio",
    "contraction": "ratio",
    "shortening": "length",
    "twist_deg": "angle",
    "stress": "pressure",
    "pressure_kpa": "pressure",
    "moment_nmm": "moment",
    "force_n": "force",
    "time_s": "time",
    "temperature_c": "temperature",
}
# Of the table itself, for a unit alone.
OF_KIND = {"pressure": "pressure_kpa", "moment": "moment_nmm", "force": "force_n", "time": "time_s"}
# A contraction is a negative elongation.
SHORTENED = {"strain": "contraction", "elongation_mm": "shortening"}
# Words that say how a reading was treated, not what it is of.
TREATED = {"raw", "meas", "measured", "avg", "mean", "act", "actual", "net", "sensor", "kistler", "ch", "channel"}
# What sensors give, as headings write it.
SIGNALS = {"v": "V", "volt": "V", "volts": "V", "mv": "mV", "ma": "mA"}
# Statistics and commands beside the reading are not the reading.
BESIDE = {"std", "sd", "se", "sem", "var", "n", "count", "cmd", "command", "set", "setpoint", "target", "ref", "error"}


@dataclass(frozen=True)
class Heading:
    """quantity: of the table, or stretch, strain; None where the heading says none. unit: as written, "" where none is
    said. confidence: sure where word and unit agree, likely where one of them says it, unsure otherwise. signal: V or
    mA, where the readings are a sensor's and in no unit of the quantity."""

    quantity: str | None
    unit: str
    confidence: Confidence
    signal: str = ""


def heading(name: str, unit: str = "") -> Heading:
    """What a heading says. unit: of a row of units, where the file has one.

    >>> heading("P48_kPa")
    Heading(quantity='pressure_kpa', unit='kPa', confidence='sure', signal='')
    >>> heading("Load (lbs in)").quantity
    'moment_nmm'
    >>> heading("F_std").quantity
    """
    stem, written = split_heading(name)
    unit = unit.strip().strip("[]()") or written
    kind = dimension(unit) if unit else None
    signal = SIGNALS.get(unit.lower(), "") if kind is None else ""
    words = [word for word in re.split(r"[\s_.\-/:]+", plain(_spaced(stem))) if word]
    if BESIDE & set(words) and len(words) > 1:
        return Heading(None, unit if kind else "", "unsure")
    spoken = " ".join(word for word in words if word not in TREATED)
    whole = _with_units([q for q, pattern in WORDS if pattern.fullmatch(spoken)], kind)
    fits = [q for q in whole or _containing(spoken) if kind is None or KIND.get(q) in (kind, None)]
    # A recording has no unit, and its name stands alone.
    fits = [q for q in fits if q != RUN or (whole and not kind)]
    if any(word in plain(name) for word in CONTRACTIONS):
        fits = [SHORTENED.get(q, q) for q in fits]
    if fits:
        agrees = bool(whole) and (kind is not None or KIND.get(fits[0], "ratio") == "ratio")
        long = len(spoken) > 2
        sure: Confidence = "sure" if agrees else "likely" if long else "unsure"
        return Heading(fits[0], unit if kind else "", sure, signal)
    if kind in OF_KIND:
        return Heading(OF_KIND[kind], unit, "likely")
    return Heading(None, unit if kind else "", "unsure", signal)


def time_unit(name: str, unit: str = "") -> str | None:
    """The unit of a heading one of whose words is time, as of one clock among several: t_F or Zeit Kraft; "" where it
    says none, None where it says no time. unit: of a row of units.

    >>> time_unit("t2 [ms]"), time_unit("Zeit Kraft"), time_unit("t_F"), time_unit("T2"), time_unit("t [mm]")
    ('ms', '', '', None, None)
    """
    stem, written = split_heading(name)
    unit = unit.strip().strip("[]()") or written
    if name.endswith(f"_{written}") and len(written) == 1 and written not in "CK":
        # The channel rather than a unit: a force, not degrees Fahrenheit.
        unit = ""
    words = [re.sub(r"\d+$", "", word) for word in re.split(r"[\s_.:\-]+", _spaced(stem))]
    # A capital alone is a temperature, or a torque; tF the time of F.
    timed = any(word != "T" and (_TIME.fullmatch(plain(word)) or re.fullmatch("t[A-Z]", word)) for word in words)
    kind = dimension(unit) if unit else None
    return (unit if kind else "") if timed and kind in (None, "time") else None


def _with_units(whole: list[str], kind: str | None) -> list[str]:
    """The quantities, and what those of them are that have another name with a unit of another kind."""
    return whole + [BY_UNIT[q] for q in whole if q in BY_UNIT and kind == KIND[BY_UNIT[q]] and BY_UNIT[q] not in whole]


def split_heading(name: str) -> tuple[str, str]:
    """The words of a heading and the unit that it ends with."""
    # Of a matrix's columns, and of columns of one name, each has its number.
    bare = re.sub(r"(?<=\S) (\[\d+\]|\d{1,2})$", "", name.translate(FULL_WIDTH).strip())
    if match := re.fullmatch(r"(.*?)[\s_]*[(\[]([^()\[\]]*)[)\]]\s*", bare):
        return match.group(1) or match.group(2), match.group(2)
    for separator in ("_", " in ", " en ", ", ", "/", " ", "."):
        stem, found, last = bare.rpartition(separator)
        # One letter after a point or a space is a name rather than a unit.
        known = found and stem and dimension(last) not in (None, "ratio")
        if known and (separator not in (" ", ".") or len(last) > 1):
            return stem, last.strip()
    return bare, ""


def _spaced(stem: str) -> str:
    """Words that only capitals tell apart: PressureSensor."""
    return re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", stem)


def _containing(spoken: str) -> list[str]:
    """Quantities one of whose longer names stands among the words."""
    found = []
    for quantity, pattern in WORDS:
        if any(len(word) > 3 and pattern.fullmatch(word) for word in spoken.split()):
            found.append(quantity)
    return found
