"""Commands on results, ``plot`` and ``report``, and on this machine, ``validate``."""

from __future__ import annotations

from pathlib import Path

import click

from roughvisc.cli.group import Failure, say


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the figures. [default: beside the result]")
def plot(result: Path, out: Path | None) -> None:
    """Draw the figures of a result, of a folder, or of a trade.

    Of several cases also the figures of the sweep: quantities against what was varied, histories of all cases. What
    was varied in a case stands above its figures and in the names of their files.

    \b
    Example:
      roughvisc plot results/ground_steel-study --out figures
      roughvisc plot results/ground_steel-study-trade/trade.nc
    """
    from rich.console import Console

    from roughvisc.study.storage.store import no_results, open_result, result_files
    from roughvisc.study.trade.files import is_trade, open_trade
    from roughvisc.views.plot import save_figures, save_sweep_figures, trade
    from roughvisc.views.sweep_figures.files import cases_in, results_of, write_figure

    paths = result_files(result) if result.is_dir() else [result]
    if not paths:
        raise no_results(result)
    console = Console()
    names = cases_in(paths) if result.is_dir() else {}
    for path in paths:
        if path.is_file() and is_trade(path):
            picture = (out or path.parent) / f"{path.stem}.png"
            say(console, "Figure", write_figure(trade(open_trade(path)), picture))
            continue
        stem, title = names.get(path, (path.stem, ""))
        with open_result(path) as dataset:
            for figure in save_figures(dataset, out or path.parent, stem, title=title):
                say(console, "Figure", figure)
    together = results_of(result) if len(paths) > 1 else None
    for figure in save_sweep_figures(together, out or result) if together is not None else ():
        say(console, "Figure", figure)


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Page. [default: report.html in the folder]")
def report(results: Path, output: Path | None) -> None:
    """Write one page (HTML) about a result, or about a folder.

    What was run, the surface and its conditioning, figures, cases with accuracy and cost, and how to run them again;
    case and time can be picked. The page is one file, with all results of the folder. Nothing is fetched
    from anywhere when the page is looked at.

    \b
    Example:
      roughvisc report results/ground_steel-study -o steel.html
    """
    from rich.console import Console

    from roughvisc.views.report.page import report as write

    say(Console(), "Report", write(results, output))


@click.command()
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
        raise Failure(f"{failed} of {len(found)} comparisons failed", 1)
