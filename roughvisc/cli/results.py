"""Commands on results: ``view``, ``plot``, ``report``, ``table``, ``audit``, ``verify`` and ``clean``."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

import roughvisc as rv
from roughvisc.cli.group import PATH, Failure, complain, counted, quantity, say_figures, say_path, screen
from roughvisc.errors import printable


class _AllFigures(click.Option):
    """Option that lists the figures it adds, when its help is shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from roughvisc.plot.save import DEFAULT, FIGURES  # slow to import

        others = ", ".join(name for name in FIGURES if name not in DEFAULT)
        self.help = f"Also draw {others}, and of a folder the figures of each case."
        return super().get_help_record(ctx)


@click.command()
@click.argument("result", type=PATH)
@click.option("-o", "--out", type=PATH, help="Page to write. [default: page.html in the folder, or RESULT-page.html]")
@click.option("--no-open", is_flag=True, help="Do not open the page in a browser.")
def view(result: Path, out: Path | None, no_open: bool) -> None:
    """Write a page to explore a result or a folder of results, and open it in a browser.

    The page shows every field at all kept times or speeds, profiles and histories of all cases. It is one file that
    needs neither a server nor the network.

    \b
    Example:
      roughvisc view results/focus_variation-study
    """
    import webbrowser

    path = rv.plot.page(result, out)
    say_path(screen(), "Page", path)
    has_screen = sys.platform in ("darwin", "win32") or {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    if has_screen and not no_open:  # without a screen a browser of text would take the terminal
        webbrowser.open(path.absolute().as_uri())


@click.command()
@click.argument("result", type=PATH)
@click.option("--out", type=PATH, help="Folder for the figures. [default: folder of the result]")
@click.option("--all", "every", is_flag=True, cls=_AllFigures)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of the files.",
)
def plot(result: Path, out: Path | None, every: bool, kind: str) -> None:
    """Draw figures of a result or a folder of results.

    Draws two figures of a result: history and maps, or friction curve and maps. Of a folder with several cases, draws
    the figures of the sweep: quantities against the varied settings, and the histories of all cases. File names state
    the varied settings.

    \b
    Example:
      roughvisc plot results/focus_variation-study --out figures
    """
    from roughvisc.plot.save import results_of_sweep, save_figures_of_files, save_sweep_figures
    from roughvisc.runs.cluster import threads_each
    from roughvisc.runs.folder import results_at

    paths = results_at(result)
    together = results_of_sweep(result) if len(paths) > 1 else None
    drawn = [] if together is None else save_sweep_figures(together, out or result, kind=kind)
    if together is None or every:
        drawn += save_figures_of_files(paths, out, every=every, processes=threads_each(1), kind=kind)
    say_figures(screen(), drawn)


@click.command()
@click.argument("results", type=PATH)
@click.option("-o", "--out", type=PATH, help="Page to write. [default: report.html in the folder]")
def report(results: Path, out: Path | None) -> None:
    """Write an HTML report of a result or a folder of results.

    The report shows the accuracy and cost of each case, figures, the surface and its conditioning, assumptions, and
    how to repeat the study. It is one self-contained file that loads nothing from the network.

    \b
    Example:
      roughvisc report results/focus_variation-study -o report.html
    """
    say_path(screen(), "Report", rv.report(results, out))  # other processes would take longer to start


@click.command()
@click.argument("results", type=PATH)
@click.option("-o", "--out", type=PATH, help="CSV file to write. [default: cases.csv in the folder, or RESULT.csv]")
def table(results: Path, out: Path | None) -> None:
    """Write a CSV table of a result or a folder of results.

    The table of a result has one row per kept time, or per speed. The table of a folder has one row per case. Headings
    state the units.

    \b
    Example:
      roughvisc table results/focus_variation-study -o table.csv
    """
    from roughvisc.runs.csv_files import write_table

    if results.is_dir():
        path = write_table(results, out)
    else:
        with rv.open_result(results) as dataset:
            path = rv.to_csv(dataset, out or results.with_suffix(".csv"))
    say_path(screen(), "Table", path)


@click.command()
@click.argument("result", type=PATH)
@quantity("--work-of-adhesion", "W", 'Work of adhesion of the two surfaces: "50 mJ/m^2".')
@quantity("--yield-strength", "Y", 'Tensile yield strength of the softer body: "40 MPa".')
@quantity("--thickness", "H", 'Actual thickness of the body modelled as a half-space: "5 mm".')
@click.option("--base", help="How that body rests on its base: bonded or slipping. [default: bonded]")
@quantity("--density", "RHO", 'Density of the body: "1100 kg/m^3".')
@quantity("--heat-conductivity", "K", 'Heat conductivity of the body: "0.2 W/m/K".')
@quantity("--volumetric-heat-capacity", "C", 'Heat capacity of the body: "1.8 MJ/m^3/K".')
def audit(result: Path, **properties: Any) -> None:
    """Check the assumptions of the model for a result.

    Prints, for each assumption, a number, a verdict (holds, doubtful, broken, not known) and a reason. Properties
    not given as options come from the [audit] table of the study. For a folder, checks every result.

    \b
    Example:
      roughvisc audit results/focus_variation-study --work-of-adhesion "50 mJ/m^2"
    """
    from roughvisc.cli.study_tables import audit_table
    from roughvisc.judge.audit import audit_of
    from roughvisc.runs.folder import results_at
    from roughvisc.runs.sweep_data import numbers_of, read_sweep

    given = {name: value for name, value in properties.items() if value is not None}
    numbers = numbers_of(read_sweep(result)) if result.is_dir() else {}
    for path in sorted(results_at(result), key=lambda path: numbers.get(path.stem, len(numbers))):
        with rv.open_result(path) as dataset:
            screen().print(audit_table(audit_of(dataset, **given)), "", sep="\n")


@click.command()
@click.argument("results", type=PATH)
def verify(results: Path) -> None:
    """Check results for damage.

    Reads every file to its end, compares each block with its checksum, and changes nothing. The exit status is 1 if a
    file is damaged or cannot be read. Remove a damaged file and run its study again to replace it.

    \b
    Example:
      roughvisc verify results/focus_variation-study
    """
    from roughvisc.runs.netcdf import verify as verified

    damage = verified(results)
    bad = [flaw for flaw in damage.values() if flaw]
    for flaw in bad:
        complain(flaw)
    click.echo(f"{len(damage) - len(bad)} of {counted(len(damage), 'file')} intact")
    if bad:
        raise Failure(f"{counted(len(bad), 'file')} damaged or not readable", 1)


@click.command()
@click.argument("results", type=PATH)
@click.option("--all", "everything", is_flag=True, help="Also remove checkpoints, damaged results and failure records.")
def clean(results: Path, everything: bool) -> None:
    """Remove leftovers of interrupted runs.

    Removes incomplete files, locks of dead runs, and checkpoints of finished cases. Keeps results, and checkpoints of
    unfinished cases unless --all is given. Cases in use by a run are not touched.

    \b
    Example:
      roughvisc clean results/focus_variation-study
    """
    from roughvisc.runs.folder import clean_folder

    for path in (removed := clean_folder(results, everything=everything)):
        click.echo(printable(f"removed {path.name}"))
    click.echo(f"{counted(len(removed), 'leftover')} removed")
