"""The certificate as a page: what was compared, how far off it is, the loads with their bands, what is outside."""

from __future__ import annotations

import base64
import io

import numpy as np
from matplotlib.figure import Figure

from freelearn.common.files import write_text
from freelearn.common.formats import number
from freelearn.export.actuator_functions import Functions, View
from freelearn.export.certificate import PAGE, Certificate
from freelearn.export.checks import Check
from freelearn.export.round_trip import Reference
from freelearn.report.html.html_page import ENVIRONMENT
from freelearn.report.plots.canvas import finish, new_figure

TEXT = ENVIRONMENT.from_string(
    """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ c.name }}: certificate</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; margin: 1.2rem clamp(1rem, 3vw, 3rem); max-width: 110ch; }
table { border-collapse: collapse; } th, td { padding: .15rem .7rem; border-bottom: 1px solid #ddd; text-align: left; }
img { max-width: 100%; } .held { font-weight: 600; } .warning { border-left: 3px solid #8a4b00; padding-left: .8rem; }
</style></head>
<body><main>
<h1>{{ c.name }}: {{ c.title }}, to {{ c.to }}</h1>
{% for line in c.warnings %}<p class="warning">{{ line }} Exported all the same, as asked.</p>{% endfor %}
{% if trip %}
<p class="held">{{ "Held" if trip.held else "Not held" }}: over {{ trip.states }}
{% if trip.functions.step %}samples of recordings, followed from the first on, {% else %}states in the data's box,
{{ trip.on_edge }} of them on its edge, {% endif %}
no difference from the model may exceed {{ "%g"|format(trip.limit) }} of the range.
{{ "%g"|format(100 * trip.outside.flagged) }} % of {{ trip.outside.states }} states beyond the data were
flagged.</p>
{% for line in c.broken %}<p class="warning">{{ line }}.</p>{% endfor %}
<table><tr><th>function</th><th>output</th><th>largest difference</th><th>of</th></tr>
{% for name, f in trip.functions.items() %}{% for output, share in f.largest_difference.items() %}
<tr><td>{{ name if loop.first }}</td><td>{{ output }}</td>
<td>{{ "not a number" if share < 0 else "%.1e"|format(share) }}</td><td>{{ "%.4g"|format(f.ranges[output]) }}</td></tr>
{% endfor %}{% for flag, count in f.flags_that_differ.items() %}<tr><td></td><td>{{ flag }}</td>
<td>{{ count }} of {{ f.states }} wrong</td><td></td></tr>{% endfor %}{% endfor %}</table>
<p>Differences of an answer count as shares of its range over these states, of a derivative or band as shares of its
largest amount; of pressures it is what they leave of the loads that were wanted.</p>
{% for name, off in (c.simulated or {}).items() %}<p>In MuJoCo, {{ name }}: {{ "not found" if off is none else
"%.1e of the range"|format(off) }}.</p>{% endfor %}
{% else %}<p class="held">Not run on this machine: nothing was compared.</p>{% endif %}
<p>Beyond the data: {{ c.outside }}</p>
{% for about, picture in pictures %}<figure><img alt="{{ about }}" src="data:image/png;base64,{{ picture }}">
<figcaption>{{ about }}</figcaption></figure>{% endfor %}
<h2>Where it holds</h2>
<table><tr><th>input</th><th>least</th><th>most</th><th>unit</th></tr>
{% for name, d in c.domain.items() %}<tr><td>{{ name }}</td><td>{{ "%.6g"|format(d.least) }}</td>
<td>{{ "%.6g"|format(d.most) }}</td><td>{{ d.unit }}</td></tr>{% endfor %}</table>
{% for f in c.functions %}<h2>{{ f.name }}</h2><p>{{ f.about }}; {{ f.operations }} operations in a call.</p>
<table><tr><th></th><th>name</th><th>unit</th><th>what it is</th></tr>
{% for p in f.inputs %}<tr><td>in</td><td>{{ p.name }}</td><td>{{ p.unit }}</td><td>{{ p.about }}</td></tr>{% endfor %}
{% for p in f.state or [] %}<tr><td>state</td><td>{{ p.name }}</td><td>{{ p.unit }}</td>
<td>{{ p.about }}</td></tr>{% endfor %}
{% for p in f.outputs %}<tr><td>out</td><td>{{ p.name }}</td><td>{{ p.unit }}</td>
<td>{{ p.about }}</td></tr>{% endfor %}
</table>{% endfor %}
<h2>What it was made of</h2>
<table>{% for name, p in c.parameters.items() %}<tr><td>{{ name }}</td><td>{{ "%.6g"|format(p.value) }}</td>
<td>{{ p.unit }}</td></tr>{% endfor %}
<tr><td>data</td><td colspan="2">{{ c.data.name or "" }} {{ c.data.rows }} rows, SHA-256 {{ c.data.digest }}</td></tr>
<tr><td>license of the data</td><td colspan="2">{{ c.data.license or "not told" }}</td></tr>
{% for name, v in c.versions.items() %}<tr><td>{{ name }}</td><td colspan="2">{{ v }}</td></tr>{% endfor %}
{% for name, d in c.files.items() %}<tr><td>{{ name }}</td><td colspan="2">SHA-256 {{ d }}</td></tr>{% endfor %}</table>
{% for line in c.notes %}<p>{{ line }}</p>{% endfor %}
</main></body></html>
"""
)
POINTS = 60
LEVELS = (0.1, 0.5, 0.9)


def write_page(functions: Functions, found: Certificate) -> None:
    """Writes export.html beside the certificate."""
    pictures = [(_about(view), _answers(view)) for view in functions.views]
    if found.checks is not None:
        about = "Differences from the model over all states compared, the largest of each function's outputs"
        pictures.append((about, _differences(list(found.checks.every.values()))))
    shown = [(about, _embedded(figure)) for about, figure in pictures]
    text = TEXT.render(c=found.content, trip=found.content["round_trip"], pictures=shown)
    write_text(found.folder / PAGE, text)


def _about(view: View) -> str:
    names = " and ".join(p.name for p in view.actuator.answered)
    pressures = "pressures, all alike" if view.actuator.states.members else "pressure"
    return f"{names.capitalize()} over the {pressures}, with 95 % bands, in the middle of the data"


def _answers(view: View) -> Figure:
    """What is answered over the pressures, at three levels of what is imposed first, or of what it goes through."""
    actuator = view.actuator
    low, high = np.array(actuator.domain).T
    names, answered = [p.name for p in view.inputs], actuator.answered
    # What was never varied tells nothing.
    first = 0 if high[0] > low[0] else 1
    figure = new_figure(9.0 if len(answered) == 2 else 5.0, 3.6)
    panels = [figure.add_subplot(1, len(answered), i + 1) for i in range(len(answered))]
    for level in LEVELS:
        x = np.zeros((POINTS, len(names)))
        x[:, : len(low)] = low + 0.5 * (high - low)
        # So that the middle between a length and its opposite is zero.
        x[:, first] = (1 - level) * low[first] + level * high[first]
        x[:, 2 : len(low)] = np.linspace(low[2:], high[2:], POINTS)
        outputs = Reference(actuator, x, names).outputs
        port = actuator.imposed[first]
        # Of a length and its opposite rounding may leave something.
        told = 0.0 if abs(x[0, first]) < 1e-9 * (high[first] - low[first]) else float(x[0, first])
        for axes, answer in zip(panels, answered, strict=True):
            y = np.where(outputs["status"] == 0, outputs[answer.name], np.nan)
            half = np.nan_to_num(outputs.get(f"{answer.name}_half_band", np.zeros(POINTS)))
            (line,) = axes.plot(x[:, 2], y, label=f"{port.name} {number(told, 3)} {port.unit}")
            axes.fill_between(x[:, 2], y - half, y + half, alpha=0.2, color=line.get_color(), linewidth=0)
    for axes, answer in zip(panels, answered, strict=True):
        axes.locator_params(axis="x", nbins=5)
        finish(axes, f"{actuator.imposed[2].name} [{actuator.imposed[2].unit}]", f"{answer.name} [{answer.unit}]")
    # One for all panels, below them: inside it would cover lines.
    figure.tight_layout(rect=(0.0, 0.1, 1.0, 1.0))
    figure.legend(*panels[0].get_legend_handles_labels(), fontsize="small", loc="lower center", ncol=len(LEVELS))
    return figure


def _differences(checks: list[Check]) -> Figure:
    figure = new_figure(6.0, 3.2)
    axes = figure.add_subplot()
    largest = [check.shares.max(1, initial=0.0) for check in checks]
    finite = np.concatenate([share[np.isfinite(share)] for share in largest])
    bins = np.geomspace(1e-17, max(1e-14, 2 * float(finite.max(initial=1e-14))), 60)
    for check, share in zip(checks, largest, strict=True):
        axes.hist(np.maximum(share[np.isfinite(share)], 1e-17), bins=list(bins), histtype="step", label=check.function)
    axes.set_xscale("log")
    finish(axes, "difference, share of the range", "states")
    axes.legend(fontsize="small")
    figure.tight_layout()
    return figure


def _embedded(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return base64.b64encode(buffer.getvalue()).decode()
