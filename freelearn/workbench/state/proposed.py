"""Effects that a search of the session wrote: read again from what it left, and checked. Runs none of their files."""

from __future__ import annotations

import ast
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from freelearn.common.errors import UserError
from freelearn.physics.written.forms import ENERGIES, ONE, TWO, Form, Shape, amount
from freelearn.physics.written.places import PLACES
from freelearn.physics.written.source import source
from freelearn.physics.written.written_effect import Written, scaled
from freelearn.records.written_effects import PROPOSED

FILE = re.compile(rf"{PROPOSED}_([a-z0-9_]+)\.py")
FOLDER = re.compile(r"discover_[0-9a-f]{10}")
# Files that a search writes are far shorter.
LONGEST = 2**16
# Of two numbers that are the same but for rounding.
ROUNDING = 1e-9

Bounds = dict[str, dict[str, float]]


@dataclass(frozen=True)
class Proposed:
    """path: of its file. entry: what discovery.json says of it. written: the same, to be built again."""

    path: Path
    entry: dict[str, Any]
    written: Written


def proposed(path: Path, folder: Path) -> Proposed:
    """The effect in a file that a search of the session in `folder` wrote. Raises UserError for any other file: one
    that lies elsewhere, that discovery.json does not know, or whose code is not what the program writes for it."""
    # Where links lead to.
    real = path.resolve()
    own = FILE.fullmatch(real.name)
    inside = FOLDER.fullmatch(real.parent.name) and real.parent.parent == folder.resolve()
    if not own or not inside or not real.is_file():
        raise _strange(path)
    entry = _entry(real.parent, own.group(1))
    found = entry and written_of(entry)
    if not entry or not found:
        raise _strange(path)
    try:
        # As bytes: what Python would run may be in another encoding, which the file says itself.
        tree = ast.parse(real.read_bytes()) if real.stat().st_size <= LONGEST else None
    except (OSError, SyntaxError, ValueError, RecursionError):
        tree = None
    if tree is None:
        raise _strange(path)
    found = _bounded(found, _bounds(tree))
    for each in (False, True):
        written = replace(found, each=each)
        if _alike(_bare(tree), _bare(ast.parse(source(written)))):
            return Proposed(real, entry, written)
    raise _strange(path)


def _strange(path: Path) -> UserError:
    return UserError(f"{path.name} is not as a search of this session wrote it: search again.")


def _entry(folder: Path, name: str) -> dict[str, Any] | None:
    """What discovery.json says of a proposal."""
    try:
        content = json.loads((folder / "discovery.json").read_text(encoding="utf-8"))
        entries = content["proposals"] if content["verdict"] == "proposed" else []
        return next((dict(entry) for entry in entries if entry["name"] == name), None)
    except (OSError, ValueError, TypeError, KeyError):
        return None


def written_of(entry: Mapping[str, Any]) -> Written | None:
    """The effect that an entry of discovery.json tells of, made of the program's own places, inputs and forms; None
    where it tells of none of these."""
    try:
        place = next(p for p in PLACES if (p.port, p.where) == (entry["port"], entry["where"]))
        known = {i.name: i for i in place.inputs}
        inputs = tuple(known[name] for name in entry["in_units_of"])
        scales = tuple(float(about["value"]) for about in entry["in_units_of"].values())
        starts = {str(name): float(about["value"]) for name, about in entry["parameters"].items()}
        if not all(map(math.isfinite, (*scales, *starts.values()))) or not all(scales):
            return None
        forms = ENERGIES if place.energy else ONE if len(inputs) == 1 else TWO
        able = (Written(place, inputs, scales, form, starts) for form in forms if _constants(form) == set(starts))
        return next(w for w in able if (w.name, w.formula) == (entry["name"], entry["formula"]))
    except (StopIteration, KeyError, TypeError, ValueError, AttributeError):
        return None


def _constants(form: Form) -> set[str]:
    """Names of a form's constants."""
    return {amount(i) for i in range(len(form.terms))} | {shape.name for shape in form.shapes}


# --- the file's code, as a tree that is only looked at --------------------------------------------------------------


def _bounds(tree: ast.Module) -> Bounds:
    """Bounds of each constant, as numbers, where the file says some."""
    found: Bounds = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and isinstance(node.value, ast.Call):
            given = {k.arg: _number(k.value) for k in node.value.keywords if k.arg in ("lower", "upper")}
            found[node.target.id] = {name: value for name, value in given.items() if name and value is not None}
    return found


def _number(node: ast.expr) -> float | None:
    try:
        value = float(ast.literal_eval(node))
    except (ValueError, TypeError, RecursionError):
        return None
    return value if math.isfinite(value) else None


def _bounded(written: Written, bounds: Bounds) -> Written:
    """The same with a file's bounds: they are as wide as the measurements could tell."""

    def own(shape: Shape) -> Shape:
        size, said = scaled(shape, written.scales[shape.place]), bounds.get(shape.name, {})
        lower, upper = said.get("lower", shape.lower * size), said.get("upper", shape.upper * size)
        return replace(shape, lower=lower / size, upper=upper / size)

    return replace(written, form=replace(written.form, shapes=tuple(map(own, written.form.shapes))))


def _bare(tree: ast.Module) -> ast.Module:
    """The code without what it tells readers."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and _says(body[0].value):
            del body[0]
    return tree


def _says(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _alike(one: Any, other: Any) -> bool:
    """Whether two trees are the same, but for the rounding of their numbers."""
    if type(one) is not type(other):
        return False
    if isinstance(one, ast.AST):
        return all(_alike(getattr(one, f, None), getattr(other, f, None)) for f in one._fields)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(_alike, one, other))
    return math.isclose(one, other, rel_tol=ROUNDING) if isinstance(one, float) else bool(one == other)
