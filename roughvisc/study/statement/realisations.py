"""Realisations of a surface: other patches of the same roughness, each an ordinary case of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.topography.cards import is_card, read_toml
from roughvisc.units import shown

#: Key of ``[sweep]``, and name under which a case carries its number.
REALISATIONS, REALISATION = "realisations", "realisation"
#: Number of the measured surface itself.
ITSELF = 0
#: What a realisation changes in a study.
SURROGATE, _SEED, _SECOND_SEED = DRAWN = ("surface.realisation", "surface.seed", "surface.second.seed")
#: More realisations than this are taken for a slip.
MOST = 10_000


def realisation(surface: Any, number: int) -> dict[str, Any]:
    """Changes of a study that make one realisation of its surface: dotted key -> value.

    Parameters
    ----------
    surface : mapping
        The table ``[surface]``, as a study writes it.
    number : int
        Number of the realisation, from 1; :data:`ITSELF` is the measured surface itself.

    Returns
    -------
    dict
        Of a measured surface the number of a surrogate (see :func:`roughvisc.surrogates`), nothing for the surface
        itself. Of roughness that is generated the seed: the stated one is number 1, and each next number the next seed.

    Raises
    ------
    InputError
        If the surface is no sample of a roughness.

    Examples
    --------
    >>> realisation({"generate": "self_affine", "seed": 7, "amplitudes": "gaussian"}, 3)
    {'surface.seed': 9}
    >>> realisation({"file": "scan.sur"}, 3), realisation({"file": "scan.sur"}, 0)
    ({'surface.realisation': 3}, {})
    """
    faces = {_SEED: surface, _SECOND_SEED: surface.get("second") or {}}
    if is_measured(surface):
        return {SURROGATE: number} if number != ITSELF else {}
    rough = {key: face for key, face in faces.items() if face.get("generate") == "self_affine"}
    if not rough:
        made = shown(surface.get("generate"))
        raise InputError(f"found together with generate = {made}: expected a scan, or generate = 'self_affine'")
    seeds = {key: face.get("seed") for key, face in rough.items()}
    for key, seed in seeds.items():
        if not isinstance(seed, int) or isinstance(seed, bool):
            raise InputError(f"found with {key} = {shown(seed)}: expected a seed to begin with, a whole number")
    return {key: seed + number - 1 for key, seed in seeds.items()}


def is_measured(surface: Mapping[str, Any]) -> bool:
    """Whether a surface comes from a file, so that its realisations are surrogates of it."""
    return "file" in surface or "file" in (surface.get("second") or {})


def numbers(surface: Any, count: Any, folder: Path | None) -> range:
    """Numbers of so many realisations of a surface; of a measured one the surface itself comes first, in addition.

    Parameters
    ----------
    surface : mapping
        The table ``[surface]``, as a study writes it.
    count : object
        What the study states.
    folder : Path or None
        That the file of the surface is relative to.

    Raises
    ------
    InputError
        If the count is no whole number of at least two, or the surface does not tell how its realisations scatter.
    """
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST:
        raise InputError(f"found {shown(count)}: expected a whole number from 2 to {MOST}")
    if surface.get("realisation") is not None:
        raise InputError("found together with surface.realisation: expected one of them")
    if is_measured(surface):
        made = _recipe_of_card(surface.get("file"), folder)
        if made not in (None, "self_affine"):
            raise InputError(f"found together with a surface card of generate = {shown(made)}: expected a roughness")
        return range(ITSELF, count + 1)
    drawn = realisation(surface, 1)
    for key in drawn:
        face = surface if key == _SEED else surface["second"]
        if face.get("amplitudes") is None:
            where = key.removesuffix(".seed")
            raise InputError(
                f"found without {where}.amplitudes: expected 'gaussian', which scatters as patches of a surface do, or "
                "'fixed', with which all realisations have one rms height"
            )
    seeds = list(drawn.values())
    if len(seeds) == 2 and 0 < abs(seeds[0] - seeds[1]) < count:  # a face would come again as the other one
        raise InputError(
            f"found {count} with the seeds {seeds[0]} and {seeds[1]} of the two faces: expected seeds that are at "
            f"least {count} apart, or equal"
        )
    return range(1, count + 1)


def _recipe_of_card(file: Any, folder: Path | None) -> Any:
    """The recipe that a surface card names; None of any other file."""
    path = Path(folder or ".", Path(str(file)).expanduser())
    return read_toml(path, "a surface card in TOML").get("generate") if is_card(path, None) and path.is_file() else None
