"""Commands on a study: ``plan``, ``run``, ``trade`` and ``budget``."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import roughvisc as rv
from roughvisc.cli.group import PATH, QUIET, WORKERS, Failure, complain, quantity, say, say_figures, say_path, screen
from roughvisc.errors import InputError
from roughvisc.paths import regular

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client
    from rich.console import Console

    from roughvisc.study.case import Case

#: Largest number of messages on failed cases.
_SHOWN = 5


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results; its disk must have enough space.")
@WORKERS
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Show the model and the cost of a study.

    Writes nothing. A run on at most 128 x 128 cells estimates the contact area and the numbers of steps and FFTs. A
    convolution timed on this machine gives the wall time. The exit status is 2 if the study does not fit into memory or
    on the disk.

    \b
    Example:
      roughvisc plan focus_variation-study.toml
    """
    from roughvisc.cli.study_tables import plan_tables
    from roughvisc.progress import sign_of_life

    with sign_of_life("runs the study on few cells"):
        costs = rv.plan(study, out, workers=workers)
    if not costs["refusal"].all():
        screen().print(plan_tables(costs))
    if why := costs.attrs["refusal"].removeprefix(f"{study}: "):
        raise Failure(f"{study}: cannot run: {why}", 2)


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results. [default: results/STUDY next to it]")
@click.option(
    "--for",
    "targets",
    multiple=True,
    metavar="TARGET",
    help="Target error of a result: '1 % friction_coefficient'; may be repeated.",
)
@click.option("--no-plots", is_flag=True, help="Draw no figures.")
@click.option("--workers", type=click.IntRange(0), help="Parallel processes; 0: this one only. [default: one per core]")
@click.option("--threads", type=click.IntRange(1), help="Threads per case on a large grid. [default: all cores]")
@click.option("--device", type=click.Choice(["cpu", "gpu"]), help="Where fields are computed. [default: as stated]")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler: tcp://host:8786.")
@click.option("--scheduler-file", type=PATH, help="Scheduler file written by a Dask scheduler.")
@QUIET
def run(
    study: Path,
    out: Path | None,
    targets: tuple[str, ...],
    no_plots: bool,
    quiet: bool,
    device: str | None,
    **settings: Any,
) -> None:
    """Compute all cases of a study file.

    Writes one NetCDF file per case, named by the key of the case. A single case also gets two figures. The cases of a
    [sweep] run in parallel, on all cores of this machine or on the workers of a Dask scheduler. If a case fails, the
    others continue. Repeat the command to resume an interrupted run: finished cases are not computed again.

    With --for, the command chooses the grid and the tolerance: coarse to fine, until the total error of the result
    reaches the target. If no grid can reach it, the command names the sources of the error.

    \b
    Example:
      roughvisc run focus_variation-study.toml --out results
      roughvisc run focus_variation-study.toml --for "5 % mean_gap"
      roughvisc run focus_variation-study.toml --scheduler-file scheduler.json
    """
    from roughvisc.runs.run import result_folder

    cases = rv.read_cases(study)
    if device is not None:
        cases = [rv.vary(case, {"solve.device": device}).with_fields(varied=case.varied) for case in cases]
    if targets and len(cases) > 1:
        raise InputError(key="for", found=targets[0], expected=f"one case, and {study} has {len(cases)}")
    folder = result_folder(cases[0], out)
    console = screen(quiet)
    remote = [settings.pop(name) for name in ("scheduler", "scheduler_file")]
    with connect(*remote) if any(remote) else nullcontext() as client:
        if targets:
            computing = {"client": client, "workers": settings["workers"] or 0, "threads": settings["threads"]}
            cases = [_chosen(cases[0], targets, folder, console, not no_plots, **computing)]
        elif client is not None or len(cases) > 1:
            _run_all(cases, folder, console, client=client, **settings)
            return
        _run_one(cases[0], folder, console, not no_plots, settings["threads"])


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
    from distributed import Client  # slow to import
    from distributed.utils import silence_logging_cmgr

    if (address is None) == (file is None):
        raise InputError("found both an address and a file of the scheduler: expected only one")
    if file is not None:
        regular(file, "the file written by dask scheduler --scheduler-file")
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
    from roughvisc.judge.budget import QUANTITIES  # slow to import
    from roughvisc.units import is_quantity

    targets: dict[str, str] = {}
    for text in texts:
        amount, _, name = text.strip().rpartition(" ")
        if name not in QUANTITIES or name in targets or not is_quantity(amount, "1"):
            expected = f"a target such as '1 % contact_area', once for each number, of {', '.join(QUANTITIES)}"
            raise InputError(key="for", found=text, expected=expected)
        targets[name] = amount
    return targets


def _chosen(
    case: Case, targets: tuple[str, ...], folder: Path, console: Console, plots: bool, **computing: Any
) -> Case:
    """Return the case with grid and tolerance for some target errors, and show the budget of each target."""
    from roughvisc.judge.wanted_accuracy import choose

    tell = partial(say, console)
    want = parse_targets(targets)
    chosen, reasons, budgets = choose(case, want, folder, tell, progress=not console.quiet, **computing)
    tell("\n  ".join(["Chosen", *reasons]))
    for name, budget in budgets.items():
        _show_budget(console, budget, folder / "budget", name, plots)
    return chosen


def _run_one(case: Case, folder: Path, console: Console, plots: bool, threads: int | None) -> None:
    """Compute, store, draw and summarise one case."""
    from roughvisc.cli.summaries import result_table
    from roughvisc.plot.save import DEFAULT, save_figures
    from roughvisc.progress import reporting
    from roughvisc.runs.cluster import threads_each
    from roughvisc.runs.folder import case_path
    from roughvisc.runs.run import is_result_of
    from roughvisc.runs.sweep import run_one
    from roughvisc.study.case_text import file_stems

    if is_result_of(case, case_path(folder, case.key, "result")):
        say(console, "Already finished: nothing to compute")
    with reporting(case.title, case.experiment.progress, console) as report:
        path = run_one(case, folder, progress=report, threads=threads or threads_each(1))
    with rv.open_result(path) as dataset:
        console.print(result_table(dataset))
        say_path(console, "Result", path)
        if plots:
            stem = file_stems({case.key: json.loads(case.to_json())})[case.key]
            say_figures(console, save_figures(dataset, folder, stem, names=DEFAULT))


def _run_all(cases: list[Case], folder: Path, console: Console, *, client: Any, **computing: Any) -> None:
    """Compute and summarise a sweep; raise its failure, if there is one."""
    from roughvisc.cli.summaries import sweep_table
    from roughvisc.runs.csv_files import CASES
    from roughvisc.runs.display import Display
    from roughvisc.runs.folder import LOG
    from roughvisc.runs.run import REFUSED
    from roughvisc.runs.sweep import run_study
    from roughvisc.runs.sweep_data import numbers_of, sweep_cases

    outcome_of_key = run_study(cases, folder, client=client, display=Display(not console.quiet, console), **computing)
    outcomes = list(outcome_of_key.values())
    numbers = numbers_of(sweep_cases(cases))
    console.print(sweep_table(outcomes, len(cases), cases[0].title))
    for what, path in (("Results", folder), ("Table of cases", folder / CASES), ("Log", folder / LOG)):
        say_path(console, what, path)
    bad = [outcome for outcome in outcomes if outcome.kind != "done"]
    for outcome in bad[:_SHOWN]:
        complain(f"case {numbers[outcome.key]}: {outcome.message}")
    if all(outcome.error in REFUSED for outcome in outcomes):
        raise Failure("no case could be computed: the input is invalid", 2)
    if bad:
        raise Failure(f"{len(bad)} of {len(outcomes)} cases failed or are in use by another run", 1)


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the measurements. [default: folder trade in the results]")
@quantity("--accuracy", "PART", "Target relative error.", default="1%", show_default=True)
@click.option("--quantity", help="Quantity of this error. [default: contact_area, or friction_coefficient]")
@QUIET
def trade(study: Path, out: Path | None, accuracy: str, quantity: str | None, quiet: bool) -> None:
    """Measure the cost and the error of several tolerances and grids.

    Each run is timed and compared with the finest run. Marks the cheapest setting whose error is at most --accuracy.
    Writes a NetCDF file and a figure. Takes about five times as long as a scan's case at the tolerance 1e-3, and twenty
    times as long as a recipe's case, which is also solved on finer cells. An interrupted trade keeps its finished runs.

    \b
    Example:
      roughvisc trade focus_variation-study.toml
      roughvisc trade focus_variation-study.toml --accuracy 0.1% --quantity mean_gap
    """
    from roughvisc.cli.study_tables import trade_table
    from roughvisc.judge.trade import FOLDER
    from roughvisc.runs.run import result_folder
    from roughvisc.units import number

    error = number(accuracy, "1", "accuracy", above=0, below=1)
    case = rv.read_study(study)
    console = screen(quiet)
    folder = out or result_folder(case) / FOLDER
    dataset = rv.trade(case, quantity=quantity or (), out=folder, progress=not quiet)
    console.print(trade_table(dataset, str(dataset["quantity"].values[0]), error))
    _write(console, "Trade", dataset, folder / "trade.nc", rv.plot.trade)


@click.command()
@click.argument("study", type=PATH)
@click.option(
    "--quantity", multiple=True, metavar="NAME", help="Quantity of the budget; may be repeated. [default: contact_area]"
)
@quantity("--modulus-error", "PART", "Relative error of the moduli at 95 %: 10%.")
@quantity("--time-scale-error", "PART", "Relative error of the times of the material at 95 %.")
@quantity("--work-error", "PART", "Relative error of the work of adhesion at 95 %.")
@quantity("--range-error", "PART", "Relative error of the range of the attraction at 95 %.")
@quantity("--cutoff", "LENGTH", "Shortest wavelength that the real surface has: '2 um'.")
@click.option(
    "--population",
    type=click.Choice(["patch", "ensemble"]),
    help="Result for this patch, or for the roughness of which the scan is one sample. [default: patch]",
)
@click.option("--out", type=PATH, help="Folder of the budget. [default: folder budget in the results]")
@WORKERS
@QUIET
def budget(study: Path, out: Path | None, workers: int | None, quiet: bool, **known: Any) -> None:
    """Estimate the total uncertainty of a result, by source.

    Solves the case again on other grids, without its shortest waves, on other patches of the same roughness and with
    another material, as needed. Prints a table, and writes a NetCDF file and a figure for each quantity. Keeps all
    solutions for later use.

    \b
    Example:
      roughvisc budget focus_variation-study.toml --modulus-error 10% --cutoff "1 um"
      roughvisc budget focus_variation-study.toml --quantity mean_gap --population ensemble
    """
    from roughvisc.judge.budget import FOLDER
    from roughvisc.runs.run import result_folder

    names = list(known.pop("quantity")) or ["contact_area"]
    case = rv.read_study(study)
    folder = out or result_folder(case) / FOLDER
    uncertainties = rv.budget(case, names, **known, out=folder, workers=workers, progress=not quiet)
    for name in names:
        _show_budget(screen(quiet), uncertainties.sel(quantity=name), folder, name)


def _show_budget(console: Console, found: xr.Dataset, folder: Path, name: str, plots: bool = True) -> None:
    """Print, write and draw the budget of a result."""
    from roughvisc.cli.study_tables import budget_table

    console.print(budget_table(found))
    _write(console, "Budget", found, folder / f"budget-{name}.nc", rv.plot.budget if plots else None)


def _write(console: Console, what: str, dataset: xr.Dataset, path: Path, draw: Any) -> None:
    """Write a NetCDF file and its figure."""
    from roughvisc.plot.save import write_figure
    from roughvisc.runs.netcdf import write_dataset

    say_path(console, what, write_dataset(dataset, path))
    if draw:
        say_path(console, "Figure", write_figure(draw(dataset), path.with_suffix(".png")))
