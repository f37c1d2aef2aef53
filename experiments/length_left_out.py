"""python experiments/length_left_out.py [LENGTH …]: a search without one length of a real muscle, and that length.

What a search finds in five lengths of the pneumatic muscle DMSP-20-300 is asked of the sixth, which chose nothing of
it: the error of its answer, of all sets that are as good, and of a cubic polynomial, in percent of the largest force,
and the share of the readings within the 95 % bands. LENGTH: elongations [mm], all by default.
"""

from __future__ import annotations

import argparse

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

import freelearn as fl
from freelearn.common.package import EXAMPLES

IMPOSED = ["elongation_mm", "pressure_kpa"]
ACCURACY = fl.Accuracy(elongation_mm=0.3, twist_deg=0.175, pressure_kpa=1.0, force_n=3.0, moment_nmm=0.6)
HEADINGS = ("left out", "verdict", "answer", "answer's E %", "all sets' E %", "cubic's E %", "in bands %", "± N")


def main() -> None:
    """One row for each length."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("lengths", nargs="*", type=float)
    table = pd.read_csv(EXAMPLES / "dmsp_20_300.csv")
    lengths = parser.parse_args().lengths or sorted(table["elongation_mm"].unique())
    shown = Table(*HEADINGS, title="a muscle's length that the search did not see")
    largest = float(table["force_n"].abs().max())
    for length in lengths:
        own = table["elongation_mm"] == length
        shown.add_row(f"{length:g} mm", *left_out(table[~own].reset_index(drop=True), table[own], largest))
    Console(width=160).print(shown)


def left_out(seen: pd.DataFrame, asked: pd.DataFrame, largest: float) -> list[str]:
    """The cells of a length's row. seen: the table without its rows, asked; largest: force of all [N]."""
    found = fl.discover(seen, bed="isometric", accuracy=ACCURACY)
    rows = asked[["sample", *IMPOSED]]
    answer, together = found.predict(rows).frame(), found.predict(rows, average=True).frame()
    taut = seen[seen["slack"] == 0]
    cubic = make_pipeline(StandardScaler(), PolynomialFeatures(3), LinearRegression()).fit(
        taut[IMPOSED], taut["force_n"]
    )
    told = answer["force_pred_n"], together["force_pred_n"], cubic.predict(asked[IMPOSED])
    missed = [_missed(np.asarray(force), asked) for force in told]
    errors = [f"{100 * np.sqrt(np.mean(m**2)) / largest:.2f}" for m in missed]
    half = (answer["force_pred_n_high"] - answer["force_pred_n"]).to_numpy()
    words = " + ".join("/".join(members) for members in found.classes) or "nothing"
    inside = f"{100 * np.mean(np.abs(missed[0]) <= half):.0f}"
    return [found.verdict, words, *errors, inside, f"{np.median(half):.0f}"]


def _missed(force: np.ndarray, asked: pd.DataFrame) -> np.ndarray:
    """What is said less what was measured [N]; of a muscle that hangs loose a push is no miss."""
    missed = force - asked["force_n"].to_numpy()
    return np.where((asked["slack"] == 1) & (missed >= 0), 0.0, missed)


if __name__ == "__main__":
    main()
