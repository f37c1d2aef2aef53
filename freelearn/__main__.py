"""freelearn train | discover | intake | gather | figures | specimens | workbench: the commands, in any folder."""

from __future__ import annotations

import importlib
import sys

from freelearn.package import VERSION

# What each command does, and the function that runs it on the words after its name. Named and not imported: each of
# them loads only what it needs.
COMMANDS = {
    "train": ("fit one model on one training set and evaluate it", "freelearn.commands.app", "train_app"),
    "discover": ("find the physical effects that a model misses", "freelearn.commands.app", "discover_app"),
    "predict": ("fill in the blanks of a table with a fitted model", "freelearn.commands.predict", "predict_app"),
    "plan": ("which rows to measure next", "freelearn.commands.plan", "plan_app"),
    "referee": ("whether what a run claims stands", "freelearn.commands.referee", "referee_app"),
    "export": (
        "a fitted model for other software: onnx, c, fmu, mujoco, table",
        "freelearn.commands.export",
        "export_app",
    ),
    "intake": ("a laboratory's raw file as a measurement table", "freelearn.commands.intake", "intake_app"),
    "gather": ("the results of finished sweeps as a table and heat maps", "freelearn.commands.gather", "main"),
    "figures": ("the paper's other figures and tables from a sweep or a run", "freelearn.commands.figures", "main"),
    "specimens": ("fit the rubber to its own tests", "freelearn.commands.specimens", "main"),
    "workbench": ("the whole loop with the mouse, on a page of this machine", "freelearn.workbench.__main__", "main"),
}


def main() -> None:
    """Runs the command that the command line names."""
    name, words = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("--help", [])
    if name in ("--version", "-V"):
        print(f"freelearn {VERSION}")
        return
    if name in ("--help", "-h"):
        print(_usage())
        return
    if name not in COMMANDS:
        sys.exit(f"error: no command {name!r}.\n{_usage()}")
    _, module, function = COMMANDS[name]
    sys.argv = [f"freelearn {name}", *words]
    getattr(importlib.import_module(module), function)()


def _usage() -> str:
    lines = [f"  {name:<10} {about}" for name, (about, _, _) in COMMANDS.items()]
    return "\n".join(["usage: freelearn COMMAND …, freelearn COMMAND --help", *lines])


if __name__ == "__main__":
    main()
