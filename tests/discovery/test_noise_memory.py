"""Noise with a memory: filters against dense covariances, estimates against processes drawn by small steps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from freelearn.api.functions import discover
from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.noise.memory import Filter, Memory, remembered
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.noise.scatter import _seen_in, huber
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import UNIT, log

VISIT = torch.tensor([3, 3, 3, 3, 3, 7, 7, 7, 1, 1, 1, 1])
ROWS = len(VISIT)
MEMORY = Memory(torch.tensor([0.7, 0.2], dtype=torch.float64), torch.tensor([0.8, 3.0], dtype=torch.float64))
ACCURACY = Accuracy(length=7e-5, twist=3e-3, pressure=150.0, force=0.03, moment=6e-4)


@pytest.fixture
def clock():
    """Uneven, with a gap, and each recording by a clock of its own."""
    step = np.random.default_rng(1).uniform(0.05, 0.6, ROWS)
    step[3] = 4.0
    step[5] = step[8] = -20.0
    return torch.as_tensor(step.cumsum())


def correlation(clock, channel):
    """e^(−Δt/τ) between the rows of one recording, (N, N)."""
    same = VISIT[:, None] == VISIT
    apart = (clock[:, None] - clock).abs()
    return torch.where(same, torch.exp(-apart / MEMORY.time[channel]), 0.0).numpy()


def test_innovations_turn_the_dense_covariance_into_the_identity(clock):
    """Of errors whose parts differ from row to row, and of rows that hold none."""
    kept = torch.as_tensor(np.random.default_rng(2).uniform(0.1, 2.0, (ROWS, 2)))
    kept[6] = 0.0
    white = torch.as_tensor(np.random.default_rng(3).uniform(0.1, 1.0, (ROWS, 2)))
    filtered = Filter(MEMORY, kept, white, VISIT, clock)
    unit = torch.eye(ROWS, dtype=torch.float64)[:, None, :].expand(ROWS, 2, ROWS)
    root = filtered.innovations(unit)
    for channel in range(2):
        loading = kept[:, channel].sqrt().numpy()
        dense = np.diag(white[:, channel].numpy()) + loading[:, None] * correlation(clock, channel) * loading
        w = root[:, channel].numpy()
        np.testing.assert_allclose(w @ dense @ w.T, np.eye(ROWS), atol=1e-12)


def test_of_no_columns_there_are_no_innovations(clock):
    """LAPACK, asked to solve for none, wrote beyond the end of what it was given."""
    one = torch.ones(len(clock), 2, dtype=torch.float64)
    filtered = Filter(MEMORY, MEMORY.share * one, 1 - MEMORY.share * one, VISIT, clock)
    for _ in range(200):
        assert filtered.innovations(one[..., None][..., :0]).shape == (len(clock), 2, 0)


def test_colored_noise_has_these_innovations(clock):
    one = torch.ones(ROWS, 2, dtype=torch.float64)
    filtered = Filter(MEMORY, MEMORY.share * one, 1 - MEMORY.share * one, VISIT, clock)
    white = torch.as_tensor(np.random.default_rng(4).normal(size=(ROWS, 2)))
    back = filtered.innovations(filtered.colored(white)[..., None])[..., 0]
    torch.testing.assert_close(back, white, rtol=0, atol=1e-12)
    part = torch.nonzero(VISIT == 7)[:, 0]
    torch.testing.assert_close(filtered.part(part).colored(white[part]), filtered.colored(white)[part])


def test_a_whitener_knows_the_memory_and_the_places_that_recordings_share(clock):
    """Two independent channels (no error of the pressure), each with a memory, and a common position error."""
    generator = torch.Generator().manual_seed(1)
    typical = torch.tensor([[3e4, 5.0, 1e-4], [5.0, 0.3, 1e-7]], dtype=torch.float64)
    sensitivity = typical * torch.randn(ROWS, 2, 3, dtype=torch.float64, generator=generator)
    accuracy = replace(ACCURACY, pressure=0.0)
    weight = torch.as_tensor(np.random.default_rng(5).uniform(0.2, 1.2, (ROWS, 2)))
    scatter = replace(
        huber(torch.ones(ROWS, 2, dtype=torch.float64), accuracy), memory=MEMORY, weight=weight, reading=weight / 4
    )
    whiten = Whitener(sensitivity, VISIT, accuracy, scatter, clock=clock)
    root = whiten(torch.eye(2 * ROWS, dtype=torch.float64).reshape(ROWS, 2, -1)).reshape(2 * ROWS, -1).numpy()
    by = sensitivity.numpy()
    dense = np.zeros((ROWS, 2, ROWS, 2))
    same = (VISIT[:, None] == VISIT).numpy()
    for a in range(2):
        for b in range(2):
            moved = sum(
                np.outer(by[:, a, k], by[:, b, k]) * size**2
                for k, size in enumerate((accuracy.length, accuracy.twist))
            )  # fmt: skip
            dense[:, a, :, b] = same * moved
        sigma, share = 2 * (accuracy.force, accuracy.moment)[a], float(MEMORY.share[a])
        white = (1 - share) / weight[:, a].numpy()
        dense[:, a, :, a] += sigma**2 * (np.diag(white) + share * correlation(clock, a))
    np.testing.assert_allclose(root @ dense.reshape(2 * ROWS, -1) @ root.T, np.eye(2 * ROWS), atol=1e-9)


def drawn(share, time, seed, recordings=12, rows=150):
    """Errors (N, 2) whose memory is integrated by small steps between uneven readings, with visit and clock."""
    generator = np.random.default_rng(seed)
    fine = 20
    parts = []
    for _ in range(recordings):
        step = generator.uniform(0.05, 0.35, rows)
        process = np.empty((rows, 2))
        now = generator.normal(size=2)
        for n in range(rows):
            for _ in range(fine):
                dt = step[n] / fine / np.array(time)
                now = now * (1 - dt) + np.sqrt(2 * dt) * generator.normal(size=2)
            process[n] = now
        white = generator.normal(size=(rows, 2))
        errors = np.sqrt(share) * process + np.sqrt(1 - np.array(share)) * white
        parts.append((errors, step.cumsum()))
    error, clock = (torch.as_tensor(np.concatenate([p[i] for p in parts])) for i in range(2))
    return 3.0 * error, torch.arange(recordings).repeat_interleave(rows), clock


def test_share_and_time_are_found():
    error, visit, clock = drawn((0.6, 0.9), (0.7, 2.0), 1, recordings=24)
    found = remembered(error, torch.ones_like(error), visit, clock)
    np.testing.assert_allclose(found.share, [0.6, 0.9], atol=0.08)
    np.testing.assert_allclose(found.time, [0.7, 2.0], rtol=0.25)


def test_white_noise_has_no_memory():
    _, visit, clock = drawn((0.5, 0.5), (1.0, 1.0), 0)
    for seed in range(5):
        error = torch.as_tensor(np.random.default_rng(seed).normal(size=(1800, 2)))
        assert remembered(error, torch.ones_like(error), visit, clock) is None


def test_what_does_not_count_is_no_neighbor():
    error, visit, clock = drawn((0.9, 0.9), (2.0, 2.0), 2, recordings=6)
    weight = torch.ones_like(error)
    weight[::3] = 0.0
    error[::3] = 1e6
    found = remembered(error, weight, visit, clock)
    np.testing.assert_allclose(found.time, [2.0, 2.0], rtol=0.4)


@pytest.mark.nightly
def test_a_search_takes_noise_that_goes_on_for_what_it_is():
    """Each reading errs much as the last one: without a memory of the noise, something systematic would be left."""
    found = discover(log({}, 3, (4,), recordings=8, memory=0.8), progress=False)
    assert found.verdict == "adequate"
    assert "has a memory" in found.summary()


@pytest.mark.nightly
def test_a_search_names_creep_under_noise_that_goes_on():
    found = discover(log({"creep": UNIT["creep"]}, 3, (4,), recordings=8, memory=0.8), progress=False)
    assert (found.verdict, found.effects) == ("named", ["creep"])


def test_the_place_of_a_recording_is_seen_through_what_is_carried():
    """A length that is off all through a recording is off in what creep remembers too: against a shifted table, whose
    gauge has no noise that another length would make more of."""
    table = log({}, 2, (4,), recordings=2, noise=0.0)
    model = build_model("continuum", {"creep.share": 0.4, "creep.time": 3.0}, ["creep"])
    rates = sensitivities(model, Rows.from_table(table).states)[:, :, 0]
    step = 1e-3
    with torch.no_grad():
        far, near = (
            model(Rows.from_table(table.assign(elongation_mm=table["elongation_mm"] + way * step)).states).loads
            for way in (1, -1)
        )
    torch.testing.assert_close(rates, (far - near) / (2 * step * 1e-3), rtol=1e-4, atol=1e-2)


def test_what_is_white_with_the_shapes_has_no_memory_without_them():
    """Two recordings that are off by a constant each: what is left without shapes that wander is their opposite."""
    generator = np.random.default_rng(5)
    visit, clock = torch.arange(2).repeat_interleave(400), torch.arange(800, dtype=torch.float64) / 10
    wander = torch.sin(clock / 3)[:, None].expand(-1, 2)
    white = torch.as_tensor(generator.normal(size=(800, 2))) + 3.0 * visit[:, None]
    counts = torch.ones_like(white)
    said = remembered(white - 3.0 * visit[:, None] + wander, counts, visit, clock)
    assert said is not None
    assert _seen_in(said, white, counts, visit, clock) is None
    seen = _seen_in(said, white + wander, counts, visit, clock)
    assert seen is not None
    torch.testing.assert_close(seen.share, said.share)
