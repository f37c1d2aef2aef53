"""Where numbers come from: data, versions, and how to repeat them."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

import freelearn
from freelearn.fit.store import code_version
from freelearn.render.html.page import Section

LIBRARIES = ("torch", "lightning", "hydra-core", "numpy", "pandas", "scipy")


def provenance_section(data: dict[str, Any], command: str, facts: dict[str, Any]) -> Section:
    """data: where the table came from (see data.source). facts: what else belongs here, such as the seed."""
    if data.get("simulated"):
        lines = [f"Data: simulated bed, seed {data['seed']}. Nothing in it was measured."]
    else:
        lines = [f"Data: {data['path']}, SHA-256 {data['sha256']}"]
    lines += [f"{name}: {value}" for name, value in facts.items()]
    versions = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    code = f"freelearn {freelearn.__version__} (code {code_version()[:12]})"
    lines.append(f"{code}, Python {platform.python_version()}, {versions}")
    return Section("Where this comes from, and how to repeat it", lines, code=command)
