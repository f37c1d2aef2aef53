"""The arm of mujoco_arm.py in one C program: the muscles' C file in a loop of 10 kHz.

python experiments/c_arm.py. In every tick the program asks the exported C for the biceps' pressure that holds the load
(`pressure_for_force`), for both muscles' forces, and moves the arm; it waits for the next tick as a controller does.
"""

from __future__ import annotations

import atexit
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

from mujoco_arm import CONTRACTED, DAMPING, FOREARM, GRAVITY, INERTIA, LEVER, LOAD, TRICEPS

import freelearn as fl
from freelearn.export.writers.c_file import compiler

MAIN = f"""
#define _POSIX_C_SOURCE 200112L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int dmsp20_loads(const double in[3], double out[4]);
int dmsp20_pressure_for_force(const double in[3], double out[4]);

static double force(double elongation, double pressure) {{
    const double in[3] = {{elongation, 0.0, pressure}};
    double out[4];
    dmsp20_loads(in, out);
    return out[0];
}}

int main(int count, char **words) {{
    const double wanted = atof(words[1]), step = 1e-4;
    const long ticks = atol(words[3]);
    double angle = atof(words[2]), speed = 0.0, pressure = 0.0, worst = 0.0;
    long late = 0;
    struct timespec next, began, ended, used;
    (void)count;
    clock_gettime(CLOCK_MONOTONIC, &next);
    for (long k = 0; k < ticks; k++) {{
        clock_gettime(CLOCK_MONOTONIC, &began);
        const double triceps = {LEVER} * wanted - {CONTRACTED}, lever = {LEVER};
        const double hold = force(triceps, {TRICEPS}) - {LOAD * GRAVITY * FOREARM} * cos(wanted) / lever;
        const double asked[3] = {{-lever * wanted - {CONTRACTED}, 0.0, hold}};
        double told[4];
        if (dmsp20_pressure_for_force(asked, told) & 16) return 1;
        pressure = told[0];
        const double pull = force(-lever * angle - {CONTRACTED}, pressure);
        const double push = force(lever * angle - {CONTRACTED}, {TRICEPS});
        const double turning = lever * (push - pull) - {LOAD * GRAVITY * FOREARM} * cos(angle);
        speed = (speed + step * turning / {INERTIA}) / (1.0 + step * {DAMPING} / {INERTIA});
        angle += step * speed;
        clock_gettime(CLOCK_MONOTONIC, &ended);
        const double took = (double)(ended.tv_sec - began.tv_sec) + 1e-9 * (double)(ended.tv_nsec - began.tv_nsec);
        worst = took > worst ? took : worst;
        late += took > step;
        next.tv_nsec += 100000;
        if (next.tv_nsec >= 1000000000) {{ next.tv_nsec -= 1000000000; next.tv_sec++; }}
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    }}
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    const double busy = (double)used.tv_sec + 1e-9 * (double)used.tv_nsec;
    printf("%.9g %.9g %.9g %.9g %ld\\n", angle, pressure, 1e6 * busy / (double)ticks, 1e6 * worst, late);
    return 0;
}}
"""


class Looped(NamedTuple):
    """angle wanted and reached [rad]; the biceps' pressure [Pa]; mean processor time of a tick, and what the longest
    took by the clock with other processes [µs]; ticks that took longer than their tenth of a millisecond."""

    wanted: float
    reached: float
    pressure: float
    mean: float
    longest: float
    late: int


@cache
def compiled() -> Path:
    """A folder with the program `arm`, gone when this process ends."""
    place = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    fl.actuators["dmsp20"].export(place / "dmsp20.c")
    (place / "main.c").write_text(MAIN, encoding="utf-8")
    command = [str(compiler()), "-std=c99", "-O2", "-Wall", "-Werror", "-o", "arm", "dmsp20.c", "main.c", "-lm"]
    subprocess.run(command, cwd=place, check=True)
    return place


def hold(wanted: float, begin: float, ticks: int = 40_000) -> Looped:
    """Where the arm comes to rest from `begin` [rad]."""
    words = [str(compiled() / "arm"), repr(wanted), repr(begin), str(ticks)]
    done = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split()
    reached, pressure, mean, longest = map(float, done[:4])
    return Looped(wanted, reached, pressure, mean, longest, int(done[4]))


if __name__ == "__main__":
    for wanted in (-0.2, 0.0, 0.3):
        held = hold(wanted, wanted + 0.1)
        print(f"wanted {held.wanted:+.3f} rad, reached {held.reached:+.6f} rad at {held.pressure / 1e3:.1f} kPa")
        print(f"a tick takes {held.mean:.1f} µs of the processor; {held.late} of 40,000 took longer than 100 µs")
