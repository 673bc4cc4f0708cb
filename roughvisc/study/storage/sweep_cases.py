"""The cases of the sweep that ran last in a folder, in the order of its study: numbers and labels of its results."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roughvisc.errors import InputError
from roughvisc.study.case import Case
from roughvisc.study.storage.json_files import DAMAGED, read_json, write_json
from roughvisc.study.storage.parameters import case_numbers, parameters_of

#: File with the cases of the last sweep.
SWEEP = ".cases.json.gz"


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Two of them have one key, and one result, if they differ in labels alone: scans with equal bytes.

    Attributes
    ----------
    key : str
        Key of the case, the name of its result.
    case : dict
        The case as JSON, with what the sweep varied.
    """

    key: str
    case: Mapping[str, Any]


def sweep_cases(cases: Sequence[Case]) -> list[SweepCase]:
    """Keys and JSON of some cases, in their order; those with equal keys and equal labels once."""
    distinct: dict[Any, Case] = {}
    for case in cases:
        distinct.setdefault((case.key, json.dumps(dict(case.varied))), case)
    return [SweepCase(case.key, json.loads(case.to_json())) for case in distinct.values()]


def numbers_of(cases: Sequence[SweepCase]) -> list[int]:
    """Number of each case, from 0; the realisations of one case share its number."""
    return case_numbers(parameters_of([one.case for one in cases]), len(cases))


def number_by_key(cases: Sequence[SweepCase]) -> dict[str, int]:
    """Key -> number of the first case that has it."""
    return dict(reversed([(one.key, number) for one, number in zip(cases, numbers_of(cases), strict=True)]))


def write_sweep(folder: Path, cases: Sequence[SweepCase]) -> None:
    """Write the cases of a sweep to its folder; if that is impossible, the folder has no list of cases."""
    write_json(folder / SWEEP, [{"key": one.key, "case": one.case} for one in cases])


def read_sweep(folder: Path) -> list[SweepCase]:
    """Cases of the sweep that ran last in a folder; none if there was no sweep.

    Raises
    ------
    InputError
        If the list of cases is damaged.
    """
    path = folder / SWEEP
    try:
        cases = [SweepCase(str(one["key"]), dict(one["case"])) for one in read_json(path)]
    except FileNotFoundError:
        return []
    except DAMAGED as error:
        raise InputError(
            f"{path}: cannot be read, or is damaged ({error}): expected the cases of the last sweep; run it again, "
            "which computes nothing that is finished, or ask for cases='all'",
            key=SWEEP,
        ) from error
    return cases
