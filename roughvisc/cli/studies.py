"""Commands on a study file: ``run``, ``plan``, ``trade``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.group import Failure, complain, complain_of_all, keep_long_messages, say, say_figures
from roughvisc.cli.interrupts import end_if_interrupted
from roughvisc.cli.reading import naming_keys
from roughvisc.errors import InputError, printable

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console

    from roughvisc.study.budget.target import Choice
    from roughvisc.study.statement.case import Case


_FOR = "How accurate a number is wanted: '1 % friction_coefficient', or the best in a time: '60 s'; may be repeated."


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for the results. [default: results/STUDY beside it]"
)
@click.option("--for", "targets", multiple=True, metavar="TARGET", help=_FOR)
@click.option("--no-plots", is_flag=True, help="Draw no figures.")
@click.option(
    "--workers", type=click.IntRange(0), help="Number of processes; 0: this one only. [default: one per core]"
)
@click.option("--threads", type=click.IntRange(1), help="Threads per case on a large grid. [default: all cores]")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask scheduler: tcp://host:8786.")
@click.option("--scheduler-file", type=click.Path(path_type=Path), help="Scheduler file written by a Dask scheduler.")
@click.option("--retry-failed", is_flag=True, help="Repeat cases that failed before.")
@click.option("--same-bits", is_flag=True, help="Repeat cases computed with other versions of the FFT library.")
@click.option("--profile", is_flag=True, help="Print where the time went; runs in this process.")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def run(
    study: Path, out: Path | None, targets: tuple[str, ...], no_plots: bool, profile: bool, quiet: bool, **where: Any
) -> None:
    """Compute all cases of a study file.

    Writes one NetCDF file per case, named by the key of the case. A single case also gets two figures. The cases of a
    [sweep] run in parallel, on all cores of this machine or on the workers of a Dask scheduler. If a case fails, the
    others continue. Repeat the command to resume an interrupted run: finished cases are not computed again, failed
    ones only with --retry-failed.

    With --for, or [want] in the study, the grid and the tolerance are chosen: coarse to fine, until the whole error of
    the number is as small as wanted. If no grid can give that, the command says why and what would help.

    \b
    Example:
      roughvisc run focus_variation-study.toml --out results
      roughvisc run focus_variation-study.toml --for "5 % mean_gap"
      roughvisc run focus_variation-study.toml --scheduler-file scheduler.json
    """
    from rich.console import Console

    from roughvisc.study.execution.run import result_folder, study_folder
    from roughvisc.study.statement.case import read_cases

    keep_long_messages(study_folder(study, out))
    cases = read_cases(study)
    if targets:
        from roughvisc.study.budget.target import parse_targets, wanting

        want = parse_targets(targets)
        cases = [wanting(case, want) for case in cases]
    chosen = [case for case in cases if case.is_to_be_chosen]
    if chosen and len(cases) > 1:
        where = "--for" if targets else "want"
        raise InputError(f"{study}: {where}: found a target beside a sweep of {len(cases)} cases: expected one case")
    folder = result_folder(cases[0], out, to_write=False)
    console = Console(quiet=quiet)
    elsewhere = where["scheduler"] or where["scheduler_file"]
    if profile and (elsewhere or where["workers"]):
        raise InputError(
            "--profile: measures this process only: expected no --scheduler, --scheduler-file or --workers"
        )
    with _profile(console) if profile else nullcontext():
        choice = _choose(chosen[0], folder, console, **where) if chosen else None
        if len(cases) == 1 and (choice or not elsewhere):
            case = cases[0] if choice is None else choice.case
            complaint = _run_one(
                case, folder, study.stem, console, not no_plots, where["same_bits"], where["threads"], bool(choice)
            )
            if choice is not None:
                _show_budgets(choice.budgets, folder, console, not no_plots)
            if complaint:
                complain(f"{study.stem}: {complaint}")
                raise Failure("1 of 1 cases failed", 1)
        else:
            _run_all(cases, folder, console, **(where | {"workers": 0} if profile else where))


@contextmanager
def _profile(console: Console) -> Iterator[None]:
    """Print where the time of what runs inside went."""
    from roughvisc.study.execution.profile import profiled
    from roughvisc.views.console.tables import profile_table

    with profiled() as profile:
        yield
    console.print(profile_table(profile))


def _choose(
    case: Case,
    folder: Path,
    console: Console,
    *,
    scheduler: str | None,
    scheduler_file: Path | None,
    workers: int | None,
    threads: int | None,
    same_bits: bool,
    **_: Any,
) -> Choice:
    """Choose what the target of a case takes, and say what it is and why."""
    from functools import partial

    from roughvisc.study.budget.target import choose
    from roughvisc.study.execution.cluster import connect
    from roughvisc.study.execution.monitor import watcher

    def tell(line: str) -> None:
        console.print(printable(line), soft_wrap=True, highlight=False, markup=False)

    elsewhere = connect(scheduler, scheduler_file) if scheduler or scheduler_file else nullcontext()
    with elsewhere as client:
        choice = choose(
            case,
            folder,
            watch=partial(watcher, not console.quiet, console, summary=False),
            tell=tell,
            client=client,
            workers=workers,
            threads=threads,
            same_bits=same_bits,
        )
    tell("Chosen")
    for reason in choice.reasons:
        tell(f"  {reason}")
    return choice


def _show_budgets(budgets: Mapping[str, xr.Dataset], folder: Path, console: Console, plots: bool) -> None:
    """Print, keep and draw the whole errors around what was chosen."""
    from roughvisc.cli.budgets import show

    for name, one in budgets.items():
        show(console, one, folder / "budget", name, plots)


def _run_one(
    case: Case,
    folder: Path,
    label: str,
    console: Console,
    plots: bool,
    same_bits: bool,
    threads: int | None,
    chosen: bool = False,
) -> str:
    """Compute, keep, draw and sum up one case; what to complain of, empty if nothing."""
    from roughvisc.progress import Bar
    from roughvisc.study.execution.run import is_result_of, run_case, unconverged
    from roughvisc.study.execution.side_by_side import threads_each
    from roughvisc.study.storage.store import is_writable, require_writable, result_path, whole_result
    from roughvisc.study.storage.upkeep import upgrade_note
    from roughvisc.views.console.result_tables import result_table

    if is_result_of(case, result_path(folder, case.key), same_bits):
        if not chosen:
            console.print("Already finished: nothing to compute")
        if not is_writable(folder):
            complain(f"{folder}: is not writable: the finished result is shown, and nothing is written")
            plots = False
    else:
        require_writable(folder, "since the case is not finished")
        if told := upgrade_note(folder, [case]):
            complain(told)
    end_if_interrupted()
    with Bar(console, label, case.at) as bar:
        path = run_case(case, folder, progress=bar.reached, same_bits=same_bits, threads=threads or threads_each(1))
    missed = _observe([case], folder, console)
    with whole_result(path) as dataset:
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


def _run_all(
    cases: list[Case],
    folder: Path,
    console: Console,
    *,
    workers: int | None,
    scheduler: str | None,
    scheduler_file: Path | None,
    retry_failed: bool,
    same_bits: bool,
    threads: int | None,
) -> None:
    """Compute and sum up a sweep."""
    from contextlib import ExitStack

    from roughvisc.study.execution.cluster import connect
    from roughvisc.study.execution.monitor import watcher
    from roughvisc.study.execution.sweep import run_cases
    from roughvisc.study.execution.task import REFUSED
    from roughvisc.study.storage.failures import LOG
    from roughvisc.study.storage.index import index_of
    from roughvisc.study.storage.table import CASES, REALISATIONS, realisations_table
    from roughvisc.views.console.tables import realisations_tables, sweep_table

    with ExitStack() as stack:
        client = None
        if scheduler or scheduler_file:
            client = stack.enter_context(connect(scheduler, scheduler_file))
        outcomes = run_cases(
            cases,
            folder,
            client=client,
            workers=workers,
            retry_failed=retry_failed,
            same_bits=same_bits,
            threads=threads,
            watch=watcher(not console.quiet, console),
        )
        with client.as_current() if client is not None else nullcontext():
            missed = _observe(cases, folder, console)
    console.print(sweep_table(list(outcomes.values()), len(cases), cases[0].title))
    if (folder / REALISATIONS).exists():
        console.print(realisations_tables(realisations_table(index_of(folder, warn=False))))
    say(console, "Results", folder)
    for what, name in (("Table of cases", CASES), ("Table of realisations", REALISATIONS), ("Log", LOG)):
        if (folder / name).exists():
            say(console, what, folder / name)
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    number = {case.key: i for i, case in reversed(list(enumerate(cases, 1)))}
    told = []
    for outcome in bad:
        again = ", as before (use --retry-failed to try again)" if outcome.reused and outcome.kind == "failed" else ""
        where = f"case {number[outcome.key]} of {len(cases)}{again}" if len(cases) > 1 else "the case"
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


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results; its disk must have room.")
@click.option("--workers", type=click.IntRange(1), help="Number of parallel processes. [default: one per core]")
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Show what a study will model and what it will cost.

    Runs and writes nothing. The contact area is estimated by an elastic solve on at most 256 x 256 cells, the numbers
    of steps and FFTs by coarse runs, and the time by a solve timed on this machine. The exit status is 2 if the study
    does not fit into memory or on the disk.

    \b
    Example:
      roughvisc plan focus_variation-study.toml
    """
    from rich.console import Console

    from roughvisc.study.cost.plan import plan as planned
    from roughvisc.views.console.tables import plan_tables

    costs = planned(study, out, workers=workers)
    if not costs["refusal"].all():
        Console().print(plan_tables(costs))
    if costs.attrs["upgrade"]:
        complain(costs.attrs["upgrade"])
    if why := costs.attrs["refusal"].removeprefix(f"{study}: "):
        raise Failure(f"{study}: cannot run: {why}", 2)


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for the measurements. [default: results/STUDY-trade]"
)
@click.option("--apply", "target", metavar="PART", help="Write the cheapest setting with this accuracy into STUDY: 1%.")
@click.option("--quantity", default="contact_area", help="Quantity that --apply refers to.", show_default=True)
@click.option("--budget", metavar="TIME", default="5 min", help="Total wall time of all runs.", show_default=True)
@click.option(
    "--floor", is_flag=True, help="Compute the error that no setting lessens, as `budget` does without options."
)
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def trade(
    study: Path, out: Path | None, target: str | None, quantity: str, budget: str, floor: bool, quiet: bool
) -> None:
    """Measure what accuracy costs, and recommend a setting.

    Computes the case with several tolerances and grids; with a loading program also with fixed time steps, other
    memory models and the seed paper's algorithm. Each run is timed and compared with a closed-form solution if there
    is one, else with the finest run. Writes a NetCDF file and a figure. --apply changes the keys in STUDY and keeps its
    comments and layout. A budget that `roughvisc budget` has left in the results shows the error that no setting
    lessens.

    \b
    Example:
      roughvisc trade focus_variation-study.toml
      roughvisc trade focus_variation-study.toml --apply 1%
    """
    from dask.system import CPU_COUNT
    from rich.console import Console
    from scipy import fft

    from roughvisc.progress import reporting
    from roughvisc.study.budget.budget import budgets, case_of
    from roughvisc.study.quantities import QUANTITIES
    from roughvisc.study.statement.case import read_study
    from roughvisc.study.storage.store import write_dataset
    from roughvisc.study.trade import files as trade_file
    from roughvisc.study.trade import recommend
    from roughvisc.study.trade.apply import apply
    from roughvisc.study.trade.floor import with_floors
    from roughvisc.study.trade.reference import further_quantities_of, quantities_of
    from roughvisc.study.trade.trade import trade as measured
    from roughvisc.views.console.trade_table import trade_table
    from roughvisc.views.figures.files import write_figure
    from roughvisc.views.plot import trade as figure

    case, console, time = read_study(study), Console(quiet=quiet), trade_file.seconds(budget, "--budget")
    folder, part = trade_file.trade_folder(case, out), None
    usual = quantities_of(case)
    quantity = recommend.known_quantity(quantity, (*usual, *further_quantities_of(case)), "--quantity")
    if target is not None:
        part = trade_file.part_of_one(target, "--apply")
        trade_file.check_writable(study)
    with reporting(True, console=console, at=case.at) as report, fft.set_workers(CPU_COUNT):
        dataset = measured(case, quantities=[quantity], budget=time, progress=report)
    beside = case_of(case, None)[1]
    names = [name for name in dict.fromkeys([quantity, *usual]) if name in QUANTITIES]
    if floor:
        for name, one in budgets(case, names, out=beside, progress=not quiet).items():
            write_dataset(one, beside / f"budget-{name}.nc")
    dataset = with_floors(dataset, trade_file.budgets_in(beside, names, case))
    console.print(trade_table(dataset))
    say(console, "Trade", write_dataset(dataset, folder / "trade.nc"))
    first = list(
        dict.fromkeys([*([] if quantity == "contact_area" else [quantity]), *recommend.main_quantities(dataset)])
    )
    say(console, "Figure", write_figure(figure(dataset, first[:2]), folder / "trade.png"))
    if part is not None:
        index = recommend.cheapest(dataset, quantity, part)
        if index is None:
            shortfall = recommend.shortfall(dataset, quantity, part)
            raise Failure(f"{study}: --apply {target}: {shortfall}; the study is unchanged", 1)
        changes = apply(study, recommend.keys_of(dataset, index))
        said = printable(f"{study}: {changes or 'already has this setting'}")
        console.print(said, soft_wrap=True, highlight=False, markup=False)
