"""freelearn: fit, compare and correct models of fiber-reinforced soft actuators (FREEs)."""

__version__ = "0.1.0"
