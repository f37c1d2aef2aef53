"""What a command was asked to do: the composed configuration, checked once and frozen."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, PlainValidator
from pydantic.dataclasses import dataclass

from freelearn.common.errors import UserError
from freelearn.common.package import example
from freelearn.data.accuracy import OUTER_DIAMETER_MM, Accuracy
from freelearn.data.beds import BEDS, KINEMATIC, Bed
from freelearn.fitting.options import FitOptions

# ± needs quotes in Hydra's grammar, the others do not.
BETWEEN = re.compile(r"±|\+/-|\+-")


def plus_minus(text: str) -> tuple[float, float] | None:
    """Value and error; None where the text is none.

    >>> plus_minus("1.2e6±0.2e6"), plus_minus("1e6 +- 2e5"), plus_minus("soft")
    ((1200000.0, 200000.0), (1000000.0, 200000.0), None)
    """
    parts = BETWEEN.split(text)
    try:
        value, error = map(float, parts)
    except ValueError:
        return None
    return value, error


def quoted(word: str) -> str:
    """A word of the command line as Hydra takes it: every value with a ± in quotes.

    >>> quoted("model.C1=1e6±2e5,2e6±2e5"), quoted("train=sample3")
    ("model.C1='1e6±2e5','2e6±2e5'", 'train=sample3')
    """
    name, equals, value = word.partition("=")
    if "±" not in value or any(sign in value for sign in "'\"[{"):
        return word
    return f"{name}{equals}" + ",".join(f"'{part}'" for part in value.split(","))


# Light to import (no torch), so that a mistake is told within a second. Every mistake of a configuration is
# reported, not only the first. What only the data or the library of effects can tell (a set that the table lacks,
# an unknown effect) is checked where these are at hand.

# Nothing unknown is let through, and the types below convert nothing: "1.5" is no number, 1.0 no integer.
STRICT = ConfigDict(extra="forbid")
# What stands for an option that has to be given.
UNNAMED = (None, "", "???")

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Deviation = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
# What every generator of random numbers takes.
Seed = Annotated[int, Field(strict=True, ge=0, le=2**32 - 1)]
Share = Annotated[float, Field(strict=True, gt=0, lt=1)]
Switch = Annotated[bool, Field(strict=True)]

# {effect: {parameter: SI value, or one per sample}}
EffectValues = dict[str, dict[str, float | tuple[float, ...]]]


@dataclass(frozen=True, config=STRICT)
class AccuracySettings:
    """One standard deviation of the measuring in engineering units, as `accuracy` gives it."""

    elongation_mm: Deviation
    twist_deg: Deviation
    pressure_kpa: Deviation
    force_n: Positive
    moment_nmm: Positive
    outer_diameter_mm: Positive = OUTER_DIAMETER_MM

    def si(self, bed: Bed = KINEMATIC) -> Accuracy:
        """The same in SI, of a bed. Raises UserError where something is exact that this bed measures."""
        for quantity in bed.measured:
            if vars(self)[quantity.column] == 0:
                raise UserError(
                    f"data.accuracy.{quantity.column} = 0: a bed of the kind {bed.name} measures this {quantity.name}, "
                    "and nothing measured is exact: choose more than 0, or data.accuracy=estimate."
                )
        return Accuracy.engineering(**vars(self))


def _accuracy(value: Any) -> Any:
    if value == "estimate":
        return None
    if isinstance(value, str):
        raise ValueError("give data.accuracy.force_n=… and so on, or data.accuracy=estimate")
    return value


# None: to be estimated from the data.
StatedAccuracy = Annotated[AccuracySettings | None, BeforeValidator(_accuracy)]


def _hidden(value: Any) -> Any:
    """A list of effect names, {effect: {parameter: SI value}}, random or nothing; lists become mappings."""
    if value is None or value == "random":
        return value
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return {name: {} for name in value}
    if isinstance(value, Mapping):
        numbers = {name: values or {} for name, values in value.items()}
        if all(isinstance(v, Mapping) and all(is_number(x) for x in v.values()) for v in numbers.values()):
            return {str(name): {str(n): float(x) for n, x in v.items()} for name, v in numbers.items()}
    raise ValueError("give a list of effect names, for example [end_clamps], or random")


def is_number(value: Any) -> bool:
    """Whether a value is a number and not a switch."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _effect_values(value: Any) -> Any:
    """{effect: {parameter: number or list of numbers}}; lists become tuples."""
    if value is None:
        return {}
    if isinstance(value, Mapping) and all(not values or isinstance(values, Mapping) for values in value.values()):
        numbers = {
            str(effect): {str(n): tuple(x) if isinstance(x, list) else x for n, x in (values or {}).items()}
            for effect, values in value.items()
        }
        every = [x for values in numbers.values() for x in values.values()]
        if all(is_number(x) or (isinstance(x, tuple) and all(map(is_number, x))) for x in every):
            return numbers
    raise ValueError("give {effect: {parameter: SI value, or a list of one value per sample}}")


@dataclass(frozen=True, config=STRICT)
class VirtualData:
    """The simulated bed. hidden: instead of truth_effects; "random": drawn from the seed."""

    name: Literal["virtual"]
    seed: Seed
    buckled_share: Annotated[float, Field(strict=True, ge=0, lt=1)]
    truth: dict[str, Number]
    truth_effects: Annotated[EffectValues, PlainValidator(_effect_values)]
    hidden: Annotated[dict[str, dict[str, float]] | Literal["random"] | None, PlainValidator(_hidden)]
    accuracy: StatedAccuracy


def _file(value: Any) -> Any:
    return None if value is None else Path(str(value))


OptionalPath = Annotated[Path | None, PlainValidator(_file)]


def _bed(value: Any) -> Any:
    if value not in BEDS:
        raise ValueError(f"choose one of {', '.join(BEDS)}")
    return value


BedName = Annotated[str, PlainValidator(_bed)]


def named_path(lacking: str, find: Callable[[str], Path] = Path) -> PlainValidator:
    """A path that has to be named. lacking: what to add where it is not. find: from the name to the path."""

    def found(value: Any) -> Any:
        if value in UNNAMED:
            raise ValueError(lacking)
        return find(str(value))

    return PlainValidator(found)


@dataclass(frozen=True, config=STRICT)
class CsvData:
    """The user's own table."""

    name: Literal["csv"]
    path: Annotated[Path, named_path("data=csv needs the table's file: add data.path=FILE", example)]
    accuracy: StatedAccuracy
    bed: BedName = KINEMATIC.name
    members: OptionalPath = None


DataSettings = VirtualData | CsvData


@dataclass(frozen=True, config=STRICT)
class ModelSettings:
    """A model's name, where a fit of its parameters starts (SI), and how far off that may be (SI, one standard
    deviation). Those of effects stand there as effect.parameter."""

    name: str
    values: dict[str, Number]
    errors: dict[str, Number] = dataclasses.field(default_factory=dict)


def _model(value: Any) -> Any:
    """The configuration has the parameters beside the name; one with an error is a text."""
    if not isinstance(value, Mapping):
        return value
    values: dict[str, Any] = {}
    for name, given in value.items():
        inside = {f"{name}.{own}": v for own, v in given.items()} if isinstance(given, Mapping) else {name: given}
        values |= {k: v for k, v in inside.items() if k != "name"}
    known = {k: pair for k, v in values.items() if isinstance(v, str) and (pair := plus_minus(v)) is not None}
    values |= {k: pair[0] for k, pair in known.items()}
    return {"name": value.get("name"), "values": values, "errors": {k: pair[1] for k, pair in known.items()}}


@dataclass(frozen=True, config=STRICT)
class SplitSettings:
    """Shares of each sample's rows (with name "states": of its kinematic states) to fit and to stop a fit by; the rest
    is tested on."""

    name: Literal["rows", "states"]
    train: Share
    validation: Share

    def __post_init__(self) -> None:
        if self.train + self.validation >= 1:
            raise ValueError(
                f"split.train = {self.train:g} and split.validation = {self.validation:g} leave nothing to test on: "
                "choose shares with a sum below 1"
            )

    @property
    def by_states(self) -> bool:
        """Whether whole kinematic states stay together."""
        return self.name == "states"


def _fit(value: Any) -> Any:
    if isinstance(value, Mapping) and value.get("name") == "none":
        return None
    return value


def _set(value: Any) -> Any:
    """A set's name; a list of names becomes one name, joined by +."""
    if isinstance(value, list) and value and all(isinstance(name, str) for name in value):
        return "+".join(value)
    if isinstance(value, str) and value:
        return value
    raise ValueError("give a set's name, such as sample3, or a list of names, such as [sample1,sample3]")


def _names(lacking: str) -> PlainValidator:
    """A list of texts, or nothing. lacking: what to give where it is none."""

    def listed(value: Any) -> Any:
        if value is None:
            return ()
        if isinstance(value, list | tuple) and all(isinstance(name, str) for name in value):
            return tuple(value)
        raise ValueError(lacking)

    return PlainValidator(listed)


def _bounds(value: Any) -> Any:
    """{parameter: [lowest, highest]}, a name with a dot as it is or as a mapping in a mapping."""
    if value is None:
        return {}
    said = ValueError("give {parameter: [lowest, highest]} in SI, for example bounds={C1:[1e5,1e6]}")
    if not isinstance(value, Mapping):
        raise said
    flat: dict[str, Any] = {}
    for name, limits in value.items():
        flat |= {f"{name}.{own}": v for own, v in limits.items()} if isinstance(limits, Mapping) else {name: limits}
    for limits in flat.values():
        if not isinstance(limits, list | tuple) or len(limits) != 2 or not all(map(is_number, limits)):
            raise said
    return {str(name): (float(low), float(high)) for name, (low, high) in flat.items()}


def _on(value: Any) -> Any:
    if value in (True, "on"):
        return True
    if value in (False, "off"):
        return False
    raise ValueError("choose on or off")


ParameterNames = Annotated[tuple[str, ...], _names("give a list of parameters, for example fix=[C2]")]
Bounds = Annotated[dict[str, tuple[float, float]], PlainValidator(_bounds)]
OnOff = Annotated[bool, PlainValidator(_on)]
SetName = Annotated[str, PlainValidator(_set)]
EffectNames = Annotated[
    tuple[str, ...], _names("give a list of effect names, for example effects=[end_clamps,twist_offset]")
]
Device = Literal["cpu", "cuda", "auto"]


@dataclass(frozen=True, config=STRICT)
class Settings:
    """What train.py and discover.py share; the fields are the options of conf/train.yaml and conf/discover.yaml.

    per_sample: whether each of several samples, or members, has its own value of what building or mounting it sets.
    bands: whether pictures of curves have the 95 % bands. fix, bounds, material, priors: what is known of parameters
    beforehand (stated_knowledge)."""

    model: Annotated[ModelSettings, BeforeValidator(_model)]
    data: Annotated[DataSettings, Field(discriminator="name")]
    # None: nothing is fitted.
    fit: Annotated[FitOptions | None, BeforeValidator(_fit)]
    split: SplitSettings
    train: SetName
    test: SetName
    effects: EffectNames
    per_sample: Switch
    seed: Seed
    figures: Switch
    bands: Switch
    device: Device
    fix: ParameterNames
    bounds: Bounds
    material: Annotated[str, Field(strict=True)] | None
    priors: OnOff


@dataclass(frozen=True, config=STRICT)
class TrainSettings(Settings):
    """What one run of train.py does. exclude: combinations that a sweep leaves out, {option: value} each."""

    constituent: OptionalPath
    fits: OptionalPath
    exclude: tuple[dict[str, Any], ...]


@dataclass(frozen=True, config=STRICT)
class DiscoverSettings(Settings):
    """What one run of discover.py does. ruled_out: effects that are not tried, because the user knows better. checks:
    whether a failed check of the table stops every claim; off where the user has answered it."""

    ruled_out: EffectNames = ()
    checks: OnOff = True


RAW = named_path("intake needs the laboratory's file, or a folder of them: add data.path=RAW")


@dataclass(frozen=True, config=STRICT)
class IntakeData:
    """A laboratory's file, or the folder of those that a recipe lists."""

    path: Annotated[Path, RAW]


@dataclass(frozen=True, config=STRICT)
class IntakeSettings:
    """What one run of intake.py does. recipe: None to guess and draft one. out: the table; None: in the run folder.
    design: the designs of the actuators, joined by name; None: none, or where the recipe says."""

    data: IntakeData
    recipe: OptionalPath
    out: OptionalPath
    design: OptionalPath = None


def plain(settings: Settings) -> dict[str, Any]:
    """The settings as containers, texts and numbers, in a fixed order: what a digest or a file holds of them."""

    def bare(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {str(k): bare(v) for k, v in value.items()}
        if isinstance(value, list | tuple):
            return [bare(v) for v in value]
        return str(value) if isinstance(value, Path) else value

    return {name: bare(value) for name, value in dataclasses.asdict(settings).items()}
