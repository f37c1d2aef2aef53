"""`make bench`: every speed that the project promises, each beside its peer in the same run. Quote the ratios."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmark import commands, exported, fits, judging, log_peers, long_logs, models, page, search
from rich.console import Console
from rich.table import Table

from freelearn.common.cores import configure_runtime

ALL = {
    "forward": models.forward,
    "effects": models.effects,
    "large": models.large,
    "fit": fits.fit_continuum,
    "thirty": fits.study,
    "network": fits.network,
    "discovery": search.discovery,
    "referee": judging.referee,
    "command": commands.command,
    "demo": commands.demo,
    "study": commands.study,
    "memory": commands.memory,
    "reports": commands.reports,
    "page": page.page,
    "playback": page.playback,
    "export": exported.exported,
    "logs": log_peers.peers,
    "long_logs": long_logs.long_logs,
}


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/benchmark", description=__doc__)
    parser.add_argument("only", nargs="*", metavar="NAME", help=f"some of {', '.join(ALL)} (default: all)")
    chosen = parser.parse_args().only or list(ALL)
    if unknown := set(chosen) - set(ALL):
        sys.exit(f"error: no benchmark {', '.join(sorted(unknown))}: choose from {', '.join(ALL)}.")
    configure_runtime()
    console = Console()
    table = Table(title="freelearn benchmarks, one thread")
    for heading in ("what", "measured", "target", "detail"):
        table.add_column(heading)

    def report(what: str, measured: str, target: str, detail: str = "") -> None:
        table.add_row(what, measured, target, detail)
        console.print(f"{what}: {measured} {f'(target {target})' if target else ''} {detail}", highlight=False)

    for name in chosen:
        ALL[name](report)
    console.print(table)
    console.print(f"peak memory of this process {commands.peak():.2f} GiB")


if __name__ == "__main__":
    main()
