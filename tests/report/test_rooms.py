"""Renderers draw, and load only what they draw with."""

import subprocess
import sys

import pytest

HEAVY = ("matplotlib", "lightning", "sklearn", "bokeh.plotting", "torch.utils.tensorboard")


def loaded(*modules: str) -> set[str]:
    """Everything in sys.modules once these are imported, in a process of their own."""
    code = f"import sys, {', '.join(modules)}\nprint('\\n'.join(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=120)
    return set(out.stdout.split())


@pytest.mark.parametrize("module", ["freelearn.report.html.run_report", "freelearn.report.terminal.printed_run"])
def test_a_run_is_shown_without_what_only_others_need(module):
    assert loaded(module).isdisjoint(HEAVY)


def test_pages_need_neither_pictures_nor_their_library():
    modules = loaded(
        "freelearn.report.html.run_charts", "freelearn.report.html.sweep_report",
        "freelearn.report.html.discovery_report", "freelearn.report.html.ranking_charts",
    )  # fmt: skip
    assert not any(name.startswith(("matplotlib", "lightning", "freelearn.report.plots")) for name in modules)


def test_the_page_has_the_colors_of_the_pictures():
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    from freelearn.report.html.residual_charts import PALETTE
    from freelearn.report.plots.residual_plots import SCALE

    for place, color in enumerate(PALETTE):
        assert to_rgb(color) == pytest.approx(colormaps[SCALE](place / (len(PALETTE) - 1))[:3], abs=0.01)
