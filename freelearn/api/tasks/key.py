"""A digest of everything that a command's results depend on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from freelearn.api.settings.settings import Settings, TrainSettings, plain
from freelearn.api.tasks.tables import data_version
from freelearn.errors import UserError
from freelearn.fitting.code_version import code_version
from freelearn.measurements.text_file import add_to_digest
from freelearn.models.own import own_files

# Rooms of the package that results come from; pictures and terminal output cannot change them.
ROOMS = ("measurements", "mechanics", "models", "bed", "fitting", "inference", "answer", "results", "api")


def job_key(settings: Settings) -> str:
    """24 digits: of the settings, the data, the user's own effects and models, a specimen's constants and the code."""
    parts = [type(settings).__name__, json.dumps(plain(settings), sort_keys=True)]
    parts += [data_version(settings.data), code_version(ROOMS)]
    parts += [_content(path) for path in own_files()]
    if isinstance(settings, TrainSettings) and settings.constituent is not None:
        parts.append(_content(settings.constituent))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:24]


def _content(path: Path) -> str:
    digest = hashlib.sha256()
    try:
        add_to_digest(digest, path)
        return digest.hexdigest()
    except UserError:
        return ""  # reading it says what is wrong with the file
