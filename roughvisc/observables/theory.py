"""Theories of rough contact: area by Persson's theory and by asperity theory, and rubber friction by Persson's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy import fft
from scipy.special import erf

from roughvisc.errors import InputError
from roughvisc.experiment.sliding import SlidingGrid
from roughvisc.labels import label
from roughvisc.mechanics.body import HALF_SPACE, Body
from roughvisc.mechanics.materials.material import Material, check_material
from roughvisc.mechanics.steady_sliding import Sliding
from roughvisc.observables.history import expect_result, history
from roughvisc.topography.grid import nominal_area, rms_slope, spacing
from roughvisc.topography.spectrum import wavevectors

Array = NDArray[np.float64]

#: Tolerance of the series that replaces a material without a complex compliance in closed form.
_TOLERANCE = 1e-4
# Waves whose wavenumbers differ by less than this, relative, have one magnification.
_SAME = 1e-9


def persson_fraction(strain: ArrayLike) -> Any:
    r"""Return contact area over nominal area by Persson's theory, :math:`\mathrm{erf}(\sqrt2 \, p / (E^* h'))`.

    Parameters
    ----------
    strain : array_like
        Nominal pressure over contact modulus and rms slope.
    """
    return erf(math.sqrt(2) * np.asarray(strain, dtype=float))


def asperity_fraction(strain: ArrayLike) -> Any:
    r"""Return contact area over nominal area by asperity theory at low loads, :math:`\sqrt{2\pi} \, p / (E^* h')`.

    The fraction is 1.57 times the fraction by Persson's theory.
    """
    return math.sqrt(2 * math.pi) * np.asarray(strain, dtype=float)


def area_by_theory(dataset: xr.Dataset, material: Material) -> xr.Dataset:
    r"""Return the contact area of a rough surface by Persson's and by asperity theory, for a load that never falls.

    Parameters
    ----------
    dataset : xarray.Dataset
        One case's result with ``force`` and ``height``, for a half-space and periodic boundaries.
    material : Prony or Creep
        Material of the half-space.

    Returns
    -------
    xarray.Dataset
        ``persson_contact_area`` and ``asperity_contact_area`` over time, missing once the load has fallen. [m2]

    Raises
    ------
    InputError
        If the boundaries are not periodic, the body is not a half-space, the result contains several cases, or it has
        lost the history of its steps, on which the theory depends.

    See Also
    --------
    roughvisc.observables.persson, roughvisc.plot.area_against_load

    Notes
    -----
    On an elastic half-space Persson's theory [1]_ gives :math:`A = A_0 \, \mathrm{erf}(\sqrt2 \, p / (E^* h'))` with
    the nominal pressure :math:`p`. Asperity theory at low loads [2]_ gives :math:`A = A_0 \sqrt{2\pi} \, p / (E^* h')`.
    Both are for a Gaussian surface with the root-mean-square slope :math:`h'` on the grid. A growing viscoelastic
    contact is equivalent to an elastic one with :math:`p / E^*` replaced by :math:`\int C(t - s) \, dp(s)`, which is
    :math:`C(t) \, p` under a constant pressure. The load is interpolated linearly between accepted steps, so a jump
    after the start becomes a ramp over the step before it.

    References
    ----------
    .. [1] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840-3861.
    .. [2] A. W. Bush, R. D. Gibson, T. R. Thomas, *Wear* 35 (1975) 87-111.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_slope=0.1, seed=1)
    >>> press = rv.Program().pressure("20 kPa", over="1 s")
    >>> ds = rv.simulate(rough, rv.elastic(1e6), press, times=2, progress=False)
    >>> theory = rv.observables.area_by_theory(ds, rv.elastic(1e6))
    >>> bool(theory.asperity_contact_area[-1] > theory.persson_contact_area[-1] > 0)
    True
    """
    dataset = expect_result(dataset, "force", "height")
    if dataset.attrs.get("boundary") not in ("periodic", "mirror"):
        boundary = dataset.attrs.get("boundary")
        raise InputError(key="boundary", found=boundary, expected="'periodic' or 'mirror', as the theories assume")
    if (body := dataset.attrs.get("body", HALF_SPACE.text)) != HALF_SPACE.text:
        raise InputError(key="body", found=body, expected=f"a result on a {HALF_SPACE.text}, as the theories assume")
    material = check_material(material)
    steps = history(dataset)
    kept = dataset["time"].values
    area = nominal_area(dataset)
    times = steps["time"].values
    force = steps["force"].values
    # int C(t - s) dp(s) for a pressure that is linear between the steps
    since = np.maximum(kept[:, None] - times[None], 0.0)
    integral = material.contact_integral(since)
    strain = material.contact_compliance(since[:, 0]) * (force[0] / area)
    strain = strain + (integral[:, :-1] - integral[:, 1:]) @ (np.diff(force / area) / np.diff(times))
    falling = np.diff(force) < -1e-9 * float(force.max())
    last = times[int(np.argmax(falling))] if falling.any() else math.inf
    slope = rms_slope(dataset["height"], periodic=dataset.attrs["boundary"] == "periodic")
    strain = np.where(kept <= last, strain / slope, np.nan)
    areas = {
        "persson_contact_area": ("time", area * persson_fraction(strain)),
        "asperity_contact_area": ("time", area * asperity_fraction(strain)),
    }
    return label(xr.Dataset(areas, coords={"time": dataset["time"]}))


def persson(dataset: xr.Dataset, material: Material | Body) -> xr.Dataset:
    r"""Return friction coefficient and contact fraction by Persson's theory, for the surface of a friction curve.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of :func:`roughvisc.friction`, with ``height``.
    material : Prony, Creep or Body
        The body.

    Returns
    -------
    xarray.Dataset
        ``persson_friction_coefficient`` and ``persson_contact_fraction`` over speed. [-]

    Raises
    ------
    InputError
        If the Dataset is not a friction curve.

    See Also
    --------
    roughvisc.friction, roughvisc.friction_theory, roughvisc.observables.area_by_theory

    References
    ----------
    .. [1] B. N. J. Persson, *J. Chem. Phys.* 115 (2001) 3840.

    Examples
    --------
    >>> import roughvisc as rv
    >>> rough = rv.self_affine("1 mm", 32, hurst=0.8, rms_slope=0.1, seed=1)
    >>> rubber = rv.zener(3e6, 1e6, 1e5)
    >>> ds = rv.friction(rough, rubber, pressure="0.1 MPa", speeds=["10 mm/s"], tolerance=1e-2, progress=False)
    >>> bool(rv.observables.persson(ds, rubber).persson_friction_coefficient > 0)
    True
    """
    dataset = expect_result(dataset)
    if not {"height", "nominal_pressure", "speed"} <= set(dataset.variables) or "direction" not in dataset.attrs:
        raise InputError(key="dataset", found=list(dataset.variables), expected="a result of rv.friction with height")
    body = material if isinstance(material, Body) else Body(material)
    height = dataset["height"]
    grid = SlidingGrid.of(-height.values, spacing(height, "height"), dataset.attrs["direction"])
    waves = []
    for speed, pressure in zip(dataset["speed"].values, dataset["nominal_pressure"].values, strict=True):
        sliding = Sliding(grid.law(body, float(speed), _TOLERANCE), grid.gap.shape, grid.spacing, float(speed))
        waves.append(friction_of_waves(sliding, grid.gap, float(pressure)))
    names = "persson_friction_coefficient", "persson_contact_fraction"
    columns = {name: ("speed", column) for name, column in zip(names, np.transpose(waves), strict=True)}
    return label(xr.Dataset(columns, coords={"speed": dataset["speed"]}))


def friction_of_waves(sliding: Sliding, height: Array, pressure: float) -> tuple[float, float]:
    r"""Return friction coefficient and contact fraction by Persson's theory, as a sum over the waves of a surface.

    Parameters
    ----------
    sliding : Sliding
        The body and the motion.
    height : ndarray, shape (nx, ny)
        Profile, or the undeformed gap, which has the same waves. [m]
    pressure : float
        Nominal pressure :math:`\sigma_0`. [Pa]

    Returns
    -------
    friction_coefficient : float
        [-]
    contact_fraction : float
        Contact area over nominal area, with all waves of the surface. [-]

    Notes
    -----
    A wave :math:`h_\mathbf{q}` in full contact has the stress :math:`\sigma_\mathbf{q} = E^*_\mathbf{q}
    h_\mathbf{q}`, on a half-space with :math:`E^*_\mathbf{q} = \tfrac12 |\mathbf q| E^*(q_x V)`. The theory assumes
    this stress for the waves up to a magnification. It weights each wave by the fraction of the surface that is still
    in contact at its magnification:

    .. math:: P(q) = \operatorname{erf} \frac{\sigma_0}{\sqrt{2 v(q)}}, \quad
              v(q) = \sum_{|\mathbf q'| < q} |\sigma_{\mathbf q'}|^2, \quad
              \mu = \frac{1}{\sigma_0} \sum_\mathbf{q} P(q)\, q_x |h_\mathbf{q}|^2 \operatorname{Im} E^*_\mathbf{q} .

    With the spectrum of an isotropic surface and :math:`G = v / 2 \sigma_0^2` these are the integrals of [1]_ over
    :math:`q^3 C(q)`. Waves of one length have one :math:`P`, which includes half of their variance. Later papers
    correct the contact's share in the dissipation; this correction is not included.

    References
    ----------
    .. [1] B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.
    """
    waves = fft.rfft2(height, norm="forward")
    length = np.broadcast_to(np.hypot(sliding.qx, sliding.qy), waves.shape)
    power = wavevectors(height.shape, (1.0, 1.0))[2] * np.abs(waves) ** 2
    stiffness = np.divide(1.0, sliding.response, where=length > 0, out=np.zeros(waves.shape, complex))
    order = np.argsort(length, axis=None)
    stress, drag = (
        (power * factor).ravel()[order] for factor in (np.abs(stiffness) ** 2, -sliding.qx * stiffness.imag)
    )
    sorted_length = length.ravel()[order]
    first = np.flatnonzero(np.diff(sorted_length, prepend=-1.0) > _SAME * sorted_length)
    own = np.add.reduceat(stress, first)
    drag = np.add.reduceat(drag, first)
    variance = np.cumsum(own) - own / 2
    with np.errstate(divide="ignore"):
        contact = erf(pressure / np.sqrt(2 * variance))
        rest = erf(pressure / np.sqrt(2 * own.sum()))
    return float(contact @ drag) / pressure, float(rest)
