"""Renderers draw, and load only what they draw with."""

import os
import subprocess
import sys

import pytest

HEAVY = ("matplotlib", "lightning", "sklearn", "bokeh.plotting", "torch.utils.tensorboard")


RUN = ("freelearn.report.html.run_report", "freelearn.report.terminal.printed_run")
PAGES = (
    "freelearn.report.html.run_charts", "freelearn.report.html.sweep_report",
    "freelearn.report.html.discovery_report", "freelearn.report.html.ranking_charts",
)  # fmt: skip
# Forked for each question from one that has imported what all of them need, which takes the most time.
CODE = """
import importlib, os, sys, torch
for line in sys.stdin:
    if os.fork() == 0:
        for module in line.split():
            importlib.import_module(module)
        print(*sys.modules, flush=True)
        os._exit(0)
    assert os.wait()[1] == 0
"""


@pytest.fixture(scope="module")
def loaded():
    """Everything in sys.modules once some modules are imported, in processes of their own."""
    asked = [*((module,) for module in RUN), PAGES]
    out = subprocess.run(
        [sys.executable, "-c", CODE], input="\n".join(map(" ".join, asked)), check=True, capture_output=True, text=True,
        timeout=120, env=os.environ | {"OMP_NUM_THREADS": "1"},
    ).stdout.splitlines()  # fmt: skip
    return {modules: set(line.split()) for modules, line in zip(asked, out, strict=True)}


@pytest.mark.parametrize("module", RUN)
def test_a_run_is_shown_without_what_only_others_need(module, loaded):
    assert module in loaded[module,]
    assert loaded[module,].isdisjoint(HEAVY)


def test_pages_need_neither_pictures_nor_their_library(loaded):
    modules = loaded[PAGES]
    assert modules >= set(PAGES)
    assert not any(name.startswith(("matplotlib", "lightning", "freelearn.report.plots")) for name in modules)


def test_the_page_has_the_colors_of_the_pictures():
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    from freelearn.report.html.residual_charts import PALETTE
    from freelearn.report.plots.residual_plots import SCALE

    for place, color in enumerate(PALETTE):
        assert to_rgb(color) == pytest.approx(colormaps[SCALE](place / (len(PALETTE) - 1))[:3], abs=0.01)
