"""specimen.json: a rubber's fitted parameters, written whole and read back by whoever uses them unfitted."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from freelearn.common.errors import UserError
from freelearn.common.files import read_text, write_text
from freelearn.fitting.rubber_fit import RubberFit
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.models.rubber import Rubber
from freelearn.records.provenance import OWN, as_written, with_digests


def write_result(
    path: Path, fit: RubberFit, files: list[dict[str, str]], apart: Mapping[str, float] | None = None
) -> None:
    """Writes a fit: effects, parameters {name: {value, stderr, unit}}, modes {mode: {error, n, fitted}}, data.

    Errors are shares of a mode's largest stress (0.05 is 5 %), n counts stresses; numbers that do not exist are null.
    Of recordings, which stand among the modes by their names, parameters have a 95 % interval, too; relaxation holds
    its kind, whether it is softened, its span_s and its parameters; apart is each test's error when the others alone
    are fitted, its held_out.
    """
    relaxation = fit.rubber.relaxation
    parameters: dict[str, dict[str, Any]] = {
        name: {"value": value, "stderr": _number(fit.stderr[name]), "unit": fit.rubber.declared[name].unit}
        for name, value in fit.values.items()
    }
    modes: dict[str, dict[str, Any]] = {
        mode: {"error": _number(e.error), "n": e.n, "fitted": e.fitted} for mode, e in fit.modes.items()
    }
    recorded: dict[str, Any] = {}
    if relaxation:
        for name, ends in fit.intervals.items():
            parameters[name]["interval"] = [_number(end) for end in ends]
        for name, error in (apart or {}).items():
            modes[name]["held_out"] = _number(error)
        of = {"kind": relaxation.kind, "softened": relaxation.softened, "span_s": list(relaxation.span)}
        recorded["relaxation"] = {**of, "parameters": {name: parameters.pop(name) for name in relaxation.declared}}
    content = {
        "effects": [effect.name for effect in fit.rubber.effects],
        "parameters": parameters,
        **recorded,
        "at_bound": fit.at_bound,
        "error": fit.error,
        "modes": modes,
        "outcome": fit.message,
        "data": files,
    }
    whole = with_digests(content, path.parent)
    write_text(path, json.dumps(whole, indent=2, allow_nan=False, ensure_ascii=False) + "\n")


def load_parameters(path: str | Path) -> dict[str, float]:
    """The parameters of a specimen.json in SI, by the continuum model's names: C1, wall_stiffening.C20, … Of recordings
    those of the rubber at rest.

    Raises UserError where the file is missing, is no specimen.json, names effects or parameters that do not exist,
    or holds a value that is no number, outside its bounds or in another unit.
    """
    content = _content(path)
    stored, effects = content.get("parameters"), content.get("effects")
    if not isinstance(stored, dict) or not isinstance(effects, list) or "modes" not in content:
        raise UserError(
            f"{path} is not a specimen.json (it has no parameters, effects and modes): "
            "make one with python -m freelearn.specimens."
        )
    try:
        declared = Rubber([str(name) for name in effects]).declared
    except UserError as mistake:
        raise UserError(f"{path} cannot be used: {mistake}") from None
    for name in stored.keys() ^ declared.keys():
        problem = "is missing" if name in declared else "belongs to none of its effects"
        raise UserError(f"Parameter {name} {problem} in {path}: fit the specimen again.")
    return {name: _value(path, name, stored[name], parameter) for name, parameter in declared.items()}


def _content(path: str | Path) -> Mapping[str, Any]:
    with suppress(OSError):
        if not Path(path).exists():
            shown = repr(str(path))[1:-1]
            raise UserError(f"There is no file {shown}: make it with python -m freelearn.specimens … --out FOLDER.")
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError):
        raise UserError(f"{path} is not a JSON file: name a specimen.json.") from None
    if not isinstance(content, dict):
        return {}
    if not as_written(content):
        raise UserError(
            f"{path} is not as it was written: fit the specimen again, or take {OWN!r} out of it where you changed it."
        )
    return content


def _value(path: str | Path, name: str, entry: Any, parameter: Parameter) -> float:
    value = entry.get("value") if isinstance(entry, dict) else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not parameter.allows(value):
        limits = f"{parameter.lower:g} … {parameter.upper:g}"
        raise UserError(f"{name} in {path} is {value!r}: it must be a number in {limits} {parameter.unit}.")
    if entry.get("unit") != parameter.unit:
        raise UserError(f"{name} in {path} is in {entry.get('unit')!r}: convert it to {parameter.unit!r}.")
    return float(value)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
