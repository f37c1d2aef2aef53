"""The certificate as a page: what was compared, how far off it is, the loads with their bands, what is outside."""

from __future__ import annotations

import base64
import io

import numpy as np
from matplotlib.figure import Figure

from freelearn.common.files import write_text
from freelearn.export.actuator import Actuator
from freelearn.export.certificate import PAGE, Certificate
from freelearn.export.round_trip import Difference, Reference
from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.inverse.bands import SAME
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
<p class="held">{{ "Held" if trip.held else "Not held" }}: over {{ trip.states }} states in the data's box,
{{ trip.on_edge }} of them on its edge, the largest difference from the model is
{% for name, share in trip.largest_difference.items() %}{{ "%.1e"|format(share) }} of the range of the {{ name }}
({{ "%.4g"|format(trip.ranges[name]) }}){{ ", " if not loop.last }}{% endfor %}; allowed are
{{ "%g"|format(trip.limit) }}.
{{ "%g"|format(100 * trip.outside.flagged) }} % of {{ trip.outside.states }} states beyond the data were flagged.</p>
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


def write_page(actuator: Actuator, found: Certificate) -> None:
    """Writes export.html beside the certificate."""
    pictures = [("The loads over the pressure, with their 95 % bands, in the middle of the data", _loads(actuator))]
    if found.difference is not None:
        pictures.append(("Differences from the model over all states compared", _differences(found.difference)))
    shown = [(about, _embedded(figure)) for about, figure in pictures]
    text = TEXT.render(c=found.content, trip=found.content["round_trip"], pictures=shown)
    write_text(found.folder / PAGE, text)


def _loads(actuator: Actuator) -> Figure:
    """What is answered over the last input, at three levels of the first."""
    low, high = np.array(actuator.domain).T
    figure = new_figure(9.0, 3.6)
    for i, port in enumerate(actuator.answered):
        axes = figure.add_subplot(1, 2, i + 1)
        for level in LEVELS:
            x = np.zeros((POINTS, len(actuator.forward.inputs)))
            x[:, : len(low)] = low + 0.5 * (high - low)
            x[:, 0] = low[0] + level * (high[0] - low[0])
            x[:, 2 : len(low)] = np.linspace(low[2:], high[2:], POINTS)
            reference = Reference(actuator, x)
            y, half = reference.answered[0][:, i], _half(actuator.fitted, reference)[:, i]
            name = f"{actuator.imposed[0].name} {x[0, 0]:.3g} {actuator.imposed[0].unit}"
            (line,) = axes.plot(x[:, 2], y, label=name)
            axes.fill_between(x[:, 2], y - half, y + half, alpha=0.2, color=line.get_color(), linewidth=0)
        finish(axes, f"{actuator.imposed[2].name} [{actuator.imposed[2].unit}]", f"{port.name} [{port.unit}]")
        axes.legend(fontsize="small")
    figure.tight_layout()
    return figure


def _half(fitted: FittedModel, reference: Reference) -> np.ndarray:
    if fitted.bands is None:
        return np.zeros((len(reference.inputs), 2))
    system, x = reference.system, reference.x
    half = fitted.bands.miss.half_width(system, x, system.slopes(x)[1], (), (0, 1), SAME)[1]
    found: np.ndarray = np.nan_to_num(half.numpy())
    return found


def _differences(difference: Difference) -> Figure:
    figure = new_figure(6.0, 3.2)
    axes = figure.add_subplot()
    shares = difference.shares[np.isfinite(difference.shares).all(1)]
    bins = np.geomspace(1e-17, max(1e-14, 2 * float(shares.max(initial=1e-14))), 60)
    for i, name in enumerate(difference.largest):
        axes.hist(np.maximum(shares[:, i], 1e-17), bins=list(bins), histtype="step", label=name)
    axes.set_xscale("log")
    finish(axes, "difference, share of the range", "states")
    axes.legend(fontsize="small")
    figure.tight_layout()
    return figure


def _embedded(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return base64.b64encode(buffer.getvalue()).decode()
