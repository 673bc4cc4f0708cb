"""Results that are damaged: by whichever door, what is served is what was computed, or a word is said."""

import os
import shutil
from functools import partial

import numpy as np
import xarray as xr
from damage import damaged_bytes
from outcome import Outcome, byte_change, compared, opened
from support import BALL

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.groups import whole_of
from roughvisc.study.execution.monitor import Monitor
from roughvisc.study.execution.sweep import run_cases
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.files import _SEAL
from roughvisc.study.storage.index import INDEX, LATEST
from roughvisc.study.storage.store import whole_result
from roughvisc.study.storage.upkeep import verify

_TEXT = BALL.replace("[24, 21]", "[12, 9]") + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n'
#: How a damaged folder is looked at; what has "before" in its name was opened before the damage was done.
_DOORS = (
    *("open_result", "open_results", "open_results of a list", "ragged"),
    *("open_result before", "open_results before", "verify", "run"),
)


#: Those that serve all cases.
_OF_ALL = ("open_results", "open_results of a list", "ragged", "open_results before", "run")


def prepare(folder):
    """A folder of two results, and their values by key."""
    (folder / "study.toml").write_text(_TEXT)
    cases = read_cases(folder / "study.toml")
    run_cases(cases, folder / "whole", watch=Monitor(), workers=0)
    rv.open_results(folder / "whole", cases=cases)  # so that the index is there
    wanted = {}
    for case in cases:
        with whole_result(folder / "whole" / f"{case.key}.nc") as ds:
            wanted[case.key] = ds.load()
    return folder / "whole", cases, wanted


def examine(originals, folder, number, rng):
    whole, cases, wanted = originals
    out = folder / f"results{number}"
    shutil.copytree(whole, out)  # with the times of change, by which the index knows its files
    case = cases[rng.integers(len(cases))]
    name = str(rng.choice([f"{case.key}.nc", INDEX, LATEST], p=[0.8, 0.1, 0.1]))
    door = str(rng.choice(_DOORS))
    path = out / name
    before = path.read_bytes()
    after = _damaged(rng, before)
    kept = len(before) == len(after) and rng.random() < 0.5
    subject = f"{'result' if path.suffix == '.nc' else name}, {door}{', its time of change kept' if kept else ''}"
    outcome = Outcome(number, subject, byte_change(before, after))

    def damage():
        times = path.stat()
        path.write_bytes(after)
        if kept:
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    # what is refused names the file that is damaged, or of a damaged index that of the sweep
    told = out if door == "run" or name == LATEST else path
    served = opened(outcome, partial(_through, door, out, case, cases, damage), told, lambda message: True)
    if served is not None:
        differs, unsaid = [], []
        for key in wanted:
            told = [one for one in outcome.warned if f"{key}.nc" in one]
            if key in served:
                found = differences(wanted[key], served[key], key)
                excused = any("has no checksum" in one for one in told)
            else:  # left out of several
                found = [f"{key}: not served"] if door in _OF_ALL else []
                excused = bool(told)
            differs += found
            unsaid += [f"{found[0]}, without a word"] if found and not excused else []
        if door == "verify" and after != before and path.suffix == ".nc" and not outcome.warned:
            unsaid.append("verify finds no flaw")
        compared(outcome, differs, unsaid)
    shutil.rmtree(out)
    return outcome


def _damaged(rng, content):
    """Bytes damaged anywhere, at their end, where the checksum is, or without it."""
    kind = rng.integers(8)
    if kind == 0:
        return content[: -_SEAL.size]
    if kind == 1:
        return content[: -_SEAL.size] + damaged_bytes(rng, content[-_SEAL.size :])
    if kind == 2:
        at = int(rng.integers(len(content)))
        return content[:at] + bytes([content[at] ^ (1 << int(rng.integers(8)))]) + content[at + 1 :]
    if kind == 3:
        return damaged_bytes(rng, damaged_bytes(rng, content))[: -_SEAL.size or None]
    return damaged_bytes(rng, content)


def _through(door, out, case, cases, damage):
    """Values by key, as one of the doors serves them."""
    path = out / f"{case.key}.nc"
    if door == "open_result before":
        with whole_result(path) as ds:
            damage()
            return {case.key: ds.load()}
    if door == "open_results before":
        results = rv.open_results(out, cases=cases)
        damage()
        return _by_key(results.load())
    damage()
    if door == "open_result":
        with whole_result(path) as ds:
            return {case.key: ds.load()}
    if door == "open_results":
        return _by_key(rv.open_results(out).load())
    if door == "open_results of a list":
        return _by_key(rv.open_results(out, cases=cases).load())
    if door == "ragged":
        tree = rv.open_results(out, cases="all", ragged=True).load()
        return {key: whole_of(node.to_dataset()) for key, node in tree.children.items()}
    if door == "verify":
        for verdict in verify(out):
            if verdict.flaw or not verdict.sealed:
                raise InputError(f"{verdict.path}: {verdict.flaw or 'no checksum'}")
        return {}
    outcomes = run_cases(cases, out, watch=Monitor(), workers=0)
    assert {one.kind for one in outcomes.values()} == {"done"}
    return _by_key(rv.open_results(out, cases=cases).load())


def _by_key(results):
    results = whole_of(results)
    return {str(key): results.isel(case=i) for i, key in enumerate(results["case_key"].values)}


def differences(wanted, found, key):
    """Variables that are served with other values than they were computed with, or under other attributes."""
    told = []
    for name, variable in found.variables.items():
        if name not in wanted.variables or name == "wall_time":
            continue
        before = wanted[name].variable
        if "step" in variable.dims and variable.sizes["step"] > before.sizes["step"]:  # beside a case of more steps
            variable = variable.isel(step=slice(before.sizes["step"]))
        if before.dtype != variable.dtype or not before.equals(xr.Variable(before.dims, variable.values)):
            told.append(f"{key}: {name}: {_first(before.values, variable.values)}")
        told += [
            f"{key}: {name}: {attribute} {variable.attrs[attribute]!r}"
            for attribute in ("units", "standard_name")
            if attribute in before.attrs and variable.attrs.get(attribute, ...) != before.attrs[attribute]
        ]
    lost = [str(name) for name in wanted.data_vars if name not in found.variables]
    if lost and "case_key" not in found.coords:  # a single result has them all
        told.append(f"{key}: no {', '.join(lost)}")
    return told


def _first(before, after):
    if before.shape != after.shape or before.dtype.kind not in "fiu":
        return f"{before.dtype} {before.shape} -> {after.dtype} {after.shape}"
    at = tuple(int(i) for i in np.argwhere(~((before == after) | (np.isnan(before) & np.isnan(after))))[0])
    return f"at {at}: {before[at]:.6g} -> {after[at]:.6g}"
