"""The command line: ``roughvisc run | scan | plot``.

Exit status: 0 all done, 1 a case failed or did not converge, 2 the input is wrong, 130 interrupted. Heavy imports
are made inside the commands, so that ``--help`` is quick.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.errors import InputError, RoughviscError

if TYPE_CHECKING:
    from rich.console import Console

    from roughvisc.study.case import Case


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
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
def run(study: Path, out: Path | None, no_plots: bool, quiet: bool) -> None:
    """Compute all cases of a study file.

    Each case ends in one NetCDF file, named by what determines its numbers, and in figures beside it. With a [sweep]
    the cases are computed one after another; one that fails does not stop the others.

    \b
    Example:
      roughvisc run workflows/quickstart.toml --out /tmp/quickstart
    """
    from rich.console import Console

    from roughvisc.study.case import read_cases
    from roughvisc.study.run import result_folder

    cases = read_cases(study)
    folder = result_folder(cases[0], out)
    console = Console(quiet=quiet)
    refusals, failures = [], []
    for number, case in enumerate(cases, 1):
        label = f"case {number} of {len(cases)}" if len(cases) > 1 else study.stem
        try:
            complaint = _run_one(case, folder, label, console, not no_plots)
        except RoughviscError as error:
            if len(cases) == 1:
                raise
            complaint = str(error)
            refusals += [complaint] if isinstance(error, InputError) else []
        if complaint:
            failures.append(f"{label}: {complaint}")
            click.echo(f"roughvisc: {failures[-1]}", err=True)
    if len(refusals) == len(cases):
        raise _Failure("no case could be computed: the input is wrong", 2)
    if failures:
        raise _Failure(f"{len(failures)} of {len(cases)} cases failed", 1)


def _run_one(case: Case, folder: Path, label: str, console: Console, plots: bool) -> str:
    """Compute, keep, draw and sum up one case; what to complain of, empty if nothing."""
    from roughvisc.study.run import compute, keep, unconverged
    from roughvisc.views.console import progress, result_table

    with progress(console, label) as report:
        dataset = compute(case, progress=report)
    path = keep(dataset, case, folder)
    console.print(result_table(dataset))
    _say(console, "Result", path)
    if plots:
        from roughvisc.views.plot import save_figures

        for figure in save_figures(dataset, folder, case.key):
            _say(console, "Figure", figure)
    console.print()
    return unconverged(dataset)


def _say(console: Console, what: str, path: Path) -> None:
    """A path on one line of its own, whole, so that it can be copied or cut out by a program."""
    shown = os.path.relpath(path)
    console.print(f"{what}: {path if shown.startswith('..') else shown}", soft_wrap=True, highlight=False)


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(path_type=Path), help="Quick-look picture. [default: FILE's name.png, here]")
@click.option("--unit", help="Unit of length, where the file states none: um.")
@click.option("--channel", help="Name or number of the channel. [default: the height]")
@click.option("--spacing", help="Distance of the points, where the file states none: 1um, or 1um,2um.")
@click.option("--format", help="Format, where the suffix does not tell.")
def scan(
    file: Path, plot: Path | None, unit: str | None, channel: str | None, spacing: str | None, format: str | None
) -> None:
    """Say what is in a scan, and draw it.

    Size, shape, spacing, missing points, Sq and rms slope; FILE is an instrument file or a surface card.

    \b
    Example:
      roughvisc scan ground.sur --plot ground.png
    """
    from rich.console import Console

    from roughvisc.topography.conditioning import level
    from roughvisc.topography.parameters import parameters
    from roughvisc.topography.readers import open_scan
    from roughvisc.views.console import scan_table
    from roughvisc.views.plot import surface

    height = open_scan(
        file,
        format=format,
        unit=unit,
        channel=int(channel) if channel is not None and channel.isdecimal() else channel,
        spacing=_sides(spacing),
    )
    console = Console()
    console.print(scan_table(height, parameters(level(height)), file.name))
    picture = plot or Path(f"{file.stem}.png")
    _draw(surface(height), picture)
    _say(console, "Picture", picture)


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
    from roughvisc.study.store import whole_file

    kind = path.suffix.lstrip(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: is no kind of picture: expected one of .png, .pdf, .svg")
    with whole_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=200)


@main.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the figures. [default: beside the result]")
def plot(result: Path, out: Path | None) -> None:
    """Draw the figures of a result, or of all results in a folder.

    \b
    Example:
      roughvisc plot results/quickstart --out figures
    """
    from rich.console import Console

    from roughvisc.study.store import open_result
    from roughvisc.views.plot import save_figures

    paths = sorted(p for p in result.glob("*.nc") if not p.name.startswith(".")) if result.is_dir() else [result]
    if not paths:
        raise InputError(f"{result}: holds no results: expected files .nc, as roughvisc run writes them")
    console = Console()
    for path in paths:
        with open_result(path) as dataset:
            for figure in save_figures(dataset, out or path.parent, path.stem):
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

    from roughvisc.views.report import report as write

    _say(Console(), "Report", write(results, output))


if __name__ == "__main__":
    main()
