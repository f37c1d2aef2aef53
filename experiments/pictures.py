"""python experiments/pictures.py [NAME …]: the pictures of README and docs, drawn anew by the commands that they show.

Without names all that need no laboratory data; with --data FOLDER also those of measured data sets. The pictures of the
effects come from effect_gallery.py, those of the benchmark from hidden_effects, which takes hours.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "experiments" / "real_data"))

from first_files import ANSWERS  # noqa: E402
from rich.progress import track  # noqa: E402
from sets import SETS  # noqa: E402

# {work}: where runs go; {data}: the laboratory data.
STORY = ["discover.py", "data.hidden=random", "data.seed=7", "train=sample3", "hydra.run.dir={work}/story"]


@dataclass(frozen=True)
class Drawn:
    """commands: after `python`, in order; pictures: of docs, each by where the commands leave it. after: what has to be
    drawn before, for the commands go on from its run. answers: what is typed to their questions."""

    commands: list[list[str]]
    pictures: dict[str, str]
    after: str = ""
    answers: str = ""

    @property
    def measured(self) -> bool:
        """Whether it needs the laboratory data."""
        return any("{data}" in word for command in self.commands for word in command)


ALL = {
    "story": Drawn(
        [STORY],
        {f"story/{n}": f"story/{n}" for n in ("staircase", "residuals_before", "residuals_after", "curves_2")},
    ),
    "stiffness": Drawn(
        [["predict.py", "run={work}/story", "maps=true", "hydra.run.dir={work}/stiffness"]],
        {"predict/stiffness": "stiffness/stiffness"},
        after="story",
    ),
    "plan": Drawn(
        [["experiments/plan/story.py", "49", "{work}/plan", "--rows", "12"]],
        {"plan/places": "plan/plan/plan_places"},
    ),
    "beyond": Drawn(
        [["experiments/beyond_library/story.py", "--out", "{work}/beyond", "--search"]],
        {"beyond/staircase": "beyond/search/staircase", "beyond/proposal": "beyond/search/proposal_*"},
    ),
    "commanded": Drawn(
        [
            [
                *("experiments/predictions", "--only", "commanded", "--data", "{data}"),
                *("--picture", "{work}/commanded/commanded.png"),
            ],
        ],
        {"predict/commanded": "commanded/commanded"},
    ),
} | {
    one.recipe: Drawn(
        [["experiments/real_data", "{data}", one.recipe, "--out", "{work}/real", "--only-search"]],
        {f"real_data/{one.recipe}_{n}": f"real/{one.recipe}/{n}" for n in ("staircase", "curves_1")},
    )
    for one in SETS
}  # fmt: skip
ALL["reachable_poses"] = Drawn(
    [["predict.py", "run={work}/real/parallel_free_end", "maps=true", "hydra.run.dir={work}/poses"]],
    {"predict/reachable_poses": "poses/reachable_poses"},
    after="parallel_free_end",
)


def started(name: str, picture: str, *words: str, data: bool = False, after: str = "") -> Drawn:
    """The picture of an answer to a raw file of first_files.py. data: whether it is made of measured data."""
    stem = Path(name).stem.lower()
    made = ["experiments/first_files.py", "{work}/first", *(["--data", "{data}"] if data else [])]
    start = ["-m", "freelearn", "start", f"{{work}}/first/{name}", *words, "--out", f"{{work}}/{stem}"]
    return Drawn([made, start], {f"starts/{stem}": f"{stem}/{picture}"}, after, "\n".join(ANSWERS[name]) + "\n")


BRAIDED = ("effects=[fiber_misalignment]", "ruled_out=[force_gain,pressure_gain]")
STATED = tuple(f"data.accuracy.{of}" for of in ("force_n=3", "elongation_mm=0.3", "pressure_kpa=1"))
ALL |= {
    "muskel": started("Muskel.xlsx", "curves_1", *BRAIDED, *STATED),
    "bahn": started("Bahn.xlsx", "answers", "--run", "{work}/muskel", after="muskel"),
    "free": started("free.mat", "curves_1"),
    "three": started("three.mat", "curves_1"),
    "treloar": started("Treloar.xlsx", "curves", data=True),
    "artery": started("artery.csv", "curves_1"),
}


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/pictures.py", description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(ALL)}")
    parser.add_argument("--data", type=Path, help="where the measured data lie")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="where the pictures go")
    parser.add_argument("--work", type=Path, help="where the runs go; a temporary folder by default")
    asked = parser.parse_args()
    if unknown := set(asked.names) - set(ALL):
        sys.exit(f"error: no picture {', '.join(sorted(unknown))}: choose from {', '.join(ALL)}.")
    names = asked.names or [name for name in ALL if asked.data or not needs_data(name)]
    if asked.data is None and (without := [name for name in names if needs_data(name)]):
        sys.exit(f"error: {', '.join(without)}: name the folder of the measured data, --data FOLDER.")
    names = list(dict.fromkeys(n for name in names for n in (ALL[name].after, name) if n))
    places = {"work": (asked.work or Path(tempfile.mkdtemp())).resolve(), "data": asked.data and asked.data.resolve()}
    for name in track(names, description="pictures"):
        draw(ALL[name], asked.docs, places)
    print(f"pictures: {asked.docs}, runs: {places['work']}")


def needs_data(name: str) -> bool:
    """Whether the picture, or what it goes on from, needs the laboratory data."""
    return ALL[name].measured or (bool(ALL[name].after) and needs_data(ALL[name].after))


def draw(drawn: Drawn, docs: Path, places: dict[str, Path | None]) -> None:
    """Runs the commands and copies their pictures; those that a run has no reason to draw stay away."""
    for command in drawn.commands:
        words = [word.format(**places) for word in command]
        asked = {"cwd": ROOT, "input": drawn.answers}
        done = subprocess.run([sys.executable, *words], **asked, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"error: python {' '.join(words)}\n{done.stderr.strip() or done.stdout.strip()}")
    work = places["work"]
    assert work is not None
    for name, source in drawn.pictures.items():
        found = sorted(work.glob(f"{source}.png"))
        if found and (docs.resolve() != ROOT / "docs" or (docs / f"{name}.png").exists()):
            (docs / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(found[0], docs / f"{name}.png")


if __name__ == "__main__":
    main()
