"""Engineering units of the tables, as factors to SI.

Inside the program everything is SI; multiply by a factor on the way in, divide by it on the way out.
"""

import math

MM = 1e-3  # m
DEG = math.pi / 180  # rad
KPA = 1e3  # Pa
NMM = 1e-3  # N·m
