"""`start` from the words of the command line, and the command that goes on from what it made."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from freelearn.cli.command_line import ESTIMATED, called, exit_on_user_error, option
from freelearn.common.errors import UserError
from freelearn.common.files import check_there


def main() -> None:
    """`start`, from the words of the command line."""
    parser = argparse.ArgumentParser(
        prog="freelearn start",
        description="Asks what a laboratory's file does not say, keeps the answers as a recipe, makes the table, and "
        "searches for the physics that a model of it misses. Ends with a report. Tests of rubber alone may be several "
        "files, or the sheets of one.",
    )
    parser.add_argument("raw", type=Path, nargs="+", help="the file: text, Excel, OpenDocument, MATLAB, HDF5, Parquet")
    parser.add_argument(
        "--run", type=Path, help="a fitted run, of which the file asks: pressures for a trajectory, loads"
    )
    parser.add_argument("--design", type=Path, help="designs of several actuators, a file with a row for each")
    parser.add_argument("--recipe", type=Path, help="of an earlier start: nothing is asked again")
    parser.add_argument("--out", type=Path, help="folder for all that is made; by default outputs/start/DAY/TIME")
    asked = parser.parse_intermixed_args()
    # What has an equals sign and is no file is an option of the search.
    options = [str(word) for word in asked.raw if "=" in str(word) and not word.exists()]
    raws = [word for word in asked.raw if str(word) not in options]
    if not raws:
        parser.error("name a raw file")
    with exit_on_user_error("interrupted; no table was written."):
        check_there(*raws, asked.design, asked.recipe)
        if asked.run is not None and not os.path.isdir(asked.run):
            raise UserError(f"No folder at {asked.run}: give that of a run of train or discover, --run FOLDER.")
        if options and asked.run is None:
            _check(options, raws[0])
    # After the paths are checked: pandas and pint take a second to import.
    from rich.console import Console

    from freelearn.cli.start_command import start

    now = datetime.now()
    folder = asked.out or Path("outputs", "start", f"{now:%Y-%m-%d}", f"{now:%H-%M-%S-%f}")
    with exit_on_user_error("interrupted; no table was written."):
        following = start(raws, folder, Console(), input, asked.design, asked.recipe, asked.run)
    # The search is a command of its own, with its settings, its report and its way of going on after an interruption.
    if following.command == "specimens":
        sys.argv = [called("specimens"), *following.words, "--out", str(folder)]
        from freelearn.cli.specimen_fits import main as specimens

        specimens()
        return
    if following.command == "predict":
        sys.argv = [called("predict"), *following.words, *options, option("hydra.run.dir", folder)]
        from freelearn.cli.run_commands import predict_app

        predict_app()
        return
    # What is stated of the accuracy takes the place of an estimate.
    stated = any(word.startswith("data.accuracy") for word in options)
    words = [word for word in following.words if not (stated and word == ESTIMATED)]
    sys.argv = [called("discover"), *words, *options, option("hydra.run.dir", folder)]
    from freelearn.cli.fit_commands import discover_app

    discover_app()


def _check(options: Sequence[str], raw: Path) -> None:
    """Options of the search are wrong before anything is asked, or not at all. Raises UserError."""
    from freelearn.api.settings.configuration import settings
    from freelearn.api.settings.settings import DiscoverSettings

    settings(DiscoverSettings, ["data=csv", option("data.path", raw), *options])
