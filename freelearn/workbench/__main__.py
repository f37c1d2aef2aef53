"""`python -m freelearn.workbench`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from freelearn.cli.command_line import program


def main() -> None:
    """Serves the page until interrupted."""
    parser = argparse.ArgumentParser(
        prog=" ".join(program("workbench", ["python", "-m", "freelearn.workbench"])),
        description="A page on this machine: load measurements, fit, see where the model fails and which effect is "
        "missing, add it, watch the error fall. Only this machine can open it.",
    )
    parser.add_argument("--port", type=int, default=5006, help="of the address http://localhost:PORT (default 5006)")
    parser.add_argument(
        "--folder", type=Path, default=Path("outputs/workbench"), help="where its files go (default outputs/workbench)"
    )
    parser.add_argument(
        "--sweeps", type=Path, default=Path("outputs"), help="where finished sweeps are looked for (default outputs)"
    )
    parser.add_argument("--no-browser", action="store_true", help="do not open a browser window")
    chosen = parser.parse_args()
    from freelearn.common.errors import UserError

    try:
        from freelearn.workbench.server import serve

        serve(chosen.port, chosen.folder, chosen.sweeps, not chosen.no_browser)
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    except ModuleNotFoundError as missing:
        if missing.name != "panel":
            raise
        sys.exit('error: the workbench needs Panel: pip install "freelearn[workbench]".')


if __name__ == "__main__":
    main()
