"""What a surface has that its spectrum does not tell: its number against those of its surrogates, its kurtosis."""

from __future__ import annotations

from typing import Any

import numpy as np

from roughvisc.study.budget.sources import SURROGATES, Asked, Values
from roughvisc.study.ensembles import STANDING, STANDING_ATTRIBUTES, ratio, standing
from roughvisc.topography.parameters import parameters


def own_statistics(asked: Asked, values: Values, axis: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Variables and attributes that state how a number compares with surfaces of random phases and the same spectrum.

    The number is that on cells twice as long, on which the surrogates are. Nothing where no surrogates are solved, or
    where the surface alone is tapered.
    """
    if not asked.draws or asked.variants.case.settings.surface.taper:
        return {}, {}
    drawn = np.array([values[name] for name in SURROGATES])
    own = np.asarray(values["coarse"], dtype=float)
    over_mean = ratio(own, drawn.mean(axis=0))
    stands = standing(own, drawn)
    kurtosis = float(parameters(asked.variants.height)["Sku"])
    attributes: dict[str, Any] = {"kurtosis": kurtosis}
    apart = [STANDING[number] not in ("inside", "not_known") for number in stands]
    if any(apart):
        ends = dict.fromkeys(f"{one:.2g}" for one in (over_mean[apart].min(), over_mean[apart].max()))
        attributes["own_note"] = (
            f"not a random-phase surface: the number is {' to '.join(ends)} of the mean of {len(SURROGATES)} Gaussian "
            f"surrogates, outside the 99 % in which they scatter. Heights have a kurtosis of {kurtosis:.2g} "
            "(3: Gaussian). The spectrum alone does not give the number; the value stays that of the surface"
        )
    variables = {
        "surrogate_ratio": (axis, over_mean, {"units": "1", "long_name": "ratio to the mean of its surrogates"}),
        "standing": (axis, stands, STANDING_ATTRIBUTES),
    }
    return variables, attributes
