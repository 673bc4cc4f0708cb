"""Line contacts by dense matrices and active sets: steady sliding, and one instant of a history."""

import numpy as np

import roughvisc as rv
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.materials.series import complex_compliance
from roughvisc.mechanics.steady_sliding import Sliding, steady_state

PERIOD, TIME = 1e-3, 1e-3


def rubber(ratio=3.0):
    """Modulus 1 MPa at once, and so many times the compliance retarded."""
    return rv.zener(1e6, 1e6 / ratio, 1e6 / ratio * TIME)


def slid(height, material, speed, load, body=HALF_SPACE, side=PERIOD, **settings):
    """On a square surface, or on a strip of square cells."""
    nx, ny = height.shape
    spacing = (side / nx, side / ny if ny > 3 else side / nx)
    sliding = Sliding(Body(material, body), height.shape, spacing, speed)
    return steady_state(sliding, height.max() - height, load, **settings)


def dense_matrix(symbol):
    """The matrix whose first column is the response of the other cells to pressure on the first one."""
    n = len(symbol)
    return np.fft.ifft(symbol).real[(np.arange(n)[:, None] - np.arange(n)) % n]


def settled(matrix, gap, total, active, most):
    """Pressure by a dense active-set method, or None where the set does not settle."""
    for _ in range(most):
        cells = np.flatnonzero(active)
        system = np.block([[matrix[np.ix_(cells, cells)], -np.ones((len(cells), 1))], [np.ones((1, len(cells))), 0.0]])
        solution = np.linalg.solve(system, np.append(-gap[cells], total))
        pressure = np.zeros(len(gap))
        pressure[cells] = solution[:-1]
        opening = gap + matrix @ pressure - solution[-1]
        wrong = (active & (pressure < 0)) | (~active & (opening < -1e-13 * np.ptp(gap)))
        if not wrong.any():
            return pressure
        active = active ^ wrong
        if not active.any():
            return None
    return None


def half_space_symbol(material, speed):
    """Complex displacement over pressure of waves on a half-space, in the frame of what slides."""
    return lambda q: 2 / np.abs(q) * complex_compliance(material, -q * speed)


def dense(height, symbol, load, start=None):
    """Line contact on any body by dense matrices and active sets: pressure of the cells. [Pa]

    ``g + K p >= delta`` with equality where ``p > 0``, and ``K`` of complex displacements over pressure, `symbol`, of
    wave numbers along the motion, that of zero left out. Where the set does not settle at once, the skew part of the
    matrix is added in steps, each of which begins with the contact of the one before.
    """
    n = len(height)
    q = 2 * np.pi * np.fft.fftfreq(n, PERIOD / n)
    symbol = np.append(0j, symbol(q[1:]))
    if n % 2 == 0:
        symbol[n // 2] = symbol[n // 2].real
    gap, total = height.max() - height, load / (PERIOD / n) ** 2
    lowest = gap < np.quantile(gap, 0.3)
    pressure = settled(dense_matrix(symbol), gap, total, lowest if start is None else start, 15)
    if pressure is not None:
        return pressure
    pressure = settled(dense_matrix(symbol.real + 0j), gap, total, lowest, 100)
    done, step = 0.0, 1.0
    while done < 1:
        step = min(step, 1 - done)
        found = settled(dense_matrix(symbol.real + 1j * (done + step) * symbol.imag), gap, total, pressure > 0, 12)
        if found is None:
            step /= 2
            assert step > 1e-6, "the active set does not settle"
        else:
            pressure, done, step = found, done + step, 2 * step
    return pressure


def line_profiles(cells):
    """Heights of lines: a wave, a rough line and a broad bump. [m]"""
    x = (np.arange(cells) + 0.5) / cells
    rough = rv.self_affine(
        (PERIOD, 3 * PERIOD / cells), (cells, 3), hurst=0.8, rms_slope=0.1, rolloff=PERIOD / 3, seed=1
    )
    return {"wave": 1e-5 * np.cos(2 * np.pi * x), "rough": rough.values[:, 0], "broad": -1e-5 * np.abs(2 * x - 1) ** 4}
