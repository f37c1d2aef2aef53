"""How many of the measurements that no fit saw lie within the 95 % bands, and how well their σ is told."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from rich.console import Console
from rich.table import Table
from torch import Tensor

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.preparation import estimated
from freelearn.data.accuracy import Accuracy
from freelearn.data.columns import members_in, usable_rows
from freelearn.data.rows import Rows
from freelearn.discovery.fits.white_fit import evaluated
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import simulate
from freelearn.queries.inverse.asker import Asker
from freelearn.queries.inverse.bands import Bands
from freelearn.queries.inverse.system import System

TEST = 0.2


@dataclass(frozen=True)
class Asked:
    """name: of the line. table: measured. effects: of the model. accuracy: stated, None to judge it from the residuals.
    test: rows that the fit does not see, (N,) bool. inverse: whether places and pressures are asked for too. members,
    per_sample: as the commands'."""

    name: str
    table: pd.DataFrame
    effects: tuple[str, ...]
    accuracy: Accuracy | None
    test: np.ndarray
    inverse: bool = False
    members: int = 0
    samples: tuple[int, ...] = ()


def simulated_sets(seeds: int) -> Iterator[Asked]:
    """The simulated bed as the project ships it: its effects known, and unknown."""
    data = settings(TrainSettings).data
    accuracy = data.accuracy
    for seed in range(seeds):
        for sample in (3, 6):
            table = simulate(data.truth, {}, vars(accuracy), 0.45, 100 + seed)
            table = table[table["sample"] == sample].reset_index(drop=True)
            yield Asked("simulated bed", table, (), accuracy.si(), _states(table, seed), inverse=True)


def hidden_sets(count: int) -> Iterator[Asked]:
    """A laboratory's data with one effect hidden, by the benchmark's code; each without and with the effect."""
    from hidden_effects.make import make
    from hidden_effects.plan import laboratory

    jobs = [job for job in laboratory(1) if job["kind"] == "one" and job["protocol"] == "standard"]
    picked = [jobs[i] for i in np.linspace(0, len(jobs) - 1, count).round().astype(int)]
    for job in picked:
        made = make(job)
        table = made.measured.table.reset_index(drop=True)
        test, samples = _states(table, job["seed"] % 1000), tuple(made.actuators)
        yield Asked("hidden effect, without it", table, (), made.told, test, samples=samples)
        yield Asked("hidden effect, with it", table, tuple(job["hidden"]), made.told, test, samples=samples)


def real_sets(data: Path, seeds: int) -> Iterator[Asked]:
    """Measured sets that were taken in by their recipes."""
    out = Path(tempfile.mkdtemp())
    asked = {
        "parallel_3": ("wall_thickness", "length_compliance", "sensor_crosstalk"),
        "parallel_free_end": ("off_axis", "small_strain_stiffness"),
        "dmsp_20_300": ("fiber_misalignment", "small_strain_stiffness", "end_taper"),
        "festo_10mm": ("fiber_misalignment", "friction_hysteresis", "length_compliance", "fiber_tension_only"),
        "torsion_4angles": ("fiber_misalignment",),
    }
    for recipe, effects in asked.items():
        table = taken_in(recipe, data, out)
        count = len(members_in(table.columns))
        for seed in range(seeds):
            repeats = recipe == "festo_10mm"
            test = _repeats(table, seed) if repeats else _rows(table, seed)
            name = f"{recipe}{', repeats of a state' if repeats else ''}"
            inverse = recipe in ("parallel_3", "parallel_free_end")
            yield Asked(name, table, effects, None, test, inverse, count)


def taken_in(recipe: str, data: Path, out: Path) -> pd.DataFrame:
    """The table of a measured set, by its recipe."""
    from sets import SETS

    each = next(s for s in SETS if s.recipe == recipe)
    command = [sys.executable, *each.commands(data.resolve(), out)[0]]
    subprocess.run(command, cwd=Path(__file__).resolve().parents[2], check=True, capture_output=True)
    return each.read(out)


def _states(table: pd.DataFrame, seed: int) -> np.ndarray:
    """A fifth of the kinematic states."""
    state = Rows.from_table(table).state
    names = np.unique(state)
    chosen = np.random.default_rng(seed).choice(names, max(1, int(TEST * len(names))), replace=False)
    return np.isin(state, chosen)


def _rows(table: pd.DataFrame, seed: int) -> np.ndarray:
    """A fifth of the rows."""
    return np.random.default_rng(seed).random(len(table)) < TEST


def _repeats(table: pd.DataFrame, seed: int) -> np.ndarray:
    """Of places that were visited more than once one visit, all its rows."""
    state = Rows.from_table(table).state
    place = table.groupby(["sample", table["elongation_mm"].round(1)]).ngroup().to_numpy()
    generator, test = np.random.default_rng(seed), np.zeros(len(table), dtype=bool)
    for name in np.unique(place):
        visits = np.unique(state[place == name])
        if len(visits) > 1:
            test |= state == generator.choice(visits)
    return test


def fitted(
    rows: Rows, effects: Sequence[str], samples: Sequence[int], members: int, accuracy: Accuracy | None, by_states: bool
) -> tuple[Model, Bands, Rows]:
    """The model of least E over rows, its bands, and the rows that it answers. accuracy: None to judge it from them."""
    from left_out import fit

    model = build_model("continuum", {}, effects, samples, members)
    fit(model, rows, starts(model, rows, 1, torch.Generator().manual_seed(0))[0])
    with torch.no_grad():
        rows = rows[model(rows.states).status == Status.OK]
    known = uncertainty(Problem(model, rows))
    place = [known.names.index(name) for name in model.declared]
    if accuracy is None:
        accuracy = estimated(evaluated(model, rows, model.vector().detach()), rows).accuracy
    seen = torch.ones(len(rows), dtype=torch.bool)
    bands = Bands.from_model(model, rows, seen, known.covariance[np.ix_(place, place)], accuracy, by_states)
    assert bands is not None
    return model, bands, rows


def answered(asked: Asked) -> dict[str, np.ndarray]:
    """Misses and half widths, SI, by what was predicted: (n, 2) each."""
    rows = Rows.from_table(asked.table)
    good = torch.tensor(usable_rows(asked.table)) & rows.readings.present.any(-1)
    test = torch.as_tensor(asked.test)
    model, bands, train = fitted(rows[good & ~test], asked.effects, asked.samples, asked.members, asked.accuracy, False)
    fresh = rows[good & test]
    with torch.no_grad():
        shown, status = model(fresh.states)
    half = bands.half(fresh.states, shown)
    missed = fresh.readings.missed(shown)
    informative = fresh.readings.informative_mask(shown) & (status == Status.OK)[:, None]
    bed, out = fresh.states.bed, {}
    for i, quantity in enumerate(bed.readings):
        there = informative[:, i].numpy()
        if quantity in bed.measured and there.any():
            out[quantity.name] = np.c_[missed[:, i].numpy(), half[:, i]][there]
    if asked.inverse:
        out |= _inverse(Asker.from_model(model, train, bands.miss), model, fresh)
    return out


def asked_of(model: Model, rows: Rows) -> tuple[System, Tensor, Tensor]:
    """Equations at rows, with what was measured of their inputs x (n, m) and outputs y (n, 2), NaN where blank."""
    seen = rows.as_loads
    system = System.from_model(model, seen.states)
    return system, system.x, torch.where(seen.readings.present, seen.readings.value, torch.nan)


def _inverse(asker: Asker, model: Model, fresh: Rows) -> dict[str, np.ndarray]:
    """The same of places from loads and of pressures from places and loads."""
    system, x, y = asked_of(model, fresh)
    ask = {"pressure 1 and length": [0, 2]} | ({} if asker.hung else {"place from loads": [0, 1]})
    out = {}
    for name, blank in ask.items():
        question = x.clone()
        question[:, blank] = torch.nan
        found = asker.answered(system, question, y)
        fine = np.array([status == "ok" for status in found.status])
        for i in blank:
            both = torch.stack([found.x[:, i] - x[:, i], found.x_half[:, i]], dim=-1).numpy()[fine]
            out[f"{name}: {system.inputs[i].name}"] = both
    return out


def coverage_table(title: str, sets: Iterator[Asked], console: Console) -> Table:
    """One line for each kind of set and each quantity."""
    gathered: dict[tuple[str, str], list[np.ndarray]] = {}
    with console.status("fitting…") as status:
        for asked in sets:
            status.update(f"{asked.name}: {' + '.join(asked.effects) or 'plain'}")
            for quantity, both in answered(asked).items():
                gathered.setdefault((asked.name, quantity), []).append(both)
    heads = ("sets", "measurements", "within the band", "lowest set", "σ told / σ found", "half width / largest miss")
    shown = Table("data", "quantity", *heads, title=f"Coverage of the 95 % bands: {title}")
    for (name, quantity), parts in gathered.items():
        shown.add_row(name, quantity, *_line(parts))
    return shown


def _line(parts: Sequence[np.ndarray]) -> list[str]:
    each = [part[np.isfinite(part).all(1)] for part in parts]
    each = [part for part in each if len(part)]
    if not each:
        return ["0"] * 2 + ["–"] * 4
    inside = [np.abs(part[:, 0]) <= part[:, 1] for part in each]
    rates = [float(i.mean()) for i in inside]
    # Each miss in its own σ, the half width as if of a normal distribution; sets count alike.
    told = [1 / np.sqrt(((1.96 * part[:, 0] / part[:, 1]) ** 2).mean()) for part in each]
    wide = [np.median(part[:, 1]) / np.abs(part[:, 0]).max() for part in each]
    return [
        str(len(each)),
        str(sum(map(len, each))),
        f"{100 * np.concatenate(inside).mean():.1f} %",
        f"{100 * min(rates):.1f} %",
        f"{np.median(told):.2f}",
        f"{np.median(wide):.2f}",
    ]
