"""What a layer costs over a half-space: time and memory of creep, in a process of its own each.

    python workflows/benchmarks/layers.py [CELLS] [--tolerance T]

A rough periodic surface on 256 squared cells, unless another number is given, is pressed for ten seconds and kept at 50
times: on a layer with five retardation times upon a Zener material; on a half-space with as many exponentials as the
waves of the layered body take; and on a half-space of the layer's material. Printed are the exponentials, processor
time, steps, convolutions, the largest stated error, and the memory of the process over what the plan counts for it.
"""

import argparse
import multiprocessing
import resource
import time

import numpy as np

import roughvisc as rv
from roughvisc.experiment.resources import PROCESS, march_bytes
from roughvisc.experiment.scene import memory_options
from roughvisc.mechanics.bodies.body import body_of
from roughvisc.mechanics.stepping.wave_memory import choose_body_memory
from roughvisc.settings import Settings

SIDE, TIMES = 1e-3, 50
KINDS = ("layer", "half-space, as many", "half-space, its own")


def body(kind, program, settings):
    """What is pressed."""
    five = rv.from_relaxation(1e6, [1e6] * 5, [1e-3, 1e-2, 1e-1, 1.0, 10.0])
    layered = rv.layer(five, 1e-4, on=rv.zener(1e7, 2e6, 2e4))
    if kind == "layer":
        return layered
    if kind == "half-space, its own":
        return body_of(five)
    memory = choose_body_memory(layered, **memory_options(program.on_area(SIDE**2), settings)).memory
    count = len(memory.series.times)
    times = tuple(np.geomspace(1e-3, 20, count).tolist())
    return body_of(rv.Prony(five.glassy, 0.0, (sum(five.compliances) / count,) * count, times))


def measure(kind, cells, tolerance, sender):
    """Send the row of one body."""
    surface = rv.self_affine(SIDE, cells, hurst=0.8, rms_slope=0.1, rolloff=SIDE / 4, seed=1)
    program = rv.Program().pressure(1e5, over=0.05).hold(10.0)
    settings = Settings(boundary="periodic", times=TIMES, tolerance=tolerance, fields=())
    pressed = body(kind, program, settings)
    memory = choose_body_memory(pressed, **memory_options(program.on_area(SIDE**2), settings)).memory
    began = time.process_time()
    ds = rv.simulate(
        surface, pressed, program, boundary="periodic", times=TIMES, tolerance=tolerance, fields=(), progress=False
    )
    took = time.process_time() - began
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    steps, contact = ds.roughvisc.steps.sizes["step"], float(ds.contact_fraction.max())
    planned = PROCESS + march_bytes(
        settings, cells**2, memory, contact=contact, steps=steps, rows=ds.sizes["time"], in_memory=True
    )
    sender.send(
        {
            "body": kind,
            "exponentials": len(memory.material.times),
            "processor": round(took, 2),
            "steps": steps,
            "convolutions": int(ds.convolutions.sum()),
            "stated_error": float(ds.stated_error.max()),
            "memory": used,
            "used over planned": round(used / planned, 2),
        }
    )


def main(cells=256, tolerance=1e-3):
    """Print a row for each body."""
    context = multiprocessing.get_context("spawn")
    rows = []
    for kind in KINDS:
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=measure, args=(kind, cells, tolerance, sender))
        process.start()
        rows.append(receiver.recv())
        process.join()
        print(rows[-1], flush=True)
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", type=int, nargs="?", default=256)
    parser.add_argument("--tolerance", type=float, default=1e-3)
    main(**vars(parser.parse_args()))
