"""The command that computes a study: ``run``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.costs import show
from roughvisc.cli.group import PATH, Failure, complain, complain_of_all, keep_long_messages, say, say_figures
from roughvisc.cli.interrupts import end_if_interrupted
from roughvisc.cli.reading import naming_keys
from roughvisc.errors import InputError, printable

if TYPE_CHECKING:
    import xarray as xr
    from distributed import Client
    from rich.console import Console

    from roughvisc.study.statement.case import Case


_FOR = "Wanted error of a number: '1 % friction_coefficient'; may be repeated."


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results. [default: results/STUDY beside it]")
@click.option("--for", "targets", multiple=True, metavar="TARGET", help=_FOR)
@click.option("--no-plots", is_flag=True, help="Draw no figures.")
@click.option(
    "--workers", type=click.IntRange(0), help="Number of processes; 0: this one only. [default: one per core]"
)
@click.option("--threads", type=click.IntRange(1), help="Threads per case on a large grid. [default: all cores]")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler: tcp://host:8786.")
@click.option("--scheduler-file", type=PATH, help="Scheduler file written by a Dask scheduler.")
@click.option("--retry-failed", is_flag=True, help="Repeat cases that failed before.")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def run(
    study: Path,
    out: Path | None,
    targets: tuple[str, ...],
    no_plots: bool,
    scheduler: str | None,
    scheduler_file: Path | None,
    quiet: bool,
    retry_failed: bool,
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

    from roughvisc.study.execution.cluster import connect
    from roughvisc.study.execution.run import result_folder, study_folder
    from roughvisc.study.statement.case import read_cases

    keep_long_messages(study_folder(study, out))
    cases = read_cases(study)
    if targets and len(cases) > 1:
        raise InputError(key="--for", found=targets[0], expected=f"one case, and {study} has {len(cases)}")
    folder = result_folder(cases[0], out, to_write=False)
    console = Console(quiet=quiet)
    elsewhere = bool(scheduler or scheduler_file)
    with connect(scheduler, scheduler_file) if elsewhere else nullcontext() as client:
        if len(cases) > 1 or (elsewhere and not targets):
            _run_all(cases, folder, console, client=client, retry_failed=retry_failed, **computing)
            return
        case, budgets = cases[0], {}
        if targets:
            case, budgets = _choose(case, targets, folder, console, client=client, **computing)
        complaint = _run_one(case, folder, study.stem, console, not no_plots, computing["threads"], bool(targets))
        for name, one in budgets.items():
            show(console, one, folder / "budget", name, not no_plots)
        if complaint:
            complain(f"{study.stem}: {complaint}")
            raise Failure("1 of 1 cases failed", 1)


def _choose(
    case: Case, targets: Sequence[str], folder: Path, console: Console, **computing: Any
) -> tuple[Case, Mapping[str, xr.Dataset]]:
    """Return the case with the chosen grid and tolerance, and its budgets; print what was chosen and why."""
    from functools import partial

    from roughvisc.study.budget.target import choose, parse_targets
    from roughvisc.study.execution.monitor import watcher

    def tell(line: str) -> None:
        console.print(printable(line), soft_wrap=True, highlight=False, markup=False)

    watch = partial(watcher, not console.quiet, console, summary=False)
    choice = choose(case, parse_targets(targets), folder, watch=watch, tell=tell, **computing)
    tell("Chosen")
    for reason in choice.reasons:
        tell(f"  {reason}")
    return choice.case, choice.budgets


def _run_one(
    case: Case,
    folder: Path,
    label: str,
    console: Console,
    plots: bool,
    threads: int | None,
    chosen: bool = False,
) -> str:
    """Compute, keep, draw and sum up one case; what to complain of, empty if nothing."""
    from roughvisc.progress import reporting
    from roughvisc.study.execution.cluster import threads_each
    from roughvisc.study.execution.run import is_result_of, run_case, unconverged
    from roughvisc.study.storage.files import is_writable, require_writable
    from roughvisc.study.storage.store import open_result, result_path
    from roughvisc.views.console.result_tables import result_table

    if is_result_of(case, result_path(folder, case.key)):
        if not chosen:
            console.print("Already finished: nothing to compute")
        if not is_writable(folder):
            complain(f"{folder}: is not writable: the finished result is shown, and nothing is written")
            plots = False
    else:
        require_writable(folder, "since the case is not finished")
    end_if_interrupted()
    with reporting(True, label, console, case.at) as report:
        path = run_case(case, folder, progress=report, threads=threads or threads_each(1))
    missed = _observe([case], folder, console)
    with open_result(path) as dataset:
        console.print(result_table(dataset))
        say(console, "Result", path)
        if plots:
            from roughvisc.views.plot import save_figures

            say_figures(console, save_figures(dataset, folder, case.key, every=False))
            say(console, "For all figures, run", path, before="roughvisc plot --all ")
        return unconverged(dataset) or missed


def _observe(cases: list[Case], folder: Path, console: Console) -> str:
    """Add to the results what the study asks to be observed; what to complain of, empty if nothing."""
    if all(case.settings.observe is None for case in cases):
        return ""
    from roughvisc.study.observed import observe

    with console.status("observing") as status:
        try:
            observe(cases, folder, progress=lambda done, of: status.update(f"observing: {done} of {of} cases done"))
        except InputError as error:
            return str(error)
    return ""


def _run_all(cases: list[Case], folder: Path, console: Console, *, client: Client | None, **computing: Any) -> None:
    """Compute and sum up a sweep."""
    from roughvisc.study.execution.monitor import watcher
    from roughvisc.study.execution.sweep import run_cases
    from roughvisc.study.execution.task import REFUSED
    from roughvisc.study.storage.failures import LOG
    from roughvisc.study.storage.index import index_of
    from roughvisc.study.storage.sweep_cases import number_by_key, sweep_cases
    from roughvisc.study.storage.table import CASES, REALISATIONS, realisations_table
    from roughvisc.views.console.tables import realisations_tables, sweep_table

    outcomes = run_cases(cases, folder, client=client, watch=watcher(not console.quiet, console), **computing)
    with client.as_current() if client is not None else nullcontext():
        missed = _observe(cases, folder, console)
    listed = sweep_cases(cases)
    console.print(sweep_table(list(outcomes.values()), len(cases), cases[0].title))
    if (folder / REALISATIONS).exists():
        console.print(realisations_tables(realisations_table(index_of(folder, warn=False), listed)))
    say(console, "Results", folder)
    for what, name in (("Table of cases", CASES), ("Table of realisations", REALISATIONS), ("Log", LOG)):
        if (folder / name).exists():
            say(console, what, folder / name)
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    number = number_by_key(listed)
    told = []
    for outcome in bad:
        again = ", as before (use --retry-failed to try again)" if outcome.reused and outcome.kind == "failed" else ""
        where = f"case {number[outcome.key]}{again}" if len(cases) > 1 else "the case"
        told.append(f"{where}: {naming_keys(outcome.message)}")
    complain_of_all(told, folder / LOG)
    if missed:
        complain(missed)
    if all(outcome.error in REFUSED for outcome in outcomes.values()):
        raise Failure("no case could be computed: the input is invalid", 2)
    if bad:
        kept = sum(outcome.kind == "held" for outcome in bad)
        failed = f"{len(bad) - kept} of {len(outcomes)} cases failed" if len(bad) > kept else ""
        held = f"{kept} of {len(outcomes)} cases are in use by another run: repeat the command when it has ended"
        raise Failure("; ".join(filter(None, (failed, held if kept else ""))), 1)
    if missed:
        raise Failure("some observables could not be computed", 1)
