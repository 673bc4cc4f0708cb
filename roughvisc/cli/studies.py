"""Commands on a study: ``plan``, ``run``, ``trade`` and ``budget``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.group import PATH, QUANTITY, Failure, complain, near, say, say_figures, say_path
from roughvisc.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client
    from rich.console import Console

    from roughvisc.study.case import Case
    from roughvisc.study.execution.outcome import Outcome

_QUIET = click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
#: Most messages on failed cases.
_SHOWN = 5


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results; its disk must have room.")
@click.option("--workers", type=click.IntRange(1), help="Number of parallel processes. [default: one per core]")
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Show what a study will model and what it will cost.

    Writes nothing. Contact area and numbers of steps and FFTs are estimated by a run on at most 128 x 128 cells, and
    the time by a convolution timed on this machine. The exit status is 2 if the study does not fit into memory or on
    the disk.

    \b
    Example:
      roughvisc plan focus_variation-study.toml
    """
    from rich.console import Console

    from roughvisc.cli.plan_tables import plan_tables
    from roughvisc.study.plan import plan as planned

    costs = planned(study, out, workers=workers)
    if not costs["refusal"].all():
        Console().print(plan_tables(costs))
    if why := costs.attrs["refusal"].removeprefix(f"{study}: "):
        raise Failure(f"{study}: cannot run: {why}", 2)


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results. [default: results/STUDY beside it]")
@click.option(
    "--for",
    "targets",
    multiple=True,
    metavar="TARGET",
    help="Wanted error of a number: '1 % friction_coefficient'; may be repeated.",
)
@click.option("--no-plots", is_flag=True, help="Draw no figures.")
@click.option(
    "--workers", type=click.IntRange(0), help="Number of processes; 0: this one only. [default: one per core]"
)
@click.option("--threads", type=click.IntRange(1), help="Threads per case on a large grid. [default: all cores]")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler: tcp://host:8786.")
@click.option("--scheduler-file", type=PATH, help="Scheduler file written by a Dask scheduler.")
@click.option("--retry-failed", is_flag=True, help="Repeat cases that failed before.")
@_QUIET
def run(
    study: Path,
    out: Path | None,
    targets: tuple[str, ...],
    no_plots: bool,
    scheduler: str | None,
    scheduler_file: Path | None,
    retry_failed: bool,
    quiet: bool,
    **computing: Any,
) -> None:
    """Compute all cases of a study file.

    Writes one NetCDF file per case, named by the key of the case. A single case also gets two figures. The cases of a
    [sweep] run in parallel, on all cores of this machine or on the workers of a Dask scheduler. If a case fails, the
    others continue. Repeat the command to resume an interrupted run: finished cases are not computed again, failed
    ones only with --retry-failed.

    With --for, the grid and the tolerance are chosen: coarse to fine, until the whole error of the number is as small
    as wanted. If no grid can give that, the command names the sources of the error.

    \b
    Example:
      roughvisc run focus_variation-study.toml --out results
      roughvisc run focus_variation-study.toml --for "5 % mean_gap"
      roughvisc run focus_variation-study.toml --scheduler-file scheduler.json
    """
    from rich.console import Console

    from roughvisc.study.case import read_cases
    from roughvisc.study.execution.cluster import connect
    from roughvisc.study.execution.run import result_folder

    cases = read_cases(study)
    if targets and len(cases) > 1:
        raise InputError(key="for", found=targets[0], expected=f"one case, and {study} has {len(cases)}")
    folder, console = result_folder(cases[0], out, to_write=False), Console(quiet=quiet)
    remote = bool(scheduler or scheduler_file)
    with connect(scheduler, scheduler_file) if remote else nullcontext() as client:
        if len(cases) > 1 or (remote and not targets):
            _run_all(cases, folder, console, client=client, retry_failed=retry_failed, **computing)
            return
        case, budgets = cases[0], {}
        if targets:
            case, budgets = _choose(case, targets, folder, console, client=client, **computing)
        problem = _run_one(case, folder, study.stem, console, not no_plots, computing["threads"])
        for name, one in budgets.items():
            _show_budget(console, one, folder / "budget", name, not no_plots)
        if problem:
            raise Failure(f"{study.stem}: {problem}", 1)


def _choose(
    case: Case, targets: Sequence[str], folder: Path, console: Console, **computing: Any
) -> tuple[Case, Mapping[str, xr.Dataset]]:
    """Return the case with the chosen grid and tolerance, and its budgets; print what was chosen and why."""
    from functools import partial

    from roughvisc.study.execution.display import Display
    from roughvisc.study.target import choose, parse_targets

    watch, tell = partial(Display, not console.quiet, console, summary=False), partial(say, console)
    chosen, reasons, budgets = choose(case, parse_targets(targets), folder, watch=watch, tell=tell, **computing)
    tell("\n  ".join(["Chosen", *reasons]))
    return chosen, budgets


def _run_one(case: Case, folder: Path, label: str, console: Console, plots: bool, threads: int | None) -> str:
    """Compute, store, draw and summarise one case; return its problem, empty if there is none."""
    from roughvisc.cli.tables import result_table
    from roughvisc.plot import save_figures
    from roughvisc.progress import reporting
    from roughvisc.study.execution.cluster import threads_each
    from roughvisc.study.execution.run import is_result_of, run_case, unconverged
    from roughvisc.study.storage.folder import is_writable, require_writable, result_path
    from roughvisc.study.storage.netcdf import open_result

    if not is_result_of(case, result_path(folder, case.key)):
        require_writable(folder, "since the case is not finished")
        with reporting(True, label, console, case.experiment.progress) as report:
            run_case(case, folder, progress=report, threads=threads or threads_each(1))
    else:
        say(console, "Already finished: nothing to compute")
        if not is_writable(folder):
            complain(f"{folder}: is not writable: the finished result is shown, and nothing is written")
            plots = False
    missed = _observe([case], folder, console)
    with open_result(result_path(folder, case.key)) as dataset:
        console.print(result_table(dataset))
        say_path(console, "Result", result_path(folder, case.key))
        if plots:
            say_figures(console, save_figures(dataset, folder, case.key, every=False))
            say(console, f"For all figures, run: roughvisc plot --all {near(folder)}")
        return unconverged(dataset) or missed


def _observe(cases: list[Case], folder: Path, console: Console) -> str:
    """Add the observables of the study to the results; return what went wrong, empty if nothing."""
    from roughvisc.study.observed import observe

    if not any(case.observed for case in cases):
        return ""
    with console.status("observing") as status:
        try:
            observe(cases, folder, progress=lambda done, of: status.update(f"observing: {done} of {of} cases done"))
        except InputError as error:
            return str(error)
    return ""


def _run_all(cases: list[Case], folder: Path, console: Console, *, client: Client | None, **computing: Any) -> None:
    """Compute and summarise a sweep."""
    from roughvisc.cli.tables import realisations_tables, sweep_table
    from roughvisc.study.execution.display import Display
    from roughvisc.study.execution.sweep import run_cases
    from roughvisc.study.storage.failures import LOG
    from roughvisc.study.storage.index import index_of
    from roughvisc.study.storage.results_table import CASES, REALISATIONS, realisations_table
    from roughvisc.study.storage.sweep_cases import sweep_cases

    outcomes = run_cases(cases, folder, client=client, display=Display(not console.quiet, console), **computing)
    with client.as_current() if client is not None else nullcontext():
        missed = _observe(cases, folder, console)
    console.print(sweep_table(list(outcomes.values()), len(cases), cases[0].title))
    if (folder / REALISATIONS).exists():
        console.print(realisations_tables(realisations_table(index_of(folder), sweep_cases(cases))))
    say_path(console, "Results", folder)
    for what, name in (("Table of cases", CASES), ("Table of realisations", REALISATIONS), ("Log", LOG)):
        if (folder / name).exists():
            say_path(console, what, folder / name)
    if missed:
        complain(missed)
    _fail_if_any(cases, outcomes, folder / LOG)
    if missed:
        raise Failure("some observables could not be computed", 1)


def _fail_if_any(cases: Sequence[Case], outcomes: Mapping[str, Outcome], log: Path) -> None:
    """Write the messages of the cases that are not done, and end with the status of the sweep."""
    from roughvisc.study.execution.outcome import REFUSED
    from roughvisc.study.storage.sweep_cases import number_by_key, sweep_cases

    bad, number = (
        [outcome for outcome in outcomes.values() if outcome.kind != "done"],
        number_by_key(sweep_cases(cases)),
    )
    for outcome in bad[:_SHOWN]:
        again = ", as before (use --retry-failed to try again)" if outcome.reused and outcome.kind == "failed" else ""
        complain(f"case {number[outcome.key]}{again}: {outcome.message}")
    if len(bad) > _SHOWN:
        complain(f"and {len(bad) - _SHOWN} more; all of them are in {log}")
    if all(outcome.error in REFUSED for outcome in outcomes.values()):
        raise Failure("no case could be computed: the input is invalid", 2)
    held = sum(outcome.kind == "held" for outcome in bad)
    problems = [f"{len(bad) - held} of {len(outcomes)} cases failed"] if len(bad) > held else []
    if held:
        problems.append(
            f"{held} of {len(outcomes)} cases are in use by another run: repeat the command when it has ended"
        )
    if problems:
        raise Failure("; ".join(problems), 1)


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the measurements. [default: trade in the results]")
@click.option(
    "--accuracy", type=QUANTITY, metavar="PART", default="1%", help="Wanted relative error.", show_default=True
)
@click.option("--quantity", help="Quantity of this error. [default: contact_area, or friction]")
@click.option(
    "--budget", type=QUANTITY, metavar="TIME", default="5 min", help="Total wall time of all runs.", show_default=True
)
@_QUIET
def trade(study: Path, out: Path | None, accuracy: Any, quantity: str | None, budget: Any, quiet: bool) -> None:
    """Measure the cost and the error of several tolerances and grids.

    Each run is timed and compared with the finest run. Marks the cheapest setting with the error --accuracy. Writes a
    NetCDF file and a figure.

    \b
    Example:
      roughvisc trade focus_variation-study.toml
      roughvisc trade focus_variation-study.toml --accuracy 0.1% --quantity mean_gap
    """
    from rich.console import Console

    from roughvisc.cli.accuracy_tables import trade_table
    from roughvisc.plot import trade as figure
    from roughvisc.plot.save import write_figure
    from roughvisc.study.case import read_study
    from roughvisc.study.execution.run import result_folder
    from roughvisc.study.storage.netcdf import write_dataset
    from roughvisc.study.trade import FOLDER
    from roughvisc.study.trade import trade as measured
    from roughvisc.units import number

    part = number(accuracy, "1", "accuracy", above=0, below=1)
    case, console = read_study(study), Console(quiet=quiet)
    folder = out or result_folder(case) / FOLDER
    dataset = measured(case, quantity=quantity or (), budget=budget, out=folder, progress=not quiet)
    console.print(trade_table(dataset, str(dataset["quantity"].values[0]), part))
    say_path(console, "Trade", write_dataset(dataset, folder / "trade.nc"))
    say_path(console, "Figure", write_figure(figure(dataset), folder / "trade.png"))


@click.command()
@click.argument("study", metavar="STUDY|RESULT", type=PATH)
@click.option("--quantity", multiple=True, metavar="NAME", help="May be repeated. [default: contact_area]")
@click.option(
    "--at", type=QUANTITY, multiple=True, metavar="VALUE", help="Time or speed; may be repeated. [default: all kept]"
)
@click.option("--modulus-error", type=QUANTITY, metavar="PART", help="Relative error of the moduli at 95 %: 10%.")
@click.option(
    "--time-scale-error", type=QUANTITY, metavar="PART", help="Relative error of the times of the material at 95 %."
)
@click.option(
    "--cutoff", type=QUANTITY, metavar="LENGTH", help="Shortest wavelength that the real surface has: '2 um'."
)
@click.option(
    "--population",
    type=click.Choice(["patch", "ensemble"]),
    help="Number of this patch, or of the roughness of which the scan is one sample. [default: patch]",
)
@click.option("--out", type=PATH, help="Folder of the budget. [default: budget in the results]")
@click.option("--workers", type=click.IntRange(1), help="Number of parallel processes. [default: one per core]")
@_QUIET
def budget(
    study: Path,
    quantity: tuple[str, ...],
    at: tuple[Any, ...],
    out: Path | None,
    workers: int | None,
    quiet: bool,
    **known: Any,
) -> None:
    """Estimate the total uncertainty of a number, by source.

    Solves the case again on other grids, without its shortest waves, on other patches of the same roughness and with
    another material, as needed. Prints a table, and writes a NetCDF file and a figure for each quantity. All solves are
    kept and used again.

    \b
    Example:
      roughvisc budget focus_variation-study.toml --modulus-error 10% --cutoff "1 um"
      roughvisc budget focus_variation-study.toml --quantity mean_gap --population ensemble
    """
    from rich.console import Console

    from roughvisc.study.budget import budgets, case_of
    from roughvisc.study.case import read_study
    from roughvisc.study.storage.netcdf import open_result

    console = Console(quiet=quiet)
    case = open_result(study) if study.suffix == ".nc" else read_study(study)
    names, folder = list(quantity) or ["contact_area"], case_of(case, out)[-1]
    found = budgets(case, names, known, at=list(at) or None, out=folder, workers=workers, progress=not quiet)
    for name, one in found.items():
        _show_budget(console, one, folder, name)


def _show_budget(console: Console, found: xr.Dataset, folder: Path, name: str, plots: bool = True) -> None:
    """Print the budget of a number, write it, and draw it."""
    from roughvisc.cli.accuracy_tables import budget_table
    from roughvisc.plot import budget as figure
    from roughvisc.plot.save import write_figure
    from roughvisc.study.storage.netcdf import write_dataset

    console.print(budget_table(found))
    say_path(console, "Budget", write_dataset(found, folder / f"budget-{name}.nc"))
    if plots:
        say_path(console, "Figure", write_figure(figure(found), folder / f"budget-{name}.png"))
