"""The command line: ``roughvisc run | plan | scan | plot | report | validate``.

Exit status: 0 all done, 1 a case failed or did not converge, 2 the input is wrong, 130 interrupted. Heavy imports
are made inside the commands, so that ``--help`` is quick.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.errors import InputError, RoughviscError

if TYPE_CHECKING:
    from rich.console import Console

    from roughvisc.study.statement.case import Case


class _Failure(click.ClickException):
    """One message on the standard error stream, and an exit status."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.exit_code = status

    def show(self, file: Any = None) -> None:
        click.echo(f"roughvisc: {self.message}", err=True)


class _Commands(click.Group):
    """Errors made on purpose end in one message and an exit status, never in a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise _Failure(str(error), 2) from error
        except RoughviscError as error:
            raise _Failure(str(error), 1) from error
        except OSError as error:  # a full disk, a file taken away
            if error.errno == errno.EPIPE:  # whoever read the output has seen enough: click ends quietly
                raise
            raise _Failure(f"{error.filename or 'input or output'}: {error.strerror or error}", 1) from error
        except KeyboardInterrupt as error:
            raise _Failure("interrupted; what was finished is kept", 130) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="roughvisc", message="roughvisc %(version)s")
def main() -> None:
    """Contact of measured rough surfaces with viscoelastic materials.

    A scan and a study file in; labelled (time, x, y) NetCDF results and figures out.

    \b
    Example:
      roughvisc scan ground.sur
      roughvisc run study.toml
      roughvisc plot results/study
    """


@main.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder of the results. [default: results/STUDY beside it]"
)
@click.option("--no-plots", is_flag=True, help="Write no figures.")
@click.option("--workers", type=click.IntRange(0), help="Processes; 0: none but this one. [default: one a core]")
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler to compute on: tcp://host:8786.")
@click.option("--scheduler-file", type=click.Path(path_type=Path), help="File that a Dask scheduler wrote.")
@click.option("--retry-failed", is_flag=True, help="Compute cases again that failed before.")
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
      roughvisc run workflows/quickstart.toml --out /tmp/quickstart
      roughvisc run workflows/load_sweep.toml --scheduler-file scheduler.json
    """
    from rich.console import Console

    from roughvisc.study.execution.run import result_folder
    from roughvisc.study.statement.case import read_cases

    cases = read_cases(study)
    folder = result_folder(cases[0], out)
    console = Console(quiet=quiet)
    elsewhere = where["scheduler"] or where["scheduler_file"]
    if profile and (elsewhere or where["workers"]):
        raise InputError("--profile: times this process only: expected no --scheduler, --scheduler-file or --workers")
    with _profile(console) if profile else nullcontext():
        if len(cases) == 1 and not elsewhere:
            complaint = _run_one(cases[0], folder, study.stem, console, not no_plots)
            if complaint:
                click.echo(f"roughvisc: {study.stem}: {complaint}", err=True)
                raise _Failure("1 of 1 cases failed", 1)
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


def _run_one(case: Case, folder: Path, label: str, console: Console, plots: bool) -> str:
    """Compute, keep, draw and sum up one case; what to complain of, empty if nothing."""
    from dask.system import CPU_COUNT
    from scipy import fft

    from roughvisc.study.execution.run import run_case, unconverged
    from roughvisc.study.storage.store import open_result
    from roughvisc.views.console.tables import progress, result_table

    with progress(console, label) as report, fft.set_workers(CPU_COUNT):
        path = run_case(case, folder, progress=report)
    with open_result(path) as dataset:
        console.print(result_table(dataset))
        _say(console, "Result", path)
        if plots:
            from roughvisc.views.plot import save_figures

            for figure in save_figures(dataset, folder, case.key):
                _say(console, "Figure", figure)
        return unconverged(dataset)


def _run_all(
    cases: list[Case],
    folder: Path,
    console: Console,
    *,
    workers: int | None,
    scheduler: str | None,
    scheduler_file: Path | None,
    retry_failed: bool,
) -> None:
    """Compute and sum up a sweep."""
    from contextlib import ExitStack

    from roughvisc.study.execution.cluster import connect
    from roughvisc.study.execution.sweep import LOG, run_cases
    from roughvisc.study.execution.watch import watcher
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
            watch=watcher(not console.quiet, console),
        )
    console.print(sweep_table(list(outcomes.values()), len(cases), cases[0].title))
    _say(console, "Results", folder)
    _say(console, "Log", folder / LOG)
    bad = [outcome for outcome in outcomes.values() if outcome.kind != "done"]
    number = {case.key: i for i, case in reversed(list(enumerate(cases, 1)))}
    for outcome in bad:
        again = ", as before (--retry-failed tries again)" if outcome.reused and outcome.kind == "failed" else ""
        where = f"case {number[outcome.key]} of {len(cases)}{again}" if len(cases) > 1 else "the case"
        click.echo(f"roughvisc: {where}: {outcome.message}", err=True)
    if all(outcome.error in ("InputError", "EdgeContactError") for outcome in outcomes.values()):
        raise _Failure("no case could be computed: the input is wrong", 2)
    if bad:
        raise _Failure(f"{len(bad)} of {len(outcomes)} cases failed", 1)


@main.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the results, whose disk must hold them.")
@click.option("--workers", type=click.IntRange(1), help="Processes side by side. [default: one a core]")
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Say what a study will model and what it will cost, before anything is spent.

    Nothing is written. Steps and transforms are those of coarse marches, seconds those of a solve that is timed here;
    a study that cannot fit into memory or on the disk is refused with the reason, by exit status 2.

    \b
    Example:
      roughvisc plan workflows/load_sweep.toml
    """
    from rich.console import Console

    from roughvisc.study.cost.plan import plan as planned
    from roughvisc.views.console.tables import plan_tables

    costs = planned(study, out, workers=workers)
    Console().print(plan_tables(costs))
    if costs.attrs["refusal"]:
        raise _Failure(f"{study}: cannot run as it stands: {costs.attrs['refusal']}", 2)


@main.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of what is found. [default: results/STUDY-trade]")
@click.option("--apply", "target", metavar="PART", help="Write the setting for this accuracy into STUDY: 1%.")
@click.option("--quantity", default="contact_area_corrected", help="Whose accuracy --apply means.", show_default=True)
@click.option("--budget", metavar="TIME", default="5 min", help="Wall time of all runs together.", show_default=True)
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
def trade(study: Path, out: Path | None, target: str | None, quantity: str, budget: str, quiet: bool) -> None:
    """Measure what accuracy costs in a study, and say which setting to take.

    The case is computed under a ladder of settings: tolerances, grids, fixed steps, memories, the seed paper's
    algorithm. Each is timed and held against a closed form where the case has one, else against its own finest run.
    A NetCDF and a figure are written; --apply sets the keys of STUDY, whose comments and layout stay.

    \b
    Example:
      roughvisc trade workflows/ball_on_rubber.toml
      roughvisc trade study.toml --apply 1%
    """
    from dask.system import CPU_COUNT
    from rich.console import Console
    from scipy import fft

    from roughvisc.study.statement.case import read_study
    from roughvisc.study.trade import files as trade_file
    from roughvisc.study.trade import recommend
    from roughvisc.study.trade.apply import apply
    from roughvisc.study.trade.trade import trade as measured
    from roughvisc.study.trade.watch import reporting
    from roughvisc.views.console.trade_table import trade_table
    from roughvisc.views.plot import trade as figure

    case, console, time = read_study(study), Console(quiet=quiet), trade_file.seconds(budget, "--budget")
    folder, part = trade_file.trade_folder(case, out), None
    recommend.known_quantity(quantity, "--quantity")
    if target is not None:
        part = trade_file.part_of_one(target, "--apply")
        trade_file.check_writable(study)
    with reporting(True, console) as report, fft.set_workers(CPU_COUNT):
        dataset = measured(case, budget=time, progress=report)
    console.print(trade_table(dataset))
    _say(console, "Trade", trade_file.write_trade(dataset, folder / "trade.nc"))
    _draw(figure(dataset), folder / "trade.png")
    _say(console, "Figure", folder / "trade.png")
    if part is not None:
        index = recommend.cheapest(dataset, quantity, part)
        if index is None:
            shortfall = recommend.shortfall(dataset, quantity, part)
            raise _Failure(f"{study}: --apply {target}: {shortfall}; the study is as it was", 1)
        changes = apply(study, recommend.keys_of(dataset, index))
        console.print(f"{study}: {changes or 'as it should be already'}", soft_wrap=True, highlight=False)


def _say(console: Console, what: str, path: Path) -> None:
    """A path on one line of its own, whole, so that it can be copied or cut out by a program."""
    shown = os.path.relpath(path)
    console.print(f"{what}: {path if shown.startswith('..') else shown}", soft_wrap=True, highlight=False)


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(path_type=Path), help="Quick-look picture. [default: FILE's name.png, here]")
@click.option("--to", type=click.Path(path_type=Path), help="Convert: write the heights to a .nc, .x3p or .sdf file.")
@click.option(
    "--card",
    type=click.Path(path_type=Path),
    is_flag=False,
    flag_value=Path(),
    metavar="[OUT.toml]",
    help="Write a surface card for FILE. [name: FILE's name.toml, beside it]",
)
@click.option("--unit", help="Unit of length, where the file states none: um.")
@click.option("--channel", help="Name or number of the channel. [default: the height]")
@click.option("--spacing", help="Distance of the points, where the file states none: 1um, or 1um,2um.")
@click.option("--format", help="Format, where the suffix does not tell.")
def scan(
    file: Path,
    plot: Path | None,
    to: Path | None,
    card: Path | None,
    unit: str | None,
    channel: str | None,
    spacing: str | None,
    format: str | None,
) -> None:
    """Say what is in a scan, and draw it; convert it, or write a surface card for it.

    Size, channels, missing points, areal parameters; FILE is an instrument file or a surface card.

    \b
    Example:
      roughvisc scan ground.sur --plot ground.png
      roughvisc scan ground.sur --to ground.x3p --card
    """
    from rich.console import Console

    from roughvisc.topography.bandwidth import level
    from roughvisc.topography.parameters import parameters
    from roughvisc.topography.readers import list_channels
    from roughvisc.topography.scans import open_scan
    from roughvisc.topography.writers import card_text, known_suffix
    from roughvisc.views.console.tables import scan_table
    from roughvisc.views.plot import surface

    options = {
        "format": format,
        "unit": unit,
        "channel": int(channel) if channel is not None and channel.isdecimal() else channel,
        "spacing": _sides(spacing),
    }
    height = open_scan(file, **options)
    channels = () if "card" in height.attrs else list_channels(file, format=format)
    picture, card = plot or Path(f"{file.stem}.png"), file.with_suffix(".toml") if card == Path() else card
    text = card_text(file, card.parent, options) if card else ""
    if to:
        known_suffix(to)
    for out in filter(None, (to, card, picture)):
        if out.exists() and (out == card or out.samefile(file)):
            raise InputError(f"{out}: exists already, and is not written over: expected another name")
    console = Console()
    console.print(scan_table(height, parameters(level(height)), file.name, channels))
    _draw(surface(height), picture)
    _say(console, "Picture", picture)
    if to:
        _convert(height, to)
        _say(console, "Converted", to)
    if card:
        _write_card(text, card)
        _say(console, "Card", card)


def _convert(height: Any, path: Path) -> None:
    from roughvisc.study.storage.store import whole_file
    from roughvisc.topography.writers import save_scan

    with whole_file(path) as temporary:
        save_scan(height, temporary)


def _write_card(text: str, path: Path) -> None:
    from roughvisc.study.storage.store import whole_file

    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _sides(text: str | None) -> Any:
    from roughvisc.units import quantity

    if text is None:
        return None
    sides = [float(part) if part.strip().replace(".", "").isdecimal() else part for part in text.split(",")]
    if len(sides) > 2:
        raise InputError(f"--spacing: found {text!r}: expected one length, or two with a comma between them")
    metres = [quantity(side, "m", "--spacing") for side in sides]
    return metres[0] if len(metres) == 1 else tuple(metres)


def _draw(figure: Any, path: Path) -> None:
    from roughvisc.study.storage.store import whole_file

    kind = path.suffix.lstrip(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: is no kind of picture: expected one of .png, .pdf, .svg")
    with whole_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=200)


@main.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the figures. [default: beside the result]")
def plot(result: Path, out: Path | None) -> None:
    """Draw the figures of a result, of all results in a folder, or of a trade.

    Of several cases also the figures of the sweep: quantities against what was varied, histories of all cases.

    \b
    Example:
      roughvisc plot results/quickstart --out figures
      roughvisc plot results/study-trade/trade.nc
    """
    from rich.console import Console

    from roughvisc.study.storage.store import no_results, open_result, result_files
    from roughvisc.study.trade.files import is_trade, open_trade
    from roughvisc.views.plot import save_figures, save_sweep_figures, trade
    from roughvisc.views.sweep_figures.files import results_of

    paths = result_files(result) if result.is_dir() else [result]
    if not paths:
        raise no_results(result)
    console = Console()
    for path in paths:
        if path.is_file() and is_trade(path):
            _draw(trade(open_trade(path)), (out or path.parent) / f"{path.stem}.png")
            _say(console, "Figure", (out or path.parent) / f"{path.stem}.png")
            continue
        with open_result(path) as dataset:
            for figure in save_figures(dataset, out or path.parent, path.stem):
                _say(console, "Figure", figure)
    together = results_of(result) if len(paths) > 1 else None
    for figure in save_sweep_figures(together, out or result) if together is not None else ():
        _say(console, "Figure", figure)


@main.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Page. [default: report.html in the folder]")
def report(results: Path, output: Path | None) -> None:
    """Write one self-contained page (HTML) about a result, or about all results in a folder.

    What was run, the surface and its conditioning, figures, cases with accuracy and cost, and how to run them again;
    case and time can be picked. Nothing is fetched from anywhere when the page is looked at.

    \b
    Example:
      roughvisc report results/quickstart -o quickstart.html
    """
    from rich.console import Console

    from roughvisc.views.report.page import report as write

    _say(Console(), "Report", write(results, output))


@main.command()
@click.option("--cells", type=click.IntRange(33), default=129, show_default=True, help="Cells along the grids' sides.")
def validate(cells: int) -> None:
    """Hold the solver on this machine against analytic solutions.

    Takes less than a minute on most machines. The errors to expect follow from the grid and the tolerance; the exit
    status is 1 if any is larger.

    \b
    Example:
      roughvisc validate --cells 65
    """
    from rich.console import Console

    from roughvisc.study.validation.validate import validate as validated
    from roughvisc.views.console.tables import print_validation

    console = Console()
    with console.status("validating") as status:
        found = validated(cells, progress=lambda done, of: status.update(f"validating: {done} of {of} cases done"))
    print_validation(console, found)
    failed = sum(not one.passed for one in found)
    if failed:
        raise _Failure(f"{failed} of {len(found)} comparisons failed", 1)


if __name__ == "__main__":
    main()
