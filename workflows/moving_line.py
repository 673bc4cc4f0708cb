"""The moving line of a sticky contact on a viscoelastic body, and pull-off against time of hold.

A ball at Tabor 2 is pressed on a Zener body and pulled off at constant speeds. The work that the moving line needs per
area follows from force and contact radius of the relaxed ball. The theory takes work, range and creep compliance of the
body and fits nothing.

    python workflows/moving_line.py [FIGURE]
"""

import sys
import warnings

import numpy as np
from matplotlib.figure import Figure

import roughvisc as rv

RADIUS, MODULUS, RANGE, TABOR = 1.0, 1.0, 1e-4, 2.0  # m, Pa, m; relaxed contact modulus
GLASSY = 0.1  # instantaneous over relaxed compliance; the retardation time is 1 s
STICKY = rv.adhesion(work=MODULUS * (TABOR**3 * RANGE**3 / RADIUS) ** 0.5, range=RANGE)
BODY = rv.zener(0.25 * MODULUS / GLASSY, 0.25 * MODULUS / (1 - GLASSY), 0.25 * MODULUS / (1 - GLASSY))
#: Contact radius at zero load, and half the approach of the pull-off, by Johnson, Kendall and Roberts [m].
ZERO_LOAD = (4.5 * np.pi * STICKY.work / MODULUS * RADIUS**2) ** (1 / 3)
DEPTH = (np.pi**2 * STICKY.work**2 / MODULUS**2 * RADIUS) ** (1 / 3)
#: Speeds of the ball in ranges per second, and times of hold [s].
SPEEDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
HOLDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
#: Speed up to which the body around an advancing line is relaxed [ranges per s].
FASTEST_ADVANCE = 1.0
BLUE, VERMILION = "#0072b2", "#d55e00"
#: Contact radii at which the work of the line is taken, over the largest one.
PARTS = (0.8, 0.7, 0.6)


def moved(program, cells, **options):
    """Force, contact area and approach of the ball moved by a program."""
    ball = rv.sphere(RADIUS, 3.4 * ZERO_LOAD, cells)
    given = {"boundary": "free", "edge": "accept", "fields": (), "progress": False} | options
    return rv.simulate(ball, BODY, program, adhesion=STICKY, **given)


def work_of_line(force, radius):
    """Energy release rate of the relaxed ball over the work of adhesion, from force and contact radius [N, m]."""
    hertz = 4 * MODULUS * radius**3 / (3 * RADIUS)
    return (hertz - force) ** 2 / (8 * np.pi * MODULUS * radius**3) / STICKY.work


def measured(speed, cells, *, recedes):
    """Speed of the line [ranges per s] and its work over the work of adhesion, at three radii."""
    far = -4 * DEPTH if recedes else -1.5 * DEPTH
    lasting = (DEPTH - far) / (speed * RANGE)
    if recedes:
        program = rv.Program().approach(DEPTH, over=0).hold(20).approach(far, over=lasting)
        times = 20 + lasting * np.linspace(0.01, 1, 100)
    else:
        program = rv.Program().approach(far, over=0).approach(DEPTH, over=lasting)
        times = lasting * np.linspace(0.01, 1, 100)
    ds = moved(program, cells, times=times)
    radius = np.sqrt(ds.contact_area.values / np.pi)
    speeds = abs(np.gradient(radius, times)) / RANGE
    rows = [int(np.argmin(abs(radius - part * radius.max()))) for part in PARTS]
    return speeds[rows], work_of_line(ds.force.values[rows], radius[rows])


def theory(speed, *, recedes):
    """Work of the line over the work of adhesion at a speed [ranges per s].

    The line is a crack with a cohesive zone of the strength of the attraction. The zone has the length
    ``d = pi G E / 4 strength^2`` and passes in the time ``d / 3 v``, in which the creep compliance grows to ``C``. An
    opening crack needs ``G C = w C(infinity)`` [1]. The formula of the closing crack is our derivation, after
    Schapery's: its zone is the same, but the stress far from it acts on the compliance of the zone, so that
    ``G C(infinity) = w C``.

    .. [1] R. A. Schapery, Int. J. Fract. 11 (1975) 369; J. A. Greenwood, J. Phys. D 37 (2004) 2557.
    """
    low, high = 1.0, 1 / GLASSY
    for _ in range(60):
        work = (low * high) ** 0.5
        passing = np.pi * work * STICKY.work * MODULUS / (4 * STICKY.strength**2) / (3 * speed * RANGE)
        compliance = GLASSY + (1 - GLASSY) * -np.expm1(-passing)
        low, high = (work, high) if work * compliance < 1 else (low, work)
    return work if recedes else 1 / work


def pull_offs(holds, speed, cells):
    """Pull-off over ``pi w R`` after holds at the first approach [s], pulled at a speed [ranges per s]."""
    lasting = 5 * DEPTH / (speed * RANGE)
    largest = []
    for hold in holds:
        program = rv.Program().approach(DEPTH, over=0).hold(hold).approach(-4 * DEPTH, over=lasting)
        ds = moved(program, cells, times=hold + lasting * np.linspace(0.01, 1, 100))
        largest.append(-float(ds.force.min()) / (np.pi * STICKY.work * RADIUS))
    return largest


def main(figure="moving_line.png", speeds=SPEEDS, holds=HOLDS, cells=64):
    """Draw the figure; return rows with the name of the series, its abscissa, values, and theory."""
    warnings.simplefilter("ignore")
    fig = Figure(figsize=(8.4, 3.5), layout="constrained")
    line, dwell = fig.subplots(1, 2)
    table = []
    for recedes, colour, name, marker in ((True, BLUE, "recedes", "o"), (False, VERMILION, "advances", "s")):
        slow = [speed for speed in speeds if recedes or speed <= FASTEST_ADVANCE]
        points = [measured(speed, cells, recedes=recedes) for speed in slow]
        of_line = np.concatenate([point[0] for point in points])
        work = np.concatenate([point[1] for point in points])
        expected = [theory(speed, recedes=recedes) for speed in of_line]
        table.append((name, of_line, work, np.array(expected)))
        line.plot(of_line, work, marker, color=colour, mfc="w" if recedes else None, label=f"line {name}", markersize=4)
        drawn = np.geomspace(0.1, 1000, 80)
        line.plot(drawn, [theory(speed, recedes=recedes) for speed in drawn], color=colour)
        for row in zip(of_line, work, expected, strict=True):
            print(f"line {name} at {row[0]:.3g} ranges/s: work {row[1]:.3f} w, theory {row[2]:.3f} w")
    for level, text in ((1 / GLASSY, r"$C(\infty)/C(0)$"), (1.0, ""), (GLASSY, r"$C(0)/C(\infty)$")):
        line.axhline(level, color="0.7", linewidth=0.8, zorder=0)
        line.annotate(text, (0.12, level * 1.05), color="0.4", va="bottom", fontsize=8)
    line.set(
        xscale="log", yscale="log", xlim=(0.1, 1000), ylim=(0.07, 17),
        xlabel="speed of the contact line [ranges per s]", ylabel="work $G/w$",
    )  # fmt: skip
    line.legend(
        frameon=False, fontsize=8, title="points: computed, lines: theory", title_fontsize=8, loc="lower left",
        bbox_to_anchor=(0.0, 0.17), alignment="left",
    )  # fmt: skip
    for speed, colour, look in ((1.0, BLUE, "o-"), (10.0, VERMILION, "s--")):
        largest = pull_offs(holds, speed, cells)
        table.append((speed, np.array(holds), np.array(largest), None))
        name = f"{speed:g} range{'s' * (speed != 1)} per s"
        dwell.plot(holds, largest, look, color=colour, label=name, markersize=4)
        print(f"pull-off at {speed:g} ranges/s after holds of {holds} s: {np.round(largest, 3)} pi w R")
    dwell.set(xscale="log", xlabel="time of hold [retardation times]", ylabel=r"pull-off $/\,\pi w R$")
    dwell.set_ylim(bottom=0)
    dwell.legend(title="pulled at", frameon=False, fontsize=8, title_fontsize=8)
    fig.savefig(figure, dpi=200)
    return table


if __name__ == "__main__":
    main(*sys.argv[1:])
