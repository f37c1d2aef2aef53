"""The colors of every picture and chart."""

from __future__ import annotations

# Okabe & Ito's colors, told apart by color-blind readers; line styles and markers differ as well.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Residuals: diverging, and light in the middle (ColorBrewer's PuOr, orange to purple): the sign survives color
# blindness, the size survives grayscale.
DIVERGING = (
    "#7f3b08", "#b35806", "#e08214", "#fdb863", "#fee0b6", "#f7f7f7", "#d8daeb", "#b2abd2", "#8073ac", "#542788",
    "#2d004b",
)  # fmt: skip
