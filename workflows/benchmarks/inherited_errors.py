"""How large are errors that a step inherits from the contact solver in earlier steps?

    python workflows/benchmarks/inherited_errors.py [--cases N] [--seed S]

Random cases of ``accuracy_cases.py`` run with fixed steps, once as usual and once with 1/2000 of the tolerance of the
contact solver, so that all differences are due to the solver. Prints for several values of ``INHERITED``
(``experiment/accuracy.py``) the share of rows whose pressure differs by more than the error stated for the solver, and
the median and the 99 % quantile of the difference over this error. Two minutes for 50 cases.
"""

import argparse
import logging
import warnings

import numpy as np
from accuracy import limited
from accuracy_cases import case

import roughvisc as rv
from roughvisc.mechanics import stepping

#: Steps and rows of a program, tolerance of the sharp solver over that of the run, and processor time of a case [s].
STEPS, ROWS = 120, 10
SHARP = 1e-4
TIME_LIMIT = 30
#: Differences below this part of the tolerance do not count.
FLOOR = 1e-3


def solved(drawn, part):
    """Return a result with fixed steps, for a tolerance of the contact solver over the tolerance of the run."""
    usual = stepping.take_step.__defaults__
    stepping.SOLVER_PART, before = part, stepping.SOLVER_PART
    stepping.take_step.__defaults__ = tuple(part if value == before else value for value in usual)
    duration = drawn.program.duration
    settings = drawn.settings | {"times": np.linspace(0, duration, ROWS + 1)[1:], "fields": ("pressure",)}
    settings |= {"numerics": rv.Numerics(time_step=duration / STEPS), "grid_error": False, "progress": False}
    try:
        return rv.simulate(drawn.height, drawn.material, drawn.program, **settings)
    finally:
        stepping.SOLVER_PART, stepping.take_step.__defaults__ = before, usual


def rows(drawn):
    """Yield difference, own error and largest error so far of each row, over the tolerance."""
    usual, sharp = solved(drawn, stepping.SOLVER_PART), solved(drawn, SHARP)
    cell = float(np.prod([float(usual[axis][1] - usual[axis][0]) for axis in ("x", "y")]))
    off = cell * abs(usual.pressure - sharp.pressure).sum(("x", "y")).values
    largest = np.maximum.accumulate(sharp.force.values)
    steps = usual.roughvisc.steps
    places = np.searchsorted(steps.time.values, usual.time.values, side="right") - 1
    own, so_far = steps.residual.values[places], np.maximum.accumulate(steps.residual.values)[places]
    tolerance = drawn.settings["tolerance"]
    for row in np.flatnonzero(largest):
        scale = 1 / largest[row] / tolerance
        force = float(sharp.force[row])
        yield off[row] * scale, own[row] * force * scale, so_far[row] * force * scale


def main(cases=50, seed=818181):
    """Print the shares; return differences, own errors and largest errors so far, shape (rows, 3)."""
    logging.getLogger("roughvisc").setLevel(logging.ERROR)
    records = []
    for number in range(cases):
        drawn = case(seed, number)
        if drawn.families["material"] != "elastic":
            try:
                with limited(TIME_LIMIT):
                    records += rows(drawn)
            except (rv.RoughviscError, TimeoutError) as error:
                print(f"case {number}: {error}")
    off, own, so_far = np.array(records).T
    for inherited in (0.25, 0.5, 1.0):
        ratio = off / np.maximum(own + inherited * so_far, FLOOR)
        share, median, high = np.mean(ratio > 1), np.median(ratio), np.quantile(ratio, 0.99)
        print(f"INHERITED {inherited}: {share:.1%} of {off.size} rows above, median {median:.2f}, 99 % {high:.1f}")
    return np.array(records)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--seed", type=int, default=818181)
    main(**vars(parser.parse_args()))
