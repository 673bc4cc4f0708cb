"""Write surfaces/ground_steel.x3p, a synthetic scan of ground steel with typical faults of a measurement.

    python workflows/make_ground_steel.py [FILE]

The roughness is elongated along the grinding direction x. The scan has tilt, an offset, noise, missing points on steep
flanks and spikes next to them. The file is reproduced byte for byte, up to the version of the writer.
"""

import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import x3pio

SIZE, SHAPE = (1.0e-3, 0.9e-3), (256, 224)  # cells of 3.906 x 4.018 um


def texture(rng: np.random.Generator) -> np.ndarray:
    """Return long grooves and their fine structure [m], both periodic."""
    (nx, ny), (q_l, q_s) = SHAPE, (2 * np.pi / 60e-6, 2 * np.pi / 17e-6)
    along = [2 * np.pi * np.fft.fftfreq(nx, SIZE[0] / nx), 2 * np.pi * np.fft.rfftfreq(ny, SIZE[1] / ny)]
    q = np.hypot(2 * along[0][:, None], along[1] / 2)  # four times longer along x
    z_q = np.where((q > 0) & (q < q_s), np.maximum(q, q_l) ** -1.8, 0) * np.exp(2j * np.pi * rng.random(q.shape))
    z_q[nx // 2 + 1 :, 0] = z_q[1 : nx // 2, 0][::-1].conj()
    z = np.fft.irfft2(z_q, SHAPE)
    return 0.5e-6 * z / np.sqrt(np.mean(z**2))


def measured() -> np.ndarray:
    """Return heights over (x, y) [m] with tilt, noise, missing points and spikes."""
    rng = np.random.default_rng(20_25)
    z = texture(rng)
    z -= 0.06e-6 * (z / 0.5e-6) ** 2  # grinding leaves deeper grooves than ridges
    steep = np.hypot(*np.gradient(z, *(size / n for size, n in zip(SIZE, SHAPE, strict=True))))
    lost = (steep > np.quantile(steep, 0.97)) & (rng.random(SHAPE) < 0.25)
    beside = (np.roll(lost, 1, axis=0) | np.roll(lost, 1, axis=1)) & ~lost & (rng.random(SHAPE) < 0.1)
    z += rng.normal(0, 5e-9, SHAPE) + np.where(beside, rng.choice([-1, 1], SHAPE) * rng.uniform(2e-5, 4e-5, SHAPE), 0)
    x, y = ((np.arange(n) + 0.5) * size / n for n, size in zip(SHAPE, SIZE, strict=True))
    z += 4e-3 * x[:, None] - 2.5e-3 * y + 12e-6
    return np.where(lost, np.nan, z)


def main(path: Path) -> None:
    """Write the scan."""
    metadata = x3pio.Metadata.for_software("roughvisc", "0")
    metadata.date = datetime(2025, 1, 1, tzinfo=UTC)
    metadata.creator = "workflows/make_ground_steel.py of roughvisc"
    metadata.comment = "Synthetic: no surface was measured."
    # x3p has rows along y
    cell = [size / n for size, n in zip(SIZE, SHAPE, strict=True)]
    x3pio.write(path, measured().T, x_scale=cell[0], y_scale=cell[1], z_type=x3pio.DataType.FLOAT32, metadata=metadata)


if __name__ == "__main__":
    default = Path(__file__).parents[1] / "surfaces" / "ground_steel.x3p"
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else default)
