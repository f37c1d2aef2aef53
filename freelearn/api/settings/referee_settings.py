"""What `referee` was asked to do, checked once and frozen. As light to import as the settings of the other commands."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from freelearn.api.settings.predict_settings import RunPath
from freelearn.api.settings.settings import STRICT, Seed

Count = Annotated[int, Field(strict=True, ge=1)]
# Without and with the last effect: less than one of each tells nothing.
Tables = Annotated[int, Field(strict=True, ge=2)]


@dataclass(frozen=True, config=STRICT)
class RefereeSettings:
    """What one referee does. run: the folder of a run. referee: the standing checks alone, or searches of simulated
    tables too, so many `tables`, on so many `cores`; None: all."""

    run: RunPath
    referee: Literal["standing", "simulate"] = "standing"
    tables: Tables = 40
    cores: Count | None = None
    seed: Seed = 0
