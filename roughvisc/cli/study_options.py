"""Values of options of ``roughvisc run``: a Dask scheduler, and targets."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from roughvisc.errors import InputError
from roughvisc.study.neighbours import QUANTITIES
from roughvisc.units import is_quantity

if TYPE_CHECKING:
    from distributed import Client


@contextmanager
def connect(address: str | None = None, file: Path | None = None) -> Iterator[Client]:
    """Yield a client of a running scheduler.

    Parameters
    ----------
    address : str, optional
        Address of the scheduler, such as ``tcp://host:8786``.
    file : path, optional
        File of ``dask scheduler --scheduler-file``, instead of the address.

    Raises
    ------
    InputError
        If the scheduler does not answer.
    """
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    if (address is None) == (file is None):
        raise InputError("found both an address and a file of the scheduler: expected only one")
    if file is not None and not file.is_file():
        raise InputError(f"{file}: does not exist: expected the file written by dask scheduler --scheduler-file")
    try:
        where = {"address": address} if file is None else {"scheduler_file": str(file)}
        client = Client(**where, set_as_default=False, timeout="20s")
    except (OSError, ValueError) as error:
        raise InputError(f"{file or address}: no Dask scheduler answers there ({error})") from error
    quiet = partial(silence_logging_cmgr, logging.CRITICAL)  # the sweep reports a lost scheduler
    with quiet("distributed"), quiet("distributed.client"), client:
        yield client


def parse_targets(texts: Sequence[str]) -> dict[str, str]:
    """Return number -> wanted error from targets of ``--for`` such as ``1 % friction_coefficient``.

    Raises
    ------
    InputError
        If a text is not a target.

    Examples
    --------
    >>> parse_targets(["1 % mean_gap"])
    {'mean_gap': '1 %'}
    """
    found: dict[str, str] = {}
    for text in texts:
        amount, _, name = text.strip().rpartition(" ")
        if name not in QUANTITIES or name in found or not is_quantity(amount, "1"):
            expected = f"a target such as '1 % contact_area', once for each number, of {', '.join(QUANTITIES)}"
            raise InputError(key="for", found=text, expected=expected)
        found[name] = amount
    return found
