"""What the paper reports for its own eight samples, whose data are not public. Errors E as fractions."""

# Sedal, Wineman, Gillespie & Remy, "Comparison and Experimental Validation of Predictive Models for Soft,
# Fiber-Reinforced Actuators", Section "Results".
PUBLISHED: dict[str, dict[str, float]] = {
    "linear": {"mean": 0.349, "range": 0.888, "diagonal": 0.214, "min": 0.0219},
    "continuum": {"mean": 0.181, "range": 0.326, "diagonal": 0.1687, "min": 0.0625, "max": 0.388},
    "mlp": {"mean": 0.296, "range": 1.897, "diagonal": 0.0551},
}
