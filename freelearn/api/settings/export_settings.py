"""What `export` was asked to do, checked once and frozen. As light to import as the settings of the other commands."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from freelearn.api.settings.predict_settings import RunPath
from freelearn.api.settings.settings import STRICT, Switch


def _told(value: Any) -> Any:
    """A format, or what to do where none is named."""
    if value in (None, "", "???"):
        raise ValueError("to is missing: add to=onnx, to=c, to=fmu, to=mujoco or to=table")
    return value


Format = Annotated[Literal["onnx", "c", "fmu", "mujoco", "table"], BeforeValidator(_told)]
Share = Annotated[float, Field(strict=True, gt=0, lt=1)]
Sample = Annotated[int, Field(strict=True)]


@dataclass(frozen=True, config=STRICT)
class ExportSettings:
    """What one export does: as export.options.Options, of the run in a folder."""

    run: RunPath
    to: Format
    name: str = "actuator"
    sample: Sample | None = None
    force: Switch = False
    license: str | None = None
    error: Share = 1e-3
