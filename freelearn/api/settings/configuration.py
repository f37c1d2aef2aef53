"""The configuration files, and what they amount to with the choices of a user."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from freelearn.api.settings.parse import Chosen, parse
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings, quoted
from freelearn.common.errors import UserError, unknown
from freelearn.common.package import CONF

# What a folder to write to is called elsewhere.
FOLDERS = ("out", "output", "outputs", "folder", "dir")
# Configuration file of each kind of settings.
FILES: dict[type, str] = {TrainSettings: "train", DiscoverSettings: "discover"}


def composed(name: str, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Plain values of the configuration file `name` with overrides as on the command line. Raises UserError."""
    with _composing():
        try:
            config = compose(name, [quoted(word) for word in overrides])
            content: Any = OmegaConf.to_container(config, resolve=True)
        except (HydraException, OmegaConfBaseException, ValueError, RecursionError) as problem:
            raise UserError(uncomposed(problem)) from None
    return dict(content)


def uncomposed(problem: Exception) -> str:
    """Why a configuration was not composed, from what the composing raised."""
    if isinstance(problem, RecursionError):
        return "A value of the command line is nested too deeply: write it with fewer brackets."
    return str(problem).strip()


def mistyped(name: str, problem: Exception) -> UserError | None:
    """The mistake of an option that the configuration file `name` does not have, with the one that was meant, perhaps;
    None where the problem is another one."""
    found = re.match(r"Could not override '([^']+)'", str(problem))
    if not found:
        return None
    *above, last = found[1].split(".")
    content: Any = composed(name)
    for option in above:
        content = content.get(option) if isinstance(content, dict) else None
    if not isinstance(content, dict) or last in content:
        return None
    mistake = unknown("option", found[1], [".".join([*above, option]) for option in content])
    return UserError(f"{mistake} hydra.run.dir=FOLDER says where to write.") if last in FOLDERS else mistake


def settings(kind: type[Chosen], overrides: Sequence[str] = ()) -> Chosen:
    """Settings from the configuration files and overrides. Raises UserError."""
    offer_own_models()
    return parse(kind, composed(FILES[kind], overrides))


def offer_own_models() -> list[str]:
    """Makes `model=NAME` possible for the models in the files that the user's environment names; their names.

    Raises UserError.
    """
    if not os.environ.get("FREELEARN_MODELS"):
        return []
    # Here, not above: torch is imported with them, and without own models nothing needs it this early.
    from freelearn.physics.models.build import MODELS
    from freelearn.physics.models.own_files import load_own_code

    own = [MODELS[name] for name in load_own_code() if name in MODELS]
    for model in own:
        node = {"name": model.name} | {p.name: p.start for p in model.parameter_class.records()}
        ConfigStore.instance().store(group="model", name=model.name, node=node)
    return [model.name for model in own]


@contextmanager
def _composing() -> Iterator[None]:
    if not CONF.is_dir():
        raise UserError(f"No configuration files at {CONF}: install freelearn again.")
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(CONF), version_base="1.3"):
        yield
