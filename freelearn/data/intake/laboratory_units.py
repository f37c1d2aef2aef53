"""Units as laboratories write them, and what they are in the table's units (pint knows the factors)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import TYPE_CHECKING

from freelearn.common.errors import UserError

if TYPE_CHECKING:
    from pint import Quantity, Unit, UnitRegistry


# How people write units, as pint takes them.

# Those that say of a pressure that the atmosphere is in it.
ABSOLUTE = ("psia", "bara")
# Spellings that pint does not know or reads as something else (Nm: per mass; pa: a picoyear; lb: a mass).
SPELLINGS = {
    **dict.fromkeys(("lb", "lbs", "pound", "pounds", "lbf", "lbsf", "#"), "lbf"),
    **dict.fromkeys(("kg", "kgs", "kgf", "kp"), "kgf"),
    **dict.fromkeys(("g", "gf", "gram", "grams"), "gf"),
    **dict.fromkeys(("oz", "ozf"), "ozf"),
    **dict.fromkeys(("nm", "n.m", "n m", "newton meter", "newtonmeter"), "N*m"),
    **dict.fromkeys(("nmm", "n.mm", "n mm"), "N*mm"),
    **dict.fromkeys(("ncm", "n.cm", "n cm"), "N*cm"),
    **dict.fromkeys(("mnm", "mn.m", "mn m"), "mN*m"),
    **dict.fromkeys(("knm", "kn.m", "kn m"), "kN*m"),
    **dict.fromkeys(("mnmm",), "mN*mm"),
    **dict.fromkeys(("lbin", "lbsin", "lbfin", "inlb", "inlbs", "inlbf", "lb.in", "in.lb"), "lbf*inch"),
    **dict.fromkeys(("lbft", "ftlb", "ftlbs", "ftlbf", "lbfft"), "lbf*foot"),
    **dict.fromkeys(("ozin", "inoz", "ozfin"), "ozf*inch"),
    **dict.fromkeys(("psi", "psig", "lb/in^2", "lbf/in^2", "psia"), "psi"),
    **dict.fromkeys(("in", "inch", "inches", '"', "''", "zoll", "pouce", "pouces", "pollici", "pulgadas"), "inch"),
    **dict.fromkeys(("ft", "foot", "feet"), "foot"),
    **dict.fromkeys(("micron", "microns", "um", "micrometer"), "micrometer"),
    **dict.fromkeys(("°", "deg", "degs", "degree", "degrees", "grad°"), "degree"),
    # What German, Spanish and others call degrees; pint takes grad for gon.
    **dict.fromkeys(
        ("grad", "grado", "grados", "gradi", "degre", "degré", "degres", "degrés", "度", "graden", "stupně", "stopnie"),
        "degree",
    ),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), "radian"),
    **dict.fromkeys(("rev", "revs", "turn", "turns", "revolution", "revolutions"), "turn"),
    **dict.fromkeys(("pa", "pascal"), "Pa"),
    **dict.fromkeys(("hpa",), "hPa"),
    **dict.fromkeys(("kgf/cm^2", "kg/cm^2", "kp/cm^2", "at"), "kgf/cm^2"),
    **dict.fromkeys(("kpa", "kpag"), "kPa"),
    **dict.fromkeys(("mpa",), "MPa"),
    **dict.fromkeys(("bar", "barg", "bara"), "bar"),
    **dict.fromkeys(("mbar",), "mbar"),
    **dict.fromkeys(("mmhg", "torr"), "mmHg"),
    **dict.fromkeys(("cmh2o",), "cmH2O"),
    **dict.fromkeys(("inhg",), "inHg"),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunden", "seconden", "seg", "秒"), "second"),
    **dict.fromkeys(("ms", "msec"), "millisecond"),
    **dict.fromkeys(("us", "usec"), "microsecond"),
    **dict.fromkeys(("ns", "nsec"), "nanosecond"),
    **dict.fromkeys(("d", "day", "days"), "day"),
    **dict.fromkeys(("min", "mins", "minute", "minutes", "分"), "minute"),
    **dict.fromkeys(("h", "hr", "hour", "hours"), "hour"),
    **dict.fromkeys(("°c", "degc", "celsius", "deg c", "c"), "degC"),
    **dict.fromkeys(("°f", "degf", "fahrenheit", "deg f", "f"), "degF"),
    **dict.fromkeys(("%", "percent", "pct"), "percent"),
    **dict.fromkeys(("", "-", "1", "none", "mm/mm", "m/m"), ""),
    **dict.fromkeys(("m", "meter", "meters"), "meter"),
    **dict.fromkeys(("n", "newton", "newtons"), "N"),
}
# Where the case of a letter says which unit is meant, it is heeded before SPELLINGS.
EXACT = {"MN": "MN", "mN": "mN", "kN": "kN", "N": "N", "cN": "cN", "mPa": "mPa", "MPa": "MPa", "Pa": "Pa", "K": "K"}


# The unit of each kind of column of the table, by the ending of its name.
ENDINGS = {"_deg": "deg", "_mpa": "MPa", "_mm": "mm", "_kpa": "kPa", "_nmm": "N*mm", "_n": "N", "_s": "s", "_c": "degC"}
NO_UNIT = ""

_TEXT = re.compile(r"[\w°µμ%·⋅•×*/^.\s()²³'\"#-]{0,40}")


@dataclass(frozen=True)
class Conversion:
    """value in the table's unit = factor · value in the file's + shift."""

    source: str
    target: str
    factor: float
    shift: float


def unit_of(column: str) -> str:
    """The unit of a column of the table; "" for counts and marks.

    >>> unit_of("moment_nmm"), unit_of("pressure_2_kpa"), unit_of("sample")
    ('N*mm', 'kPa', '')
    """
    return next((unit for ending, unit in ENDINGS.items() if column.endswith(ending)), NO_UNIT)


def conversion(source: str, target: str) -> Conversion:
    """From a unit as somebody wrote it to another. Raises UserError where there is no such unit, or of another kind.

    >>> conversion("lbs in", "N*m").factor  # doctest: +ELLIPSIS
    0.1129848...
    """
    unit, wanted = parsed(source), parsed(target)
    if unit.dimensionality != wanted.dimensionality:
        raise UserError(f"unit {source!r} is {_kind(unit)}, not {_kind(wanted)}{_remedy(unit)}")
    if _plain(unit) != _plain(wanted):
        raise UserError(f"unit {source!r} is {_kind(unit)}, not {_kind(wanted)}")
    zero, one = (_in(value, unit, wanted) for value in (0.0, 1.0))
    return Conversion(source, target, one - zero, zero)


def in_units_of(column: str, unit: str, difference: float) -> float:
    """A difference of readings in the unit of a column of the table; as it is where their own is not known.

    >>> in_units_of("elongation_mm", "in", 0.5)
    12.7
    """
    return float(f"{conversion(unit, unit_of(column)).factor * difference:.6g}") if unit else difference


def dimension(text: str) -> str | None:
    """What a unit measures, in one word of KINDS; None where the text is no unit."""
    try:
        return _name(parsed(text))
    except UserError:
        return None


@lru_cache(maxsize=256)
def parsed(text: str) -> Unit:
    """The unit that a text means. Raises UserError, with the nearest spelling, where it means none."""
    written = text.strip().strip("[]").strip()
    if not _TEXT.fullmatch(written) or re.search(r"\d{3}|\*\*", written):
        raise UserError(f"{text!r} is no unit: write one such as N, mm, deg, kPa, psi or lbf*in")
    for spelled in _readings(written):
        try:
            return registry().parse_units(spelled)
        except Exception:  # pint raises half a dozen kinds, tokenizer errors among them.
            continue
    near = get_close_matches(written.lower(), SPELLINGS, n=1, cutoff=0.6)
    hint = f", did you mean {near[0]!r}?" if near else ": write one such as N, mm, deg, kPa, psi or lbf*in"
    raise UserError(f"{text!r} is no unit that pint knows{hint}")


@lru_cache(maxsize=1)
def registry() -> UnitRegistry[float]:
    """pint's registry. Here and not above: it costs a third of a second."""
    from pint import UnitRegistry

    return UnitRegistry(cache_folder=None)


def _readings(written: str) -> list[str]:
    """What pint is given for it, the likeliest first."""
    if written in EXACT:
        return [EXACT[written]]
    plain = re.sub(r"[·⋅•×]", "*", written).replace("²", "^2").replace("³", "^3").replace("μ", "µ").strip()
    lower = plain.lower()
    joined = re.sub(r"[\s*\-]+", "", lower) if re.fullmatch(r"[a-z.]+[\s*\-]+[a-z.]+", lower) else lower
    found = [SPELLINGS[key] for key in (lower, lower.rstrip("."), joined) if key in SPELLINGS]
    parts = re.split(r"([*/\s-])", plain)
    spelled = "".join("*" if p in (" ", "-") else SPELLINGS.get(p.lower(), p) if p not in EXACT else p for p in parts)
    return found[:1] or [spelled, plain]


def _plain(unit: Unit) -> bool:
    """Whether it counts nothing, or angles: pint takes both for dimensionless, but 1 is no degree."""
    return str(unit) in ("dimensionless", "percent")


def _in(value: float, unit: Unit, wanted: Unit) -> float:
    quantity: Quantity[float] = registry().Quantity(value, unit)
    return float(quantity.to(wanted).magnitude)


KINDS = {
    "force": "N",
    "moment": "N*m",
    "pressure": "Pa",
    "length": "m",
    "angle": "rad",
    "time": "s",
    "temperature": "K",
    "ratio": "",
}


def _name(unit: Unit) -> str | None:
    if unit.dimensionless:
        return "ratio" if _plain(unit) else "angle"
    return next((k for k, u in KINDS.items() if parsed(u).dimensionality == unit.dimensionality), None)


def _kind(unit: Unit) -> str:
    name = _name(unit)
    article = "an" if name == "angle" else "a"
    return f"{article} {name}" if name else f"of another kind ({unit})"


def _remedy(unit: Unit) -> str:
    volts = parsed("V").dimensionality
    return ": give the sensor's gain as scale (in the column's unit per volt)" if unit.dimensionality == volts else ""
