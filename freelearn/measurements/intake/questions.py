"""What the draft of a recipe leaves open, as questions one after the other, and the draft with their answers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.draft import quoted
from freelearn.measurements.intake.guess import Guess
from freelearn.measurements.intake.units import conversion, unit_of

_CONSTANT = re.compile(r"^(?P<lead> +)(?P<name>[a-z]\w*):   # TODO: (?P<about>.*)$")
_OF_SAMPLE = re.compile(r"^  (?P<number>\d+): \{(?P<name>\w+): \}   # TODO: (?P<about>.*)$")
_UNIT = re.compile(r'^ +(?P<name>\w+): \{from: (?P<source>.*), unit: (?P<blank>"\?"|)(?P<rest>[,}].*)$')
_SAMPLE = re.compile(r"^sample:   # TODO: ")
_MEMBER_UNIT = re.compile(r'^  - pressure: \{from: (?P<source>.*), unit: (?P<blank>""|)\}')
_NUMBER = re.compile(r"([+\-−]?\d*[.,]?\d+(?:[eE][+-]?\d+)?)\s*(.*)")
YES, NO = ("y", "yes", "j", "ja", "o", "oui", "s", "si", "sí"), ("n", "no", "nein", "non")

POSITIVE = ("length_mm", "inner_radius_mm", "outer_radius_mm")

# Asks a question and gives the answer as it was typed.
Ask = Callable[[str], str]


@dataclass(frozen=True)
class Asking:
    """ask: gives what was typed. tell: shows what is wrong with it."""

    ask: Ask
    tell: Callable[[str], None]

    def number(self, question: str, column: str) -> float:
        """A number in the table's unit; another unit may stand behind it: 0.25 in."""
        unit = unit_of(column)
        while True:
            typed = self.ask(f"{question} [{unit.replace('*', '·')}]: ").strip()
            found = _NUMBER.fullmatch(typed)
            try:
                if not found:
                    raise UserError(f"{typed!r} is no number: write one, such as 90 or 3.5 in")
                value = float(found[1].replace("−", "-").replace(",", "."))
                if found[2]:
                    change = conversion(found[2], unit)
                    value = change.factor * value + change.shift
                if value <= 0 and column in POSITIVE:
                    raise UserError(f"{typed!r} is no size of an actuator: write a positive number")
                return float(f"{value:.12g}")
            except UserError as mistake:
                self.tell(str(mistake))

    def unit(self, question: str, wanted: str) -> str:
        """A unit of the kind that is wanted."""
        while True:
            typed = self.ask(f"{question}: ").strip()
            try:
                if not typed:
                    raise UserError("a unit is needed: write one such as mm, in, kPa, bar, N, N·m, deg, rad, %")
                conversion("" if typed == "1" and not wanted else typed, wanted)
                return typed
            except UserError as mistake:
                self.tell(str(mistake))

    def sure(self, question: str) -> bool:
        """Yes or no; neither is taken for granted."""
        while True:
            typed = self.ask(f"{question} [y/n]: ").strip().lower()
            if typed in YES or typed in NO:
                return typed in YES
            self.tell("write y or n")

    def choice(self, question: str, known: Sequence[str], likely: str) -> str:
        """One of some words; Enter is the likely one."""
        while True:
            typed = self.ask(f"{question} ({', '.join(known)}) [{likely}]: ").strip() or likely
            if typed in known:
                return typed
            self.tell(f"{typed!r} is none of {', '.join(known)}")


def answered(text: str, found: Guess, asking: Asking) -> str:
    """The draft `text` of the guess `found` with nothing left open. Raises what `asking.ask` raises."""
    return "\n".join(line for one in text.splitlines() for line in _line(one, found, asking)) + "\n"


def _line(line: str, found: Guess, asking: Asking) -> Iterator[str]:
    if match := _CONSTANT.match(line):
        name = match["name"]
        value = asking.number(f"{name}: {match['about']}", name)
        yield f"{match['lead']}{name}: {value:g}" if f"{value:g}" == str(value) else f"{match['lead']}{name}: {value!r}"
        braid = "Is it a braid (McKibben, Festo), with as many fibers wound the other way?"
        if name == "gamma_deg" and asking.sure(braid):
            yield f"{match['lead']}gamma2_deg: {-value!r}"
    elif match := _OF_SAMPLE.match(line):
        yield f"  {match['number']}: {{{match['name']}: {asking.number(match['about'], match['name'])!r}}}"
    elif _SAMPLE.match(line):
        name = quoted(found.perhaps)
        of_one = asking.sure(
            f"Are all rows of one actuator (y), or does the column {found.perhaps!r} say of which (n)?"
        )
        if of_one:
            yield "sample: 1"
            return
        words = ", ".join(f"{quoted(word)}: {i}" for i, word in enumerate(found.perhaps_words, start=1))
        yield f"sample: {{from: {name}, as: {{{words}}}}}"
        yield "samples:"
        for i, word in enumerate(found.perhaps_words, start=1):
            yield f"  {i}: {{length_mm: {asking.number(f'unloaded length of {word}', 'length_mm')!r}}}"
    elif (match := _MEMBER_UNIT.match(line)) or (match := _UNIT.match(line)):
        member = line.startswith("  - ")
        name = "pressure_kpa" if member else match["name"]
        wanted = "" if match["blank"] == '"?"' else unit_of(name)
        unit = quoted(asking.unit(f"Which unit has the column {match['source']} ({name})?", wanted))
        line = line[: match.start("blank")] + unit + line[match.end("blank") :]
        yield _signed(line.split("   # TODO")[0], asking) if name == "force_n" else line.split("   # TODO")[0]
    elif re.match(r"^  force_n: \{", line):
        yield _signed(line, asking)
    elif line.startswith("bed: "):
        about = "; ".join(f"{n}: measures {' and '.join(q.name for q in b.measured)}" for n, b in BEDS.items())
        yield f"bed: {asking.choice(f'Which bed ({about})?', list(BEDS), found.bed)}"
    else:
        yield line


def _signed(line: str, asking: Asking) -> str:
    """The force with its sign: the table's is positive where the actuator pushes."""
    head, _, _ = line.partition("   #")
    if asking.sure("Does a positive force in this file mean that the actuator pulls (as of a muscle)?"):
        return head.rstrip()[:-1] + ", sign: -1}"
    return head
