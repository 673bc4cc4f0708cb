"""``roughvisc budget``: the whole error of a number."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from roughvisc.cli.group import say

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console

_OPTIONS = {
    "quantity": "What number; may be repeated. [default: contact_area]",
    "at": "Time or speed; may be repeated. [default: all kept]",
    "sharp": "Compute cells half as long too: four times the cost, a sharper error of the grid.",
    "ensemble": "The number of the roughness, of which the scan is one sample, or of this patch. [default: patch]",
    "out": "Folder of what is found. [default: budget in the results]",
}


@click.command()
@click.argument("study", metavar="STUDY|RESULT", type=click.Path(path_type=Path))
@click.option("--quantity", "quantities", multiple=True, metavar="NAME", help=_OPTIONS["quantity"])
@click.option("--at", "places", multiple=True, metavar="VALUE", help=_OPTIONS["at"])
@click.option("--sharp", is_flag=True, help=_OPTIONS["sharp"])
@click.option("--modulus-error", metavar="PART", help="Relative error of the moduli at 95 %: 10%.")
@click.option("--time-scale-error", metavar="PART", help="Relative error of the times of the material at 95 %.")
@click.option("--cutoff", metavar="LENGTH", help="Shortest wavelength that the real surface has: '2 um'.")
@click.option("--ensemble/--patch", default=None, help=_OPTIONS["ensemble"])
@click.option("--out", type=click.Path(path_type=Path), help=_OPTIONS["out"])
@click.option("--workers", type=click.IntRange(1), help="Processes side by side. [default: one a core]")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
def budget(
    study: Path,
    quantities: tuple[str, ...],
    places: tuple[str, ...],
    sharp: bool,
    modulus_error: str | None,
    time_scale_error: str | None,
    cutoff: str | None,
    ensemble: bool | None,
    out: Path | None,
    workers: int | None,
    quiet: bool,
) -> None:
    """State the whole error of a number: by source, and together.

    The case is solved again on other grids, without its shortest waves, on other patches of the same roughness and with
    another material, as far as what is asked needs it. What is known of errors and not said here comes from [want] of
    the study. A table is printed; a NetCDF and a figure are written for each quantity. What was solved is kept, and
    used again.

    \b
    Example:
      roughvisc budget focus_variation-study.toml --modulus-error 10% --cutoff "1 um"
      roughvisc budget focus_variation-study.toml --quantity mean_gap --ensemble
    """
    from rich.console import Console

    from roughvisc.study.budget.budget import budgets, case_of
    from roughvisc.study.storage.store import open_result
    from roughvisc.study.trade.files import part_of_one
    from roughvisc.units import stated_quantity
    from roughvisc.variables.axes import AXES

    console = Console(quiet=quiet)
    case, folder = case_of(open_result(study) if study.suffix == ".nc" else study, out)
    axis = case.experiment().axis
    unit = AXES[axis].variables[axis].units
    errors = (("--modulus-error", modulus_error), ("--time-scale-error", time_scale_error))
    modulus, time_scale = (None if text is None else part_of_one(text, name) for name, text in errors)
    found = budgets(
        case,
        list(quantities) or ["contact_area"],
        at=[stated_quantity(one, unit, "--at") for one in places] or None,
        sharp=sharp,
        modulus_error=modulus,
        time_scale_error=time_scale,
        cutoff=cutoff,
        population=None if ensemble is None else "ensemble" if ensemble else "patch",
        out=folder,
        workers=workers,
        progress=not quiet,
    )
    for name, one in found.items():
        show(console, one, folder, name)


def show(console: Console, found: xr.Dataset, folder: Path, name: str, plots: bool = True) -> None:
    """Print the budget of a number, write it, and draw it."""
    from roughvisc.study.storage.store import write_dataset
    from roughvisc.views.console.budget_table import budget_table
    from roughvisc.views.figures.files import write_figure
    from roughvisc.views.plot import budget as figure

    console.print(budget_table(found))
    say(console, "Budget", write_dataset(found, folder / f"budget-{name}.nc"))
    if plots:
        say(console, "Figure", write_figure(figure(found), folder / f"budget-{name}.png"))
