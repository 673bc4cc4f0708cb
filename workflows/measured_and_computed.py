"""Results next to measured records and to an independent program in motion: the rows of docs/measured.md.

    python workflows/measured_and_computed.py rolling [FIGURE]
    python workflows/measured_and_computed.py cell [FIGURE]
    python workflows/measured_and_computed.py brain [FIGURE]
    python workflows/measured_and_computed.py brain_retraction [FIGURE]
    python workflows/measured_and_computed.py bead EXPORT [FIGURE]
    python workflows/measured_and_computed.py challenge SURFACE [SHA256]

Each prints its numbers and writes a figure if it is named. `bead` and `challenge` need a file that is not copied here;
docs/measured.md states its source.
"""

import hashlib
import json
import logging
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import roughvisc as rv

plt.style.use("roughvisc.plot.roughvisc")
logging.getLogger("roughvisc").setLevel(logging.ERROR)  # the warnings of slopes are part of the page
RECORDS = Path(__file__).parent / "records"
#: Range of the attraction between bead and tissue [m], the shortest that the cells resolve, and segments of the record.
REACH_OF_TISSUE = 1.7e-6
SEGMENTS = ("approach", "hold", "retract")
#: Coarse settings: the error of a record is larger than 1 %.
SETTINGS = {"boundary": "free", "tolerance": 1e-2, "fields": (), "grid_error": False, "progress": False}


def rolling(figure=None):
    """Steady rolling of two viscoelastic cylinders (Wang and Knothe, 1993), next to the program CONTACT.

    Peak pressures and centres of the first and last cell in contact, in cells from the axis, are those of cases 2 and 3
    in examples/visc_cylindr.ref_out of CONTACT.
    """
    modulus, radius, load, side = 1143e6, 50e-3, 600e3, 0.16e-3  # Pa, m, N/m, m
    program = {"2": (9e-3, 1024, 78.74, -24.5, 36.5), "3": (45e-3, 4096, 84.72, -24.5, 31.5)}
    rows = {}
    for case, (time, cells, peak, first, last) in program.items():
        body = rv.zener(modulus, modulus, modulus * time, poisson=0.4)
        x = (np.arange(cells) + 0.5 - cells / 2) * side
        cylinder = rv.from_array(np.repeat((-(x**2) / (2 * radius))[:, None], 4, axis=1), (side, 8 * side))
        pressure = load / (cells * side)
        settings = {"fields": "pressure", "progress": False}
        ds = rv.friction(cylinder, rv.pair(body, body), pressure=pressure, speeds=1.0, **settings)
        computed = ds.pressure[0].mean("y").values / 1e6
        touching = np.flatnonzero(computed > 0) + 0.5 - cells / 2
        rows[case] = {
            "time [s]": time,
            "peak by CONTACT [MPa]": peak,
            "peak [MPa]": computed.max(),
            "cells by CONTACT": [first, last],
            "cells": [touching[0], touching[-1]],
            "profile": (1e3 * x, computed),
        }
    if figure:
        fig, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        for number, (case, row) in enumerate(rows.items()):
            x, computed = row["profile"]
            axes.plot(
                x,
                computed,
                "-" if number == 0 else "--",
                color=f"C{number}",
                label=f"case {case}, {1e3 * row['time [s]']:g} ms",
            )
            axes.plot(0.16 * np.array(row["cells by CONTACT"]), [0, 0], "|", color=f"C{number}", markersize=12)
            axes.axhline(row["peak by CONTACT [MPa]"], color=f"C{number}", linestyle=":")
        axes.set(xlim=(-7, 9), xlabel="x along the motion [mm]", ylabel="Pressure [MPa]")
        axes.plot([], [], ":", color="0.4", label="peak and ends by CONTACT")
        axes.legend(loc="lower center")
        fig.savefig(figure, dpi=200)
    return {case: {key: value for key, value in row.items() if key != "profile"} for case, row in rows.items()}


def cell(figure=None):
    """A cell that relaxes at constant height: fitted on the first 10 s of the hold, predicted to 30 s."""
    record = rv.read_record(RECORDS / "cell.csv", height="height", spring=1.0677)
    record["force"] = record.force - record.force[:200].median()  # of the pause
    hold = record.time[record.segment == "hold"].values
    ball = rv.sphere("10 um", "40 um", 48)  # the radius is unknown: it scales the modulus alone
    held = record.isel(time=record.segment.values != "retract")
    rows, curves = {}, {}
    for name, terms in {"all times": None, "0.3, 3 s": [0.3, 3], "0.2, 2, 20 s": [0.2, 2, 20]}.items():
        fit = rv.fit_material(record.sel(time=slice(None, hold[0] + 10)), ball, terms, contact_point=0.0)
        start = fit.contact_time(record)
        times = np.append(np.linspace(0.2, hold[0] - start, 6), hold[0] - start + np.geomspace(0.05, 29.9, 25))
        ds = rv.simulate(ball, fit.material, fit.program(held), times=list(times), **SETTINGS)
        measured = record.force.interp(time=times + start).values
        since = times + start - hold[0]
        deviation = 1e9 * (ds.force.values - measured)
        parts = {"approach": since < 0, "fitted hold": (since >= 0) & (since <= 10), "predicted hold": since > 10}
        rows[name] = {f"rms in {part} [nN]": np.sqrt(np.mean(deviation[is_in] ** 2)) for part, is_in in parts.items()}
        rows[name]["force at the end [nN]"] = 1e9 * float(ds.force[-1])
        curves[name] = since, 1e9 * ds.force.values
    if figure:
        fig, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        axes.plot(record.time - hold[0], record.force * 1e9, color="0.5", label="measured")
        for (name, curve), marker in zip(curves.items(), "o^s", strict=True):
            axes.plot(*curve, marker, fillstyle="none", label=f"computed, {name}")
        axes.axvspan(10, 30, color="0.93", zorder=0)
        axes.text(20, 300, "predicted", ha="center")
        axes.set(xlabel="Time since the start of the hold [s]", ylabel="Force [nN]", xlim=(-1.5, 31), ylim=(-20, 340))
        axes.legend(loc="lower center")
        fig.savefig(figure, dpi=200)
    return {"measured peak and end [nN]": [1e9 * measured.max(), 1e9 * measured[-1]], **rows}


def brain_record():
    """Return the record of brain tissue without the offset of its force, and the bead."""
    record = rv.read_record(RECORDS / "brain.csv", height="height", spring=0.061)
    record["force"] = record.force - record.force[:500].median()
    return record, rv.sphere("18.64 um", "60 um", 48)


def brain(figure=None):
    """Brain tissue, creep under a held force: fitted on approach and half of the hold, for four contact points."""
    record, bead = brain_record()
    hold = record.time[record.segment == "hold"].values
    held = record.isel(time=record.segment.values != "retract")
    middle, end = hold[0] + 1.5, hold[-1] - 0.01
    touched = float(record.time[int(np.argmax(record.force.values > 0.15e-9))])
    rows, curves = {}, {}
    for earlier in (0, 60, 120, 180, None):  # ms; None: the contact point is searched
        depth_then = record.approach.sel(time=touched - (earlier or 0) / 1e3, method="nearest")
        contact = None if earlier is None else float(depth_then)
        fit = rv.fit_material(held.sel(time=slice(None, middle)), bead, ["0.15 s", "2 s"], contact_point=contact)
        start = fit.contact_time(record)
        times = np.append(
            np.linspace(0.3, hold[0] - start, 6), hold[0] - start + (end - hold[0]) * np.linspace(0, 1, 31)[1:] ** 2
        )
        ds = rv.simulate(bead, fit.material, fit.program(held, "load"), times=list(times), **SETTINGS)
        depth = ds.approach.values + fit.contact_point
        predicted = 1e9 * (depth[-1] - np.interp(middle - start, times, depth))
        name = "searched" if earlier is None else f"{earlier} ms before 0.15 nN" if earlier else "at 0.15 nN"
        rows[name] = {
            "contact point [um]": 1e6 * fit.contact_point,
            "error [um]": 1e6 * fit.contact_point_error,
            "misfit": fit.misfit,
            "creep in the rest of the hold [nm]": predicted,
        }
        curves[name] = times + start, depth
    creep = float(record.approach.interp(time=end) - record.approach.interp(time=middle))
    if figure:
        fig, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        axes.plot(record.time, 1e6 * record.approach, color="0.5", label="measured")
        dashes = ("-", "--", "-.", ":", (0, (1, 2)))
        for dash, (name, (time, depth)) in zip(dashes, curves.items(), strict=True):
            axes.plot(time, 1e6 * depth, linestyle=dash, label=f"contact {name}")
        axes.axvspan(middle, end, color="0.93", zorder=0)
        axes.set(xlim=(2.8, 6.1), ylim=(29.4, 32), xlabel="Time [s]", ylabel="Depth from the first row [µm]")
        axes.text(5.25, 31.75, "predicted", ha="center")
        axes.legend(loc="lower right")
        fig.savefig(figure, dpi=200)
    return {"measured creep in the rest of the hold [nm]": 1e9 * creep, **rows}


def brain_retraction(figure=None):
    """The recorded depth through the retraction: force, measured and computed, without and with adhesion.

    The work of adhesion is the one that gives the measured pull-off; its range is the shortest that the cells resolve.
    """
    record, bead = brain_record()
    fit = rv.fit_material(record, bead)
    start = fit.contact_time(record)
    program = fit.program(record)
    times = np.linspace(0.05, program.duration, 60)
    measured = record.force.interp(time=times + start).values
    segment = record.segment.sel(time=times + start, method="nearest").values

    def computed(work):
        sticky = rv.adhesion(work=work, range=REACH_OF_TISSUE) if work else None
        return rv.simulate(bead, fit.material, program, times=list(times), adhesion=sticky, **SETTINGS)

    work = 5e-5  # the pull-off is nearly proportional to it
    for _ in range(2):
        work *= measured.min() / float(computed(work).force.min())
    runs = {"without adhesion": computed(None), f"{1e6 * work:.0f} µJ/m²": computed(work)}
    rows = {"least force, measured [nN]": 1e9 * measured.min(), "at [s]": times[measured.argmin()]}
    for name, ds in runs.items():
        deviation = 1e9 * (ds.force.values - measured)
        rows[name] = {f"rms in {one} [nN]": np.sqrt(np.mean(deviation[segment == one] ** 2)) for one in SEGMENTS}
        rows[name] |= {"least force [nN]": 1e9 * float(ds.force.min()), "at [s]": times[int(ds.force.values.argmin())]}
    if figure:
        fig, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        axes.plot(record.time - start, 1e9 * record.force, color="0.5", label="measured")
        for line, marker, (name, ds) in zip(("--", "-"), "os", runs.items(), strict=True):
            axes.plot(ds.time, 1e9 * ds.force, line, marker=marker, markersize=3, label=f"computed, {name}")
        axes.axhline(0, color="0.8", zorder=0)
        axes.set(xlabel="Time since first contact [s]", ylabel="Force [nN]", xlim=(-0.2, times[-1]))
        axes.legend(loc="lower left")
        fig.savefig(figure, dpi=200)
    return rows


def bead(export, figure=None):
    """A bead at 7 um/s (Optics11): the force at the recorded depths, by the modulus of the instrument."""
    record = rv.read_record(export, approach="Indentation")
    loading = record.isel(time=slice(None, int(np.argmax(record.force.values)) + 1))
    first = max(int(np.argmax(loading.approach.values > 0)) - 1, 0)
    loading = loading.isel(time=slice(first, None))
    time, depth, force = (loading[name].values for name in ("time", "approach", "force"))
    modulus = 156.009  # E / (1 - nu^2), by the instrument from this record [Pa]
    chosen = np.unique(np.linspace(0, time.size - 1, 200).astype(int))
    program = rv.Program.table((time - time[0])[chosen].tolist(), (depth - depth[0])[chosen].tolist(), "approach")
    kept = chosen[4::5]
    times = [float(one) for one in (time - time[0])[kept]]
    material = rv.elastic(young_modulus=0.75 * modulus)
    ds = rv.simulate(rv.sphere("27.5 um", "60 um", 64), material, program, times=times, **SETTINGS)
    measured = force[kept]
    deviation = ds.force.values - measured
    if figure:
        fig, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        axes.plot(1e6 * (depth - depth[0]), 1e9 * force, color="0.5", label="measured")
        axes.plot(1e6 * ds.approach, 1e9 * ds.force, "C0o", label="computed")
        axes.set(xlabel="Depth [µm]", ylabel="Force [nN]")
        axes.legend()
        fig.savefig(figure, dpi=200)
    return {
        "rms over the largest force": np.sqrt(np.mean(deviation**2)) / measured.max(),
        "force at the largest depth, measured and computed [nN]": [1e9 * measured[-1], 1e9 * float(ds.force[-1])],
    }


def challenge(surface, checksum=None):
    """The surface of the contact mechanics challenge, without its adhesion: area and mean gap at its reference load."""
    found = hashlib.sha256(Path(surface).read_bytes()).hexdigest()
    if checksum is not None and found != checksum.lower():
        raise rv.InputError(key="SHA256", found=checksum, expected=f"{found}, that of {surface}")
    height = rv.open_scan(surface, format="h5", spacing=1e-4 / 2048, unit="m", height_scale=1e-4)
    modulus = 25e6
    program = rv.Program().pressure(0.01 * modulus, over=1)
    material = rv.elastic(young_modulus=0.75 * modulus)
    ds = rv.simulate(rv.invert(height), material, program, boundary="periodic", times=[1], fields=())
    area, gap = float(ds.contact_fraction[-1]), float(ds.mean_gap[-1])
    return {"SHA-256": found, "contact fraction": area, "mean gap [m]": gap}


def _rounded(value):
    """Return a table with all numbers to four digits."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    return value if isinstance(value, str) else float(f"{value:.4g}")


if __name__ == "__main__":
    commands = {one.__name__: one for one in (rolling, cell, brain, brain_retraction, bead, challenge)}
    if len(sys.argv) < 2 or sys.argv[1] not in commands:
        sys.exit(__doc__)
    print(json.dumps(_rounded(commands[sys.argv[1]](*sys.argv[2:])), indent=1))
