"""Commands on what a study costs and how accurate it is: ``plan``, ``trade``, ``budget``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from roughvisc.cli.group import PATH, Failure, say
from roughvisc.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the results; its disk must have room.")
@click.option("--workers", type=click.IntRange(1), help="Number of parallel processes. [default: one per core]")
def plan(study: Path, out: Path | None, workers: int | None) -> None:
    """Show what a study will model and what it will cost.

    Writes nothing. Contact area and numbers of steps and FFTs are estimated by a run on at most 64 x 64 cells, the time
    by a convolution timed on this machine. The exit status is 2 if the study does not fit into memory or on the disk.

    \b
    Example:
      roughvisc plan focus_variation-study.toml
    """
    from rich.console import Console

    from roughvisc.study.plan import plan as planned
    from roughvisc.views.console.tables import plan_tables

    costs = planned(study, out, workers=workers)
    if not costs["refusal"].all():
        Console().print(plan_tables(costs))
    if why := costs.attrs["refusal"].removeprefix(f"{study}: "):
        raise Failure(f"{study}: cannot run: {why}", 2)


@click.command()
@click.argument("study", type=PATH)
@click.option("--out", type=PATH, help="Folder for the measurements. [default: results/STUDY-trade]")
@click.option("--accuracy", metavar="PART", default="1%", help="Wanted relative error.", show_default=True)
@click.option("--quantity", default=None, help="Quantity of this error. [default: contact_area, or friction]")
@click.option("--budget", metavar="TIME", default="5 min", help="Total wall time of all runs.", show_default=True)
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def trade(study: Path, out: Path | None, accuracy: str, quantity: str | None, budget: str, quiet: bool) -> None:
    """Measure the cost and the error of several tolerances and grids.

    Each run is timed and compared with the finest run. Marks the cheapest setting with the error --accuracy. Writes a
    NetCDF file and a figure.

    \b
    Example:
      roughvisc trade focus_variation-study.toml
      roughvisc trade focus_variation-study.toml --accuracy 0.1% --quantity mean_gap
    """
    from dask.system import CPU_COUNT
    from rich.console import Console
    from scipy import fft

    from roughvisc.progress import reporting
    from roughvisc.study.statement.case import read_study
    from roughvisc.study.storage.store import write_dataset
    from roughvisc.study.trade import files as trade_file
    from roughvisc.study.trade.bench import further_quantities_of, quantities_of
    from roughvisc.study.trade.recommend import main_quantities
    from roughvisc.study.trade.trade import trade as measured
    from roughvisc.views.console.accuracy_tables import trade_table
    from roughvisc.views.figures.files import write_figure
    from roughvisc.views.plot import trade as figure

    case, console, time = read_study(study), Console(quiet=quiet), trade_file.seconds(budget, "--budget")
    folder, part = trade_file.trade_folder(case, out), trade_file.part_of_one(accuracy, "--accuracy")
    known = (*quantities_of(case), *further_quantities_of(case))
    if quantity is not None and quantity not in known:
        raise InputError(key="--quantity", found=quantity, expected=f"one of {', '.join(known)}")
    with reporting(True, console=console, at=case.at) as report, fft.set_workers(CPU_COUNT):
        dataset = measured(case, quantities=[quantity] if quantity else [], budget=time, progress=report)
    main = main_quantities(dataset)
    quantity = quantity or main[0]
    console.print(trade_table(dataset, quantity, part))
    say(console, "Trade", write_dataset(dataset, folder / "trade.nc"))
    shown = list(dict.fromkeys([quantity, *main]))[:2]
    say(console, "Figure", write_figure(figure(dataset, shown), folder / "trade.png"))


_OPTIONS = {
    "quantity": "What number; may be repeated. [default: contact_area]",
    "at": "Time or speed; may be repeated. [default: all kept]",
    "ensemble": "The number of the roughness, of which the scan is one sample, or of this patch. [default: patch]",
    "out": "Folder of what is found. [default: budget in the results]",
}


@click.command()
@click.argument("study", metavar="STUDY|RESULT", type=PATH)
@click.option("--quantity", "quantities", multiple=True, metavar="NAME", help=_OPTIONS["quantity"])
@click.option("--at", "places", multiple=True, metavar="VALUE", help=_OPTIONS["at"])
@click.option("--modulus-error", metavar="PART", help="Relative error of the moduli at 95 %: 10%.")
@click.option("--time-scale-error", metavar="PART", help="Relative error of the times of the material at 95 %.")
@click.option("--cutoff", metavar="LENGTH", help="Shortest wavelength that the real surface has: '2 um'.")
@click.option("--ensemble/--patch", default=None, help=_OPTIONS["ensemble"])
@click.option("--out", type=PATH, help=_OPTIONS["out"])
@click.option("--workers", type=click.IntRange(1), help="Processes side by side. [default: one a core]")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def budget(
    study: Path,
    quantities: tuple[str, ...],
    places: tuple[str, ...],
    modulus_error: str | None,
    time_scale_error: str | None,
    cutoff: str | None,
    ensemble: bool | None,
    out: Path | None,
    workers: int | None,
    quiet: bool,
) -> None:
    """Estimate the total uncertainty of a number, by source.

    Solves the case again on other grids, without its shortest waves, on other patches of the same roughness and with
    another material, as needed. Prints a table, and writes a NetCDF file and a figure for each quantity. All solves are
    kept and used again.

    \b
    Example:
      roughvisc budget focus_variation-study.toml --modulus-error 10% --cutoff "1 um"
      roughvisc budget focus_variation-study.toml --quantity mean_gap --ensemble
    """
    from rich.console import Console

    from roughvisc.study.budget.budget import budgets, case_of
    from roughvisc.study.storage.store import open_result
    from roughvisc.study.trade.files import part_of_one
    from roughvisc.units import number
    from roughvisc.variables import VARIABLES

    console = Console(quiet=quiet)
    case, folder = case_of(open_result(study) if study.suffix == ".nc" else study, out)
    axis = case.experiment().axis
    unit = VARIABLES[axis].units
    known = {
        "modulus_error": None if modulus_error is None else part_of_one(modulus_error, "--modulus-error"),
        "time_scale_error": None if time_scale_error is None else part_of_one(time_scale_error, "--time-scale-error"),
        "cutoff": cutoff,
        "population": None if ensemble is None else "ensemble" if ensemble else "patch",
    }
    found = budgets(
        case,
        list(quantities) or ["contact_area"],
        at=[number(one, unit, "--at") for one in places] or None,
        known=known,
        out=folder,
        workers=workers,
        progress=not quiet,
    )
    for name, one in found.items():
        show(console, one, folder, name)


def show(console: Console, found: xr.Dataset, folder: Path, name: str, plots: bool = True) -> None:
    """Print the budget of a number, write it, and draw it."""
    from roughvisc.study.storage.store import write_dataset
    from roughvisc.views.console.accuracy_tables import budget_table
    from roughvisc.views.figures.files import write_figure
    from roughvisc.views.plot import budget as figure

    console.print(budget_table(found))
    say(console, "Budget", write_dataset(found, folder / f"budget-{name}.nc"))
    if plots:
        say(console, "Figure", write_figure(figure(found), folder / f"budget-{name}.png"))
