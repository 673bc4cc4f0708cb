"""Creep compliance from a relaxation modulus in exponentials, exactly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roughvisc.errors import InputError
from roughvisc.mechanics.materials.bulk import in_volume
from roughvisc.mechanics.materials.checks import Kind, check_number, tensile_to_shear
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.secular import merged, secular_roots
from roughvisc.units import Quantity, quantities


@quantities(equilibrium="Pa", moduli="Pa", times="s", bulk_modulus="Pa")
def from_relaxation(
    equilibrium: Quantity,
    moduli: Sequence[Quantity],
    times: Sequence[Quantity],
    poisson: float | None = None,
    *,
    kind: Kind = "shear",
    bulk_modulus: Quantity | None = None,
) -> Prony:
    r"""Generalised Maxwell solid, ``G(t) = G_e + sum G_i exp(-t / theta_i)``, as finite-element codes state it.

    Parameters
    ----------
    equilibrium : float or str
        ``G_e``; exactly zero makes a fluid. [Pa]
    moduli, times : sequence of float or str
        ``G_i`` [Pa] and relaxation times ``theta_i`` [s].
    poisson : float
        Poisson ratio; a half unless given.
    kind : {"shear", "tensile"}
        Whether the moduli are shear moduli or Young's moduli, ``E = 2 G (1 + nu)``.
    bulk_modulus : float or str
        Elastic bulk modulus, in place of a Poisson ratio; with shear moduli. [Pa]

    Returns
    -------
    Prony
        The same material by its creep compliance.

    Raises
    ------
    InputError
        If a modulus is negative, a time is not positive, or their numbers differ; if all moduli are zero; or if a
        bulk modulus is given with a Poisson ratio or with Young's moduli.

    Notes
    -----
    The retardation rates are the zeros of ``G_e - sum G_i lambda / (r_i - lambda)``, found between
    consecutive rates ``r_i = 1/theta_i``.
    """
    check_number("equilibrium", equilibrium, "Pa", zero=True)
    if len(moduli) != len(times):
        raise InputError(f"{len(moduli)} moduli for {len(times)} times: expected as many")
    for i, (modulus, time) in enumerate(zip(moduli, times, strict=True)):
        check_number(f"moduli[{i}]", modulus, "Pa", zero=True)
        check_number(f"times[{i}]", time, "s")
    if kind == "tensile" and bulk_modulus is not None:
        raise InputError(
            f"kind is 'tensile' and bulk_modulus is {bulk_modulus!r}: expected shear moduli, or a Poisson ratio"
        )
    factor = tensile_to_shear(kind, 0.5 if poisson is None else poisson)
    weights, rates = merged(moduli, times)
    equilibrium, weights = equilibrium / factor, weights / factor
    glassy_modulus = equilibrium + float(np.sum(weights))
    if glassy_modulus == 0:
        raise InputError("all moduli are zero: expected a positive equilibrium modulus or one in `moduli`")
    # dividing G~(s) = G_e + sum G_i s/(s + r_i) by s makes the equilibrium modulus a pole at zero like the others:
    # G~(-m)/(-m) = -G_e/m + sum G_i/(r_i - m), one zero between each two poles and none above the last
    poles = np.append(0.0, rates) if equilibrium else rates
    strengths = np.append(equilibrium, weights) if equilibrium else weights
    compliances, retardations = [], []
    for rate, offset in secular_roots(strengths, poles, 0.0):
        # 1/G~ has the residue J_k rate there, and d(G~)/ds is rate * sum strengths / offset^2
        compliances.append(1 / (rate * rate * float(np.sum(strengths / offset**2))))
        retardations.append(1 / rate)
    fluidity = 0.0 if equilibrium else 1 / float(np.sum(weights / rates))
    shear = Prony(1 / glassy_modulus, fluidity, tuple(compliances), tuple(retardations))
    return in_volume(shear, poisson, bulk_modulus)
