"""Commands on a study file: ``run``, ``plan``, ``trade``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.group import Failure, complain, complain_of_all, keep_long_messages, say, say_figures
from roughvisc.errors import InputError, printable

if TYPE_CHECKING:
    from rich.console import Console

    from roughvisc.study.statement.case import Case


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder of the results. [default: results/STUDY beside it]"
)
@click.option("--no-plots", is_flag=True, help="Write no figures.")
@click.option("--workers", type=click.IntRange(0), help="Processes; 0: none but this one. [default: one a core]")
@click.option("--threads", type=click.IntRange(1), help="Threads of a case on a large grid. [default: all cores]")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler to compute on: tcp://host:8786.")
@click.option("--scheduler-file", type=click.Path(path_type=Path), help="File that a Dask scheduler wrote.")
@click.option("--retry-failed", is_flag=True, help="Compute cases again that failed before.")
@click.option("--same-bits", is_flag=True, help="Compute again what other versions of the transforms have computed.")
@click.option("--profile", is_flag=True, help="Say where the time went; computes in this process.")
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
def run(study: Path, out: Path | None, no_plots: bool, profile: bool, quiet: bool, **where: Any) -> None:
    """Compute all cases of a study file.

    Each case ends in one NetCDF file, named by what determines its numbers; a single one also in figures beside it.
    With a [sweep] the cases run side by side, on all cores of this machine or wherever a Dask scheduler has workers.
    One that fails does not stop the others, and is not tried again without --retry-failed. Interrupted, the same
    command goes on: what is finished is not computed again.

    \b
    Example:
      roughvisc run focus_variation-study.toml --out results
      roughvisc run focus_variation-study.toml --scheduler-file scheduler.json
    """
    from rich.console import Console

    from roughvisc.study.execution.run import result_folder, study_folder
    from roughvisc.study.statement.case import read_cases

    keep_long_messages(study_folder(study, out))
    cases = read_cases(study)
    folder = result_folder(cases[0], out, to_write=False)
    console = Console(quiet=quiet)
    elsewhere = where["scheduler"] or where["scheduler_file"]
    if profile and (elsewhere or where["workers"]):
        raise InputError("--profile: times this process only: expected no --scheduler, --scheduler-file or --workers")
    with _profile(console) if profile else nullcontext():
        if len(cases) == 1 and not elsewhere:
            complaint = _run_one(
                cases[0], folder, study.stem, console, not no_plots, where["same_bits"], where["threads"]
            )
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


def _run_one(
    case: Case, folder: Path, label: str, console: Console, plots: bool, same_bits: bool, threads: int | None
) -> str:
    """Compute, keep, draw and sum up one case; what to complain of, empty if nothing."""
    from roughvisc.progress import Bar
    from roughvisc.study.execution.run import is_result_of, run_case, unconverged
    from roughvisc.study.execution.side_by_side import threads_each
    from roughvisc.study.storage.store import is_writable, require_writable, result_path, whole_result
    from roughvisc.study.storage.upkeep import upgrade_note
    from roughvisc.views.console.result_tables import result_table

    if is_result_of(case, result_path(folder, case.key), same_bits):
        console.print("Finished before: nothing has to be computed")
        if not is_writable(folder):
            complain(f"{folder}: is not writable: the finished result is shown, and nothing is written")
            plots = False
    else:
        require_writable(folder, "since the case is not finished")
        if told := upgrade_note(folder, [case]):
            complain(told)
    with Bar(console, label, case.at) as bar:
        path = run_case(case, folder, progress=bar.reached, same_bits=same_bits, threads=threads or threads_each(1))
    missed = _observe([case], folder, console)
    with whole_result(path) as dataset:
        console.print(result_table(dataset))
        say(console, "Result", path)
        if plots:
            from roughvisc.views.plot import save_figures

            say_figures(console, save_figures(dataset, folder, case.key, every=False))
            say(console, "All figures: roughvisc plot --all", path)
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
    from roughvisc.study.storage.table import CASES
    from roughvisc.views.console.tables import sweep_table

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
    say(console, "Results", folder)
    for what, name in (("Table of the cases", CASES), ("Log", LOG)):
        if (folder / name).exists():
            say(console, what, folder / name)
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    number = {case.key: i for i, case in reversed(list(enumerate(cases, 1)))}
    told = []
    for outcome in bad:
        again = ", as before (--retry-failed tries again)" if outcome.reused and outcome.kind == "failed" else ""
        where = f"case {number[outcome.key]} of {len(cases)}{again}" if len(cases) > 1 else "the case"
        told.append(f"{where}: {outcome.message}")
    complain_of_all(told, folder / LOG)
    if missed:
        complain(missed)
    if all(outcome.error in REFUSED for outcome in outcomes.values()):
        raise Failure("no case could be computed: the input is wrong", 2)
    if bad:
        kept = sum(outcome.kind == "held" for outcome in bad)
        failed = f"{len(bad) - kept} of {len(outcomes)} cases failed" if len(bad) > kept else ""
        held = f"{kept} of {len(outcomes)} cases held by another run: give the command again when that has ended"
        raise Failure("; ".join(filter(None, (failed, held if kept else ""))), 1)
    if missed:
        raise Failure("not all could be observed", 1)


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the results, whose disk must hold them.")
@click.option("--workers", type=click.IntRange(1), help="Processes side by side. [default: one a core]")
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Say what a study will model, and what it will cost.

    Nothing is run or written. How much comes into contact is that of an elastic press on 256 cells a side at most.
    Steps and transforms are those of coarse marches, seconds those of a solve that is timed here; a study that cannot
    fit into memory or on the disk is refused with the reason, by exit status 2.

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
        raise Failure(f"{study}: cannot run as it stands: {why}", 2)


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of what is found. [default: results/STUDY-trade]")
@click.option("--apply", "target", metavar="PART", help="Write the setting for this accuracy into STUDY: 1%.")
@click.option("--quantity", default="contact_area", help="Whose accuracy --apply means.", show_default=True)
@click.option("--budget", metavar="TIME", default="5 min", help="Wall time of all runs together.", show_default=True)
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
def trade(study: Path, out: Path | None, target: str | None, quantity: str, budget: str, quiet: bool) -> None:
    """Measure what accuracy costs, and say which setting to take.

    The case is computed under a ladder of settings: tolerances and grids; of a program also fixed steps, memories, the
    seed paper's algorithm. Each is timed and held against a closed form where the case has one, else against its own
    finest run.
    A NetCDF and a figure are written; --apply sets the keys of STUDY, whose comments and layout stay.

    \b
    Example:
      roughvisc trade focus_variation-study.toml
      roughvisc trade focus_variation-study.toml --apply 1%
    """
    from dask.system import CPU_COUNT
    from rich.console import Console
    from scipy import fft

    from roughvisc.progress import reporting
    from roughvisc.study.statement.case import read_study
    from roughvisc.study.trade import files as trade_file
    from roughvisc.study.trade import recommend
    from roughvisc.study.trade.apply import apply
    from roughvisc.study.trade.reference import quantities_of
    from roughvisc.study.trade.trade import trade as measured
    from roughvisc.views.console.trade_table import trade_table
    from roughvisc.views.plot import trade as figure
    from roughvisc.views.sweep_figures.files import write_figure

    case, console, time = read_study(study), Console(quiet=quiet), trade_file.seconds(budget, "--budget")
    folder, part = trade_file.trade_folder(case, out), None
    quantity = recommend.known_quantity(quantity, quantities_of(case), "--quantity")
    if target is not None:
        part = trade_file.part_of_one(target, "--apply")
        trade_file.check_writable(study)
    with reporting(True, console=console, at=case.at) as report, fft.set_workers(CPU_COUNT):
        dataset = measured(case, budget=time, progress=report)
    console.print(trade_table(dataset))
    say(console, "Trade", trade_file.write_trade(dataset, folder / "trade.nc"))
    say(console, "Figure", write_figure(figure(dataset), folder / "trade.png"))
    if part is not None:
        index = recommend.cheapest(dataset, quantity, part)
        if index is None:
            shortfall = recommend.shortfall(dataset, quantity, part)
            raise Failure(f"{study}: --apply {target}: {shortfall}; the study is as it was", 1)
        changes = apply(study, recommend.keys_of(dataset, index))
        said = printable(f"{study}: {changes or 'as it should be already'}")
        console.print(said, soft_wrap=True, highlight=False, markup=False)
