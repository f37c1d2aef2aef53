"""What Hydra calls around a multirun. Imported at every start, so everything heavy is imported when it is needed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback


class GatherSweep(Callback):
    """Gathers a multirun's results when it ends; exit code 1 when jobs failed."""

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Says where the sweep's files go."""
        print(f"sweep: {config.hydra.sweep.dir} (the same command with hydra.sweep.dir=… resumes it)", flush=True)

    def on_multirun_end(self, config: Any, **_: Any) -> None:
        """Gathers; exits with code 1 where jobs failed."""
        from rich.console import Console

        from freelearn.commands.command_line import command_line, program
        from freelearn.commands.gather import gather_folders
        from freelearn.errors import UserError

        folder = Path(config.hydra.sweep.dir)
        command = command_line([*program("train"), "-m"], config.hydra.overrides.task)
        try:
            failed = gather_folders([folder], folder, Console(), command)
        except UserError as mistake:
            sys.exit(f"error: {mistake}")
        if failed:
            sys.exit(f"error: {failed} jobs failed: see the column error in {folder / 'heatmap.csv'}")
