"""Commands on results, ``plot``, ``report`` and ``audit``, and on this machine, ``validate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from roughvisc.cli.group import Failure, say, say_figures


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the figures. [default: beside the result]")
@click.option("--all", "every", is_flag=True, help="Draw every figure that the results allow.")
def plot(result: Path, out: Path | None, every: bool) -> None:
    """Draw the figures of a result, of a folder, or of a trade.

    Of several cases also the figures of the sweep: quantities against what was varied, histories of all cases. What
    was varied in a case stands above its figures and in the names of their files.

    \b
    Example:
      roughvisc plot results/focus_variation-study --out figures
      roughvisc plot results/focus_variation-study-trade/trade.nc
    """
    from rich.console import Console

    from roughvisc.study.storage.store import no_results, result_files, whole_result
    from roughvisc.study.trade.files import is_trade, open_trade
    from roughvisc.views.plot import save_figures, save_sweep_figures, trade
    from roughvisc.views.sweep_figures.files import cases_in, results_of, write_figure

    paths = result_files(result) if result.is_dir() else [result]
    if not paths:
        raise no_results(result)
    console = Console()
    names = cases_in(paths) if result.is_dir() else {}
    drawn: list[Path] = []
    for path in paths:
        if path.is_file() and is_trade(path):
            drawn.append(write_figure(trade(open_trade(path)), (out or path.parent) / f"{path.stem}.png"))
            continue
        stem, title = names.get(path, (path.stem, ""))
        with whole_result(path) as dataset:
            drawn += save_figures(dataset, out or path.parent, stem, title=title, every=every)
    together = results_of(result) if len(paths) > 1 else None
    drawn += save_sweep_figures(together, out or result) if together is not None else ()
    say_figures(console, drawn)


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
      roughvisc report results/focus_variation-study -o report.html
    """
    from rich.console import Console

    from roughvisc.views.report.page import report as write

    say(Console(), "Report", write(results, output))


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--work-of-adhesion", metavar="W", help='Of the two surfaces: "50 mJ/m^2".')
@click.option("--yield-strength", metavar="Y", help='In tension, of the body that yields first: "40 MPa".')
@click.option("--thickness", metavar="H", help='True thickness of what was taken for a half-space: "5 mm".')
@click.option("--base", help="What it lies on: bonded or slipping. [default: bonded]")
@click.option("--density", metavar="RHO", help='Of the body: "1100 kg/m^3".')
@click.option("--linear-strain", metavar="STRAIN", help='Up to which the material is linear: 0.05, or "5 %".')
@click.option("--heat-conductivity", metavar="K", help='Of the body: "0.2 W/m/K".')
@click.option("--volumetric-heat-capacity", metavar="C", help='Of the body: "1.8 MJ/m^3/K".')
@click.option(
    "--study", type=click.Path(path_type=Path), help="Study whose [audit] counts, in place of the result's own."
)
def audit(result: Path, study: Path | None, **stated: Any) -> None:
    """Say what the model leaves out, and whether it matters.

    For each assumption a number, a verdict (holds, doubtful, broken, not known) and a sentence. What is not given is
    that of the table [audit] that the study had when it ran. Of a folder every result is told of.

    \b
    Example:
      roughvisc audit results/focus_variation-study --work-of-adhesion "50 mJ/m^2"
    """
    from rich.console import Console

    from roughvisc.study.audit.audit import audit as audited
    from roughvisc.study.audit.given import from_options, of_study
    from roughvisc.study.storage.store import no_results, result_files, whole_result
    from roughvisc.views.console.audit_table import audit_table

    given = from_options(stated).over(of_study(study) if study is not None else {})
    paths = result_files(result) if result.is_dir() else [result]
    if not paths:
        raise no_results(result)
    console = Console()
    for path in paths:
        with whole_result(path) as dataset:
            console.print(audit_table(audited(dataset, **given.stated())))


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
