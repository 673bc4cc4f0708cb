"""Whether finished results are still what was written."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from roughvisc.errors import InputError
from roughvisc.study.storage.seal import checksum_error, is_sealed
from roughvisc.study.storage.store import NETCDF, no_results, result_files


@dataclass(frozen=True)
class Verdict:
    """What is known of one file.

    Attributes
    ----------
    path : Path
        The file.
    flaw : str
        What is wrong with it; empty if nothing was found.
    sealed : bool
        Whether it states a checksum. One that does not, of an earlier version or changed by another program, was read
        to its end all the same.
    """

    path: Path
    flaw: str
    sealed: bool


def verify(place: str | Path) -> list[Verdict]:
    """Read results to their last byte and hold them against their checksums.

    Parameters
    ----------
    place : path
        A result, or a folder of them.

    Returns
    -------
    list of Verdict
        One a file, in order of their names.

    Raises
    ------
    InputError
        If there is nothing to read.
    """
    place = Path(place)
    if not place.exists():
        raise InputError(f"{place}: does not exist: expected a result, or a folder of results")
    paths = result_files(place) if place.is_dir() else [place]
    if not paths:
        raise no_results(place)
    return [_verdict(path) for path in paths]


def _verdict(path: Path) -> Verdict:
    try:
        found = checksum_error(path, again=True)
        return Verdict(path, found or _unreadable(path), is_sealed(path))
    except OSError as error:
        return Verdict(path, f"it cannot be read: {error.strerror or error}", False)


def _unreadable(path: Path) -> str:
    """What the library cannot read of a file; empty if nothing."""
    import netCDF4

    try:
        with NETCDF, netCDF4.Dataset(path) as file:
            for group in (file, *file.groups.values()):
                for variable in group.variables.values():
                    for first in range(0, len(variable), 16) if variable.ndim else ():
                        variable[first : first + 16]
    except (OSError, RuntimeError, LookupError, AttributeError, ValueError) as error:
        return f"it cannot be read: {error}"
    return ""
