"""Where a table came from: the raw files, the recipe, and every conversion."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from freelearn.measurements.intake.assemble import Intake
from freelearn.measurements.intake.recipe import Recipe
from freelearn.package import VERSION


def provenance(
    intake: Intake,
    recipe: Recipe,
    data: Path,
    sources: Mapping[str, bytes],
    recipe_path: Path,
    recipe_text: str,
    designs: Mapping[Path, bytes] | None = None,
) -> dict[str, Any]:
    """Plain values for JSON. data: the file or folder that was taken in. designs: the file of designs, if any."""
    folder = data if data.is_dir() else data.parent
    raw = [{"path": str(folder / name), "sha256": _digest(content)} for name, content in sources.items()]
    return {
        "program": f"freelearn {VERSION}",
        "raw": raw,
        "designs": [{"path": str(path), "sha256": _digest(content)} for path, content in (designs or {}).items()],
        "recipe": {"path": str(recipe_path), "sha256": _digest(recipe_text.encode()), "content": recipe_text},
        "about": recipe.about,
        "bed": recipe.bed,
        "constants": dict(recipe.constants),
        "samples": {str(number): dict(of) for number, of in recipe.samples.items()},
        "members": [dict(member.constants) for member in recipe.members],
        "plateaus": _plateaus(recipe),
        "state_tolerance": dict(recipe.state_tolerance),
        "rows": len(intake.table),
        "files": [_of_file(recipe, file) for file in intake.files],
        "warnings": list(intake.warnings),
    }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _plateaus(recipe: Recipe) -> dict[str, Any] | None:
    if recipe.plateaus is None:
        return None
    of = recipe.plateaus
    return {"of": dict(of.of), "settle": of.settle, "least": of.least}


def _of_file(recipe: Recipe, file: Mapping[str, Any]) -> dict[str, Any]:
    constants = next((dict(part.constants) for part in recipe.files if part.name == file["file"]), {})
    return {**file, "constants": constants}
