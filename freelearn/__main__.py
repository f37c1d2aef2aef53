"""freelearn train | discover | intake | gather | figures | specimens | workbench: the commands, in any folder."""

from __future__ import annotations

import importlib
import sys

from freelearn.cli.command_line import called
from freelearn.cli.command_names import COMMANDS
from freelearn.common.package import VERSION


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
    sys.argv = [called(name), *words]
    getattr(importlib.import_module(module), function)()


def _usage() -> str:
    lines = [f"  {name:<10} {about}" for name, (about, _, _) in COMMANDS.items()]
    return "\n".join(["usage: freelearn COMMAND …, freelearn COMMAND --help", *lines])


if __name__ == "__main__":
    main()
