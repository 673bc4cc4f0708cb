"""Whether storage and loss moduli belong together: Kramers and Kronig, by positive spectra."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roughvisc.mechanics.materials.spectrum import lattice, nonnegative

Array = NDArray[np.float64]

#: Relaxation times offered in a decade, and how far beyond the measured frequencies: what relaxes there is seen.
_PER_DECADE, _BEYOND = 5, 1e3
#: Both together may be off by so many times what each alone is, and by so much [-], before they are said to be at odds.
_ODDS, _LEAST = 2.0, 0.02
#: Of fewer rows than these one spectrum for each modulus meets part of the noise: by so much both must be off then.
_FEW, _LEAST_OF_FEW = 10, 0.06
#: What a single modulus misses of all spectra is no noise where both together are off by so much [-], and by so many
#: times what neighbouring rows differ by.
_GROSS, _ABOVE_SCATTER = 0.1, 3.0
#: Standard deviation of normal noise over the median size of the difference of two draws.
_OF_MEDIAN = 1.4826 / math.sqrt(2)
#: Residuals are averaged over so many decades to tell where the moduli are at odds.
_WIDTH = 0.5


@dataclass(frozen=True)
class Disagreement:
    """How far measured moduli are from those of any passive material.

    Attributes
    ----------
    together, alone : float
        Relative misfit (rms) of one positive spectrum to both moduli, and of one to each. [-]
    frequency : float
        Where one for both is off most. [rad/s]
    storage, loss : float
        What is measured there, over that spectrum, less one. [-]
    """

    together: float
    alone: float
    frequency: float
    storage: float
    loss: float

    @property
    def note(self) -> str:
        """In words."""
        return (
            f"storage and loss moduli are at odds (Kramers and Kronig): the nearest passive material is "
            f"{100 * self.together:.2g} % off (rms), a material for each modulus alone {100 * self.alone:.2g} %; most "
            f"at {self.frequency:.3g} rad/s, where the measured storage modulus is {100 * self.storage:+.2g} % and the "
            f"loss modulus {100 * self.loss:+.2g} % off"
        )


def disagreement(omega: Array, storage: Array, loss: Array) -> Disagreement | None:
    r"""How far storage and loss moduli are at odds; None if they are not.

    Parameters
    ----------
    omega : ndarray, shape (rows,)
        Angular frequencies, in any order. [rad/s]
    storage, loss : ndarray, shape (rows,)
        Moduli, not negative. [Pa]

    Notes
    -----
    Moduli of a passive material are sums of :math:`G_k \omega^2\theta_k^2/(1 + \omega^2\theta_k^2)` and
    :math:`G_k \omega\theta_k/(1 + \omega^2\theta_k^2)` with the same :math:`G_k \ge 0`, which is more than the
    relations of Kramers and Kronig ask. Three fits by non-negative least squares, to both and to each alone, on times
    from a thousandth of the shortest to a thousand times the longest: data that belong together are met together as
    well as alone, within their noise. No integral over frequencies is taken, so that none beyond the measured ones is
    needed.

    Data of noise up to 5 % pass. A factor that only one modulus has is seen where the loss modulus tells more of the
    storage modulus than its noise: a loss of 5 % of the storage modulus may be wrong by a half before it is. What no
    spectrum can give of a single modulus, as a step, is seen where it is more than 10 % and no scatter of the rows.
    """
    times = lattice(1 / (_BEYOND * float(omega.max())), _BEYOND / float(omega.min()), _PER_DECADE)
    x = omega[:, None] * times
    in_phase = np.column_stack([np.ones(omega.size), x**2 / (1 + x**2)])
    behind = np.column_stack([np.zeros(omega.size), x / (1 + x**2)])
    smallest = 1e-3 * np.hypot(storage, loss)
    parts = [(in_phase, storage, np.maximum(storage, smallest)), (behind, loss, np.maximum(loss, smallest))]
    alone, free, order = 0.0, 2 * omega.size, np.argsort(omega, kind="stable")
    steps: list[Array] = []
    for columns, target, scale in parts:
        moduli = nonnegative(columns, target, scale)
        misfit = (columns @ moduli - target) / scale
        alone += float(np.sum(misfit**2))
        steps.append(np.diff(misfit[order]))
        free -= int(np.count_nonzero(moduli))
    if free <= 0:  # as many terms as numbers: whatever they are, they are met
        return None
    matrix, target, scale = (np.concatenate(part) for part in zip(*parts, strict=True))
    off = (target - matrix @ nonnegative(matrix, target, scale)) / scale
    together, noise = float(np.sqrt(np.mean(off**2))), math.sqrt(alone / free)
    scatter = float(np.median(np.abs(np.concatenate(steps)))) * _OF_MEDIAN
    patterned = together > max(_GROSS, _ABOVE_SCATTER * scatter)
    least = _LEAST if omega.size >= _FEW else _LEAST_OF_FEW
    if together <= max(_ODDS * noise, least) and not patterned:
        return None
    apart = np.abs(np.log10(omega[:, None] / omega)) <= _WIDTH / 2
    smooth = [(apart @ one) / apart.sum(axis=1) for one in (off[: omega.size], off[omega.size :])]
    worst = int(np.argmax(np.hypot(*smooth)))
    fitted = [one[worst] / (1 - one[worst]) if one[worst] < 1 else math.inf for one in smooth]
    return Disagreement(together, noise, float(omega[worst]), float(fitted[0]), float(fitted[1]))
