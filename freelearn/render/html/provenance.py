"""Where numbers come from: data, versions, and how to repeat them."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version

from freelearn.fitting.code_version import code_version
from freelearn.package import VERSION
from freelearn.render.html.page import Section
from freelearn.results.origin import Provenance

LIBRARIES = ("torch", "lightning", "hydra-core", "numpy", "pandas", "scipy")


def provenance_section(provenance: Provenance, command: str, facts: Mapping[str, object]) -> Section:
    """facts: what else belongs here, such as the seed. command: the shell command that repeats it."""
    lines = [provenance.sentence(), *(f"{name}: {value}" for name, value in facts.items())]
    lines.append(_versions())
    return Section("Where this comes from, and how to repeat it", lines, code=command)


@lru_cache
def _versions() -> str:
    """Of this package, Python and what the numbers hang on. A sweep's jobs ask for them again and again."""
    versions = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    code = f"freelearn {VERSION} (code {code_version()[:12]})"
    return f"{code}, Python {platform.python_version()}, {versions}"
