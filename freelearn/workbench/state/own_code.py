"""The user's own effects and models on the page."""

from __future__ import annotations

import os

from freelearn.cli.command_line import OWN_CODE
from freelearn.workbench.state.question import MODELS

# The models to choose from.
_models = list(MODELS)


def load_named_code() -> None:
    """Registers what the environment's files hold, so that it can be chosen and its checkpoints opened.

    Raises UserError.
    """
    if not any(os.environ.get(name) for name in OWN_CODE):
        return
    # Here, not above: torch is imported with them; without own code the page is there sooner.
    from freelearn.api.settings.configuration import offer_own_models
    from freelearn.physics.models.own_files import load_own_code

    load_own_code()
    _models[:] = [*MODELS, *offer_own_models()]


def models() -> list[str]:
    """Names of the models to choose from."""
    return list(_models)
