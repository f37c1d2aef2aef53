"""From the arguments of `fit` and `discover` to the settings of the commands, whose configuration has the defaults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from freelearn.api.settings.configuration import composed, offer_own_models
from freelearn.api.settings.parse import Chosen, parse
from freelearn.api.stated_accuracy import Accuracy
from freelearn.api.table_files import TableFile
from freelearn.common.errors import UserError, unknown
from freelearn.common.package import CONF

# One of several files of the configuration, by its name, with options of its own or without.
Group: TypeAlias = "str | Mapping[str, Any]"
# How accurate the bed is: stated, by name, or "estimate".
StatedAccuracy: TypeAlias = "Accuracy | Mapping[str, float] | str | None"
# Arguments that are no option of a command.
OURS = ("table", "design", "recipe", "folder", "progress", "options")
GROUPS = ("model", "split", "fit")
# Of the data, but arguments of their own.
DATA = ("bed", "members")


def options_of(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a command among the arguments of a function, nested ones beside the others; what says nothing
    leaves the configuration's own value."""
    own = {name: value for name, value in arguments.items() if name not in OURS}
    silent = [name for name in ("accuracy", "bed", "members", "data") if own.get(name) is None]
    return {name: value for name, value in own.items() if name not in silent} | dict(arguments["options"])


def settings_of(kind: type[Chosen], name: str, place: TableFile, arguments: Mapping[str, Any]) -> Chosen:
    """The settings of a command. name: of its configuration file. arguments: by name, without the table; one with a dot
    in its name is nested, as on the command line. Raises UserError with every mistake."""
    own = offer_own_models()
    given = {option: _plain(value) for option, value in arguments.items()}
    groups = {group: _group(group, given.pop(group), own) for group in GROUPS if group in given}
    content = composed(
        name, [f"data={place.name}", *(f"{group}={chosen}" for group, (chosen, _) in groups.items() if chosen)]
    )
    for group, (_, more) in groups.items():
        content[group] |= more
    content["data"] |= _data(place, given, content["data"])
    _known(content, given)
    for option in given:
        if "." not in option and option not in content:
            raise unknown("option", option, [*content, *DATA, "accuracy", "design", "recipe", "folder", "progress"])
    for option, value in given.items():
        _put(content, option.split("."), value)
    return parse(kind, content)


def _group(group: str, value: Any, own: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """The name of a group's file, "" for the usual one, and what else is set of it. own: models of the user's own."""
    if not isinstance(value, str | Mapping):
        raise UserError(f"{group} = {value!r} is neither a name nor a mapping of options: give one of them.")
    name = value if isinstance(value, str) else str(value.get("name", ""))
    known = [*sorted(path.stem for path in (CONF / group).glob("*.yaml")), *(own if group == "model" else ())]
    if name and name not in known:
        raise unknown(group, name, known)
    more = {} if isinstance(value, str) else {str(key): each for key, each in value.items() if key != "name"}
    return name, more


def _data(place: TableFile, given: dict[str, Any], usual: Mapping[str, Any]) -> dict[str, Any]:
    """What is said of the data, taken out of what is given."""
    more = given.pop("data", None) or {}
    if not isinstance(more, Mapping):
        raise UserError(f"data = {more!r}: give a mapping of options, such as data={{'seed': 1}}.")
    data = dict(more)
    if place.path is not None:
        data["path"] = str(place.path)
    given.pop("members", None)  # it is the place's
    for option, chosen in (("bed", given.pop("bed", None) or place.bed), ("members", place.members)):
        if chosen is not None:
            data[option] = str(chosen)
    accuracy = given.pop("accuracy", None)
    if isinstance(accuracy, Accuracy):
        accuracy = accuracy.stated()
    if accuracy is None or isinstance(accuracy, Mapping):
        data["accuracy"] = (usual.get("accuracy") or {}) | dict(place.accuracy or {}) | dict(accuracy or {})
    elif accuracy == "estimate":
        data["accuracy"] = accuracy
    else:
        raise UserError(f'accuracy = {accuracy!r}: give fl.Accuracy(force_n=…), a mapping of these, or "estimate".')
    return data


def _known(content: dict[str, Any], given: dict[str, Any]) -> None:
    """What is known of parameters beforehand, where it stands in the configuration."""
    if isinstance(given.get("priors"), Mapping):
        for parameter, known in given.pop("priors").items():
            try:
                mean, deviation = map(float, known)
            except (TypeError, ValueError):
                raise UserError(
                    f"priors[{parameter!r}] = {known!r}: give (mean, standard deviation), SI, such as (1e6, 2e5)."
                ) from None
            content["model"][parameter] = f"{mean!r}±{deviation!r}"
    if isinstance(given.get("fix"), Mapping):
        for parameter, value in given["fix"].items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise UserError(f"fix[{parameter!r}] = {value!r} is not a number: give a value in SI.")
            content["model"][parameter] = float(value)
        given["fix"] = list(given["fix"])


def _put(content: dict[str, Any], names: Sequence[str], value: Any) -> None:
    """One option, or several of a group, in the place of what the configuration has."""
    *above, last = names
    for name in above:
        inside = content.setdefault(name, {})
        if not isinstance(inside, dict):
            raise UserError(f"{'.'.join(names)} is no option here: {name} has no options.")
        content = inside
    if isinstance(value, Mapping) and isinstance(content.get(last), dict):
        content[last] |= value
    else:
        content[last] = value


def _plain(value: Any) -> Any:
    """Numbers of numpy and sequences as Python's own, paths as texts: what a configuration file would hold."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    return value
