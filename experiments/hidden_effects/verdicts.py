"""Whether what a search said of a data set is right."""

from __future__ import annotations

MOST_IN_CLASS = 3
# What has no potential, and what depends on the history, of all that is hidden: the truth that the screens are held
# against. What happens as time goes by breaks reciprocity, and shows between rising and falling pressure if quick.
WITHOUT_POTENTIAL = {
    *(
        "friction_hysteresis",
        "contact_friction",
        "relaxation",
        "stress_softening",
        "viscoelasticity",
        "force_gain",
        "moment_gain",
        "sensor_crosstalk",
    ),
    *("sensor_drift", "bent_force_cell", "temperature_swing", "bulging_caps", "zero_jump"),
}
OF_HISTORY = {"friction_hysteresis", "contact_friction", "relaxation", "stress_softening", "viscoelasticity"}
AFFIRMED = {"reciprocity": WITHOUT_POTENTIAL, "rising against falling pressure": OF_HISTORY}


def right(result: dict) -> bool:
    """Every hidden effect is named, or stands in a class of at most three; nothing else is named."""
    if result["verdict"] not in ("named", "class") or len(result["classes"]) != len(result["hidden"]):
        return False
    left = list(result["hidden"])
    for group in result["classes"]:
        match = next((h for h in left if h in group), None)
        if match is None or len(group) > MOST_IN_CLASS:
            return False
        left.remove(match)
    return not left


def contradicted(result: dict, screen: str) -> bool:
    """Whether what the screen said of a data set contradicts what was hidden in it.

    Reciprocity kept denies nothing: a wrong gain keeps it too where the fluid's thrust is most of the load. Loads that
    do not differ deny friction above the limit that is told with it: half of the largest difference."""
    shows, hidden = result["screens"].get(screen), set(result["hidden"])
    if shows:
        return not hidden & AFFIRMED[screen]
    if shows is None or screen == "reciprocity" or "friction_hysteresis" not in hidden:
        return False
    rubs = [result["truth"][f"friction_hysteresis.{load}"] for load in ("force", "moment")]
    return any(2 * f > most for f, most in zip(rubs, result["hysteresis_at_most"], strict=True))
