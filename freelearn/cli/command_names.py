"""The commands by name."""

from __future__ import annotations

# What each command does, and the function that runs it on the words after its name. Named and not imported: each of
# them loads only what it needs.
COMMANDS = {
    "train": ("fit one model on one training set and evaluate it", "freelearn.cli.fit_commands", "train_app"),
    "discover": ("find the physical effects that a model misses", "freelearn.cli.fit_commands", "discover_app"),
    "predict": ("fill in the blanks of a table with a fitted model", "freelearn.cli.run_commands", "predict_app"),
    "plan": ("which rows to measure next", "freelearn.cli.run_commands", "plan_app"),
    "referee": ("whether what a run claims stands", "freelearn.cli.run_commands", "referee_app"),
    "export": (
        "a fitted model for other software: onnx, c, fmu, mujoco, table",
        "freelearn.cli.run_commands",
        "export_app",
    ),
    "intake": ("a laboratory's raw file as a measurement table", "freelearn.cli.run_commands", "intake_app"),
    "compare": ("two runs side by side: parameters, errors, curves", "freelearn.cli.comparing", "main"),
    "start": ("from a raw file to the report: asks what it cannot know", "freelearn.cli.start_app", "main"),
    "gather": ("the results of finished sweeps as a table and heat maps", "freelearn.cli.gathering", "main"),
    "figures": ("the paper's other figures and tables from a sweep or a run", "freelearn.cli.paper_figures", "main"),
    "specimens": ("fit the rubber to its own tests", "freelearn.cli.specimen_fits", "main"),
    "doctor": ("what is installed, on which machine, what is absent", "freelearn.cli.housekeeping", "doctor_main"),
    "clean": ("old outputs, their sizes told before any is deleted", "freelearn.cli.housekeeping", "clean_main"),
    "completion": ("commands and options at the shell's tab key", "freelearn.cli.completion", "main"),
    "workbench": ("the whole loop with the mouse, on a page of this machine", "freelearn.workbench.__main__", "main"),
}
