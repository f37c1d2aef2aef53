"""The pictures of the effects page: one for each effect, small, and of what the effect does today."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nightly import chosen
from PIL import Image

from freelearn.physics.effects.registry import EFFECTS
from freelearn.report.plots.canvas import new_figure
from freelearn.testing.effect_page import effects_page, in_library

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs/effects"
LIBRARY = [name for name, effect in EFFECTS.items() if in_library(effect)]


@pytest.fixture(scope="module")
def gallery():
    spec = importlib.util.spec_from_file_location("effect_gallery", ROOT / "experiments/effect_gallery.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_every_effect_has_a_small_picture_and_the_page_shows_it():
    sizes = {path.stem: path.stat().st_size for path in PICTURES.glob("*.png")}
    assert set(sizes) == set(LIBRARY)
    assert max(sizes.values()) <= 40_000
    assert sum(sizes.values()) < 1_500_000
    page = effects_page()
    assert [name for name in LIBRARY if f"](effects/{name}.png)" not in page] == []


@pytest.mark.parametrize("name", chosen(LIBRARY, 3))
def test_a_picture_is_of_what_its_effect_does_today(gallery, name):
    told = json.loads(Image.open(PICTURES / f"{name}.png").text["Description"])
    now = gallery.ranges(gallery.differences(name)[list(gallery.COLUMNS.values())])
    for load, ends in now.items():
        size = max(map(abs, ends))
        np.testing.assert_allclose(told[load], ends, atol=max(0.01 * size, 1e-6), err_msg="run the gallery again")


def drawn(gallery, force):
    """The panel of the force and its color bar, of a change over the plane."""
    plane = gallery.plane()[["elongation_mm", "twist_deg"]]
    axes = new_figure(4, 3).add_subplot()
    gallery.panel(axes, plane.assign(force_change_n=force(plane)), gallery.FORCE)
    return axes, axes.figure.axes[1]


def test_a_panel_without_a_change_is_scaled_to_the_noise(gallery):
    axes, bar = drawn(gallery, lambda plane: 1e-13 * np.sin(plane["twist_deg"]))
    assert [text.get_text() for text in axes.texts] == ["unchanged"]
    low, high = bar.get_ylim()
    # The force is measured to 0.03 N.
    assert low == -high
    assert 0.03 <= high < 0.1


def test_a_change_that_is_the_same_everywhere_is_no_dark_square(gallery):
    axes, bar = drawn(gallery, lambda plane: pd.Series(0.5, plane.index))
    assert [text.get_text() for text in axes.texts] == ["+0.5 N everywhere"]
    assert bar.get_ylim()[1] >= 2 * 0.5


def test_what_is_zero_but_for_rounding_gives_no_specks(gallery):
    noise = np.random.default_rng(0).normal(size=len(gallery.plane())) * 1e-12
    axes, _ = drawn(gallery, lambda plane: plane["twist_deg"].clip(upper=0) / 20 + noise)
    lines = axes.collections[-1].get_paths() + [p for c in axes.collections[:-1] for p in c.get_paths()]
    above = [path for path in lines if len(path.vertices) and path.vertices[:, 1].min() > 5 and len(path.vertices) < 40]
    assert not above
