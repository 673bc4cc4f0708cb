"""The paper's first case: a sphere on a Maxwell half-space under a step load.

Pressure profiles at several times against the closed form (Lee and Radok), in the paper's dimensionless axes:
pressure over the Hertz peak pressure at time zero, against radius over the Hertz contact radius at time zero.

    python workflows/maxwell_step.py [CELLS] [FIGURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import roughvisc as rv
from roughvisc import closed_forms

RADIUS, LOAD = 10e-3, 1.0  # m, N
RELAXATION_TIME = 1.0  # s


def main(cells=128, figure="maxwell_step.png"):
    rubber = rv.maxwell(shear_modulus=1e6, viscosity=1e6 * RELAXATION_TIME)
    times = RELAXATION_TIME * np.array([0.0, 0.5, 1.0, 2.0])
    fig = Figure(figsize=(5.2, 3.6), layout="constrained")
    axes = fig.add_subplot()
    compare(axes, rubber, times, cells, RELAXATION_TIME)
    axes.set_title("Maxwell half-space, load applied at $t = 0$")
    fig.savefig(figure, dpi=200)
    return fig


def relaxation(material):
    """Return equilibrium modulus, relaxing moduli [Pa] and times [s] of a Maxwell or a Zener material."""
    glassy, retarded = material.glassy, sum(material.compliances)
    equilibrium = 0.0 if material.fluidity else 1 / (glassy + retarded)
    time = glassy / material.fluidity if material.fluidity else material.times[0] * glassy / (glassy + retarded)
    return equilibrium, np.array([1 / glassy - equilibrium]), np.array([time])


def pressure_of(contact, r, t):
    """Pressure of a growing contact, ``2/(pi R) int E(t - s) d sqrt(a(s)^2 - r^2)``, as a sum over 1000 steps."""
    equilibrium, moduli, times = relaxation(contact.material)
    since = t * np.linspace(0, 1, 1001) ** 2
    age = t - (since[1:] + since[:-1]) / 2
    relaxed = equilibrium + np.exp(-np.append(t, age)[:, None] / times) @ moduli  # first: the jump
    depth = np.sqrt(np.maximum(contact.radius(since) ** 2 - np.asarray(r)[..., None] ** 2, 0))
    modulus = 2 / (1 - contact.material.poisson) * relaxed
    return 2 / (np.pi * contact.sphere_radius) * (np.diff(depth, prepend=0) @ modulus)


def compare(axes, rubber, times, cells, unit_of_time):
    """Draw computed and exact profiles; returns the largest relative L1 error of the pressure."""
    exact = closed_forms.lee_radok(RADIUS, rubber, LOAD)
    hertz = closed_forms.hertz(RADIUS, 1 / float(rubber.contact_compliance(0.0)), LOAD)
    size = 2.3 * float(exact.radius(times[-1]))
    ball = rv.sphere(RADIUS, size, cells)
    program = rv.Program().load(LOAD, over=0).hold(times[-1])
    ds = rv.simulate(ball, rubber, program, times=times, tolerance=1e-3, progress=False)
    distance = np.hypot(ds.x - size / 2, ds.y - size / 2)
    errors = []
    colours = ("#000000", "#0072B2", "#D55E00", "#009E73")
    for i, (t, colour, marker) in enumerate(zip(times, colours, "os^D", strict=True)):
        r = np.linspace(0, 1.1 * float(exact.radius(t)), 400)
        axes.plot(r / hertz.radius, pressure_of(exact, r, t) / hertz.peak_pressure, color=colour, lw=1.2)
        middle = ds.pressure[i, :, cells // 2]
        axes.plot(distance[:, cells // 2] / hertz.radius, middle / hertz.peak_pressure, marker, ms=2.8, mfc="none",
                  color=colour, label=f"$t = {t / unit_of_time:g}\\,\\tau$")  # fmt: skip
        error = np.abs(ds.pressure[i].values - pressure_of(exact, distance.values, t)).sum()
        errors.append(float(error / ds.pressure[i].sum()))
    axes.set(xlabel="radius over Hertz radius, $r / a_H$", ylabel="pressure over Hertz peak, $p / p_H$")
    axes.set(xlim=(0, None), ylim=(0, None))
    axes.legend(title="computed; lines: closed form", frameon=False, fontsize="small", title_fontsize="small")
    return max(errors)


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
