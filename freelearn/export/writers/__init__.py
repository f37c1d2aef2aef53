"""That graph as C, ONNX, FMU, MuJoCo, Python and tables."""
