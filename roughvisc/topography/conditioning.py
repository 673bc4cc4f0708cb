"""Conditioning of scans, one function for each step.

Every function takes a grid and gives a new one; what was done stands in the attribute ``history``. Missing points are
NaN, and stay so until :func:`fill`.
"""

from roughvisc.topography.bandwidth import gaussian_filter, level
from roughvisc.topography.framing import combine, crop, invert, mirror, rotate90
from roughvisc.topography.missing_points import fill, mask_outliers
from roughvisc.topography.resampling import resample, without_short_waves

__all__ = [
    "level",
    "mask_outliers",
    "fill",
    "resample",
    "gaussian_filter",
    "crop",
    "rotate90",
    "invert",
    "combine",
    "mirror",
    "without_short_waves",
]
