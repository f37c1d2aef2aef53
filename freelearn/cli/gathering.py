"""python -m freelearn.gather FOLDER…: the results of finished sweeps as a table and heat maps."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from freelearn.cli.command_line import command_line, exit_on_user_error, installed, program
from freelearn.common.files import write_whole
from freelearn.records.provenance import Provenance
from freelearn.records.run_files import check_folder
from freelearn.records.sweep_records import collect
from freelearn.report.tables.sweep_tables import cells, summary, summary_table
from freelearn.report.terminal.printed_tables import print_line, rich_table


def gather_folders(folders: Sequence[Path], out: Path, console: Console, command: str) -> int:
    """Writes heatmap.csv, summary.csv, report.html, heatmap_<label>.png, heatmaps.png and overview.png to `out`, and
    the pictures to TensorBoard; prints the summary. command: what makes the results again. Returns how many jobs
    failed. Raises UserError."""
    check_folder(out)
    table = collect(folders)
    failed = table[table["error"] != ""]
    good = table[table["error"] == ""]
    grouped = cells(table)
    best = grouped.loc[grouped["best"], ["label", "train", "test"]].assign(best=True)
    written = table.merge(best, on=["label", "train", "test"], how="left").drop(columns="data")
    written["best"] = written["best"].eq(True).where(written["error"] == "")
    write_whole(out / "heatmap.csv", lambda p: written.to_csv(p, index=False, float_format="%.8g"))
    if len(good):
        numbers = summary(table)
        write_whole(out / "summary.csv", lambda p: numbers.to_csv(p, index=False, float_format="%.6g"))
        # matplotlib costs a second to import: only here.
        from freelearn.report.plots.sweep_plots import draw_sweep

        sources = [Provenance.from_plain(data) for data in good["data"]]
        simulated = [source for source in sources if source.simulated]
        pictures = draw_sweep(grouped, numbers, bool(simulated), out)
        from freelearn.report.html.sweep_report import report_sweep

        # Where simulated and measured data meet in one sweep, the page says simulated.
        report_sweep(table, grouped, numbers, (simulated or sources)[0], out, command)
        console.print(rich_table(summary_table(numbers)))
        for path in pictures:
            print_line(console, f"picture: {path}")
    for _, job in failed.iterrows():
        print_line(console, f"! job {job['run']} failed: {job['error']}")
    print_line(console, f"table: {out / 'heatmap.csv'}")
    if len(good):
        curves = command_line([installed("tensorboard"), "--logdir", str(out / "tensorboard")], [])
        print_line(console, f"curves: {curves}")
    return int(failed["run"].nunique())


def main() -> None:
    """Runs the command on the words after its name."""
    parser = argparse.ArgumentParser(
        prog=" ".join(program("gather", ["python", "-m", "freelearn.gather"])),
        description="Gather the results of finished sweeps into heatmap.csv, summary.csv and heat maps. Several sweeps "
        "(of several seeds, say) are gathered together: mean and standard deviation over seeds.",
    )
    parser.add_argument("folder", nargs="+", type=Path, help="a sweep's folder, whose subfolders are its jobs")
    parser.add_argument("--out", type=Path, help="where to write (default: the first folder)")
    arguments = parser.parse_args()
    command = command_line(program("gather", ["python", "-m", "freelearn.gather"]), sys.argv[1:])
    with exit_on_user_error("interrupted before all was gathered.", arguments.out or arguments.folder[0]):
        gather_folders(arguments.folder, arguments.out or arguments.folder[0], Console(), command)
