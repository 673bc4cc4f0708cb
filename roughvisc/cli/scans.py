"""Commands on a scan file: ``new``, which writes its first study, and ``scan``."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import roughvisc as rv
from roughvisc.cli.group import PATH, complain, quantity, say, say_path, screen
from roughvisc.errors import InputError
from roughvisc.paths import read_bytes, shell_word

if TYPE_CHECKING:
    import xarray as xr


def _sides(text: str) -> Any:
    """Return one length, or two separated by a comma."""
    sides = tuple(side.strip() for side in text.split(","))
    return sides[0] if len(sides) == 1 else sides


def _reading(command: Any) -> Any:
    """Add the options of :func:`roughvisc.open_scan` to a command."""
    for option in (
        click.option("--format", help="Format, if the suffix does not tell it."),
        click.option("--channel", help="Name or number of the channel. [default: the height]"),
        click.option(
            "--height-scale", type=float, help="Factor of the heights, if the file states a wrong unit: 1e-6."
        ),
        click.option("--no-data", type=float, help="Number in the file that marks a missing point: -9999."),
        quantity("--grid", "LENGTH", "Side of the cells into which points x, y, z are sorted: 2um."),
        click.option("--spacing", type=_sides, metavar="LENGTH", help="Distance between points: 1um, or 1um,2um."),
        click.option(
            "--unit", help="Unit of length, if the file states none: um, or mm,um for x and y in mm, heights in um."
        ),
    ):
        command = option(command)
    return command


#: Name of the command in the metadata of its pictures, which it replaces.
_MAKER = "roughvisc scan"
#: Question for an argument that a file lacks, and the type of the answer.
_QUESTIONS: dict[str, tuple[str, Any]] = {
    "unit": ("Unit of x, y and heights (such as um, or mm,um)", str),
    "spacing": ("Distance between points (such as 1 um)", _sides),
}


def _opened(file: Path, options: dict[str, Any]) -> xr.DataArray:
    """Open a scan; on a terminal, ask once for a unit and a spacing that the file lacks.

    The answers are added to the options, with the spacing in metres.
    """
    from roughvisc.units import in_si

    if (options["channel"] or "").isdecimal():
        options["channel"] = int(options["channel"])
    while True:
        for key in ("spacing", "grid"):
            options[key] = in_si(options[key], "m", key)
        try:
            return rv.open_scan(file, **options)
        except InputError as error:
            lacks = error.key in _QUESTIONS and options[error.key] is None
            # a closed stream is None
            if not (lacks and all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr))):
                raise InputError(_by_options(str(error), options), key=error.key) from error
            question, kind = _QUESTIONS[error.key]
            options[error.key] = click.prompt(f"{file}: {question}", type=kind, err=True)


def _by_options(message: str, options: Iterable[str]) -> str:
    """Return a message in which arguments of a file are options of the command: ``unit = "um"`` is ``--unit um``."""
    names = "|".join(options)
    return re.sub(
        rf'\b({names}) = (?:"([^"]+)"|([^",\s]+))',
        lambda stated: f"--{stated[1].replace('_', '-')} {shlex.quote(stated[2] or stated[3])}",
        message,
    )


@click.command()
@click.argument("file", type=PATH)
@click.option("--plot", type=PATH, help="Picture to save. [default: FILE's name.png, here]")
@click.option("--to", type=PATH, help="Convert the heights to a .nc, .x3p or .sdf file.")
@click.option("--card", type=PATH, help="Write a surface card with these recommendations, a .toml file.")
@_reading
def scan(file: Path, plot: Path | None, to: Path | None, card: Path | None, **options: Any) -> None:
    """Summarise a scan and recommend preprocessing.

    Prints size, channels, missing points and areal parameters; then spikes, tilt, form, borders and noise, each with
    a recommendation; then a [surface] table to paste into a study. Parameters and picture refer to the scan without
    its mean plane. A picture of an earlier scan is replaced. FILE is an instrument file or a surface card.

    \b
    Example:
      roughvisc scan focus_variation.x3p --plot scan.png
      roughvisc scan focus_variation.x3p --to scan.nc --card scan.toml
    """
    from roughvisc.cli.summaries import findings_table, scan_table
    from roughvisc.plot.save import is_made_by, write_figure
    from roughvisc.progress import sign_of_life
    from roughvisc.runs.folder import atomic_write, write_text
    from roughvisc.topography.inspection import inspection_of
    from roughvisc.topography.scans import card_text, known_suffix, surface_table

    height = _opened(file, options)
    if to:
        known_suffix(to)
    picture = plot or Path(f"{file.stem}.png")
    is_replaced = is_made_by(picture, _MAKER)
    for out in filter(None, (plot, to, card)):
        if out.exists() and not (out is plot and is_replaced):
            raise InputError(f"{out}: already exists: expected another name")
    with sign_of_life("inspects the scan"):
        levelled = rv.level(height)
        inspection = inspection_of(height)
        measures = rv.parameters(levelled)
    text = card_text(file, card.parent, options, inspection.steps) if card else ""
    console = screen()
    console.print(scan_table(height, measures, file.name), "", findings_table(inspection), "", sep="\n")
    say(console, surface_table(file, Path(), options, inspection.steps))
    if is_replaced or not picture.exists():
        say_path(
            console,
            "Picture",
            write_figure(rv.plot.surface(levelled, cutoff=inspection.steps.get("filter")), picture, _MAKER),
        )
    else:
        say_path(console, "Picture kept, because roughvisc scan did not make it", picture)
    if to:
        with atomic_write(to) as temporary:
            rv.save_scan(height, temporary)
        say_path(console, "Converted", to)
    if card:
        say_path(console, "Card", write_text(card, text))


@click.command()
@click.argument("file", type=PATH, required=False)
@click.option("-o", "--out", type=PATH, help="Study file to write. [default: FILE's name-study.toml, here]")
@quantity("--contact", "PART", "Final contact fraction, which sets the pressure.", default="5 %", show_default=True)
@_reading
def new(file: Path | None, out: Path | None, contact: str, **options: Any) -> None:
    """Write a first study for a scan, or for an example.

    The study file is commented and ready to run or edit. It uses the preprocessing that `roughvisc scan` recommends.
    The scan is pressed on a rubber until the part --contact of its area touches. FILE is an instrument file or a
    surface card. Without FILE, the command also writes an example scan, focus_variation.x3p.

    \b
    Example:
      roughvisc new
      roughvisc plan focus_variation-study.toml
      roughvisc run focus_variation-study.toml
      roughvisc new focus_variation.x3p --contact "20 %" --out other.toml
    """
    from roughvisc.cli.summaries import findings_table
    from roughvisc.progress import sign_of_life
    from roughvisc.runs.folder import atomic_write, write_text
    from roughvisc.study.first_study import first_pressure, starter_study
    from roughvisc.topography import EXAMPLE
    from roughvisc.topography.inspection import inspection_of
    from roughvisc.units import number

    fraction = number(contact, "1", "contact", above=0, below=1)
    source = file or Path(EXAMPLE)
    out = out or Path(f"{source.stem}-study.toml")
    if out.suffix.lower() != ".toml" or out.exists():
        raise InputError(f"{out}: already exists, or is not a .toml file: expected another name (--out)")
    if file is None:
        shipped = rv.example_scan().read_bytes()
        if source.exists() and read_bytes(source) != shipped:
            raise InputError(f"{source}: already exists and differs from the example: expected your own FILE")
        with atomic_write(source) as temporary:
            temporary.write_bytes(shipped)
    height = _opened(source, options)
    with sign_of_life("inspects the scan"):
        inspection = inspection_of(height)
        first = first_pressure(height, inspection, fraction)
    write_text(out, starter_study(source, out, options, inspection, first))
    if first.miss:
        complain(f"warning: {first.miss}")
    console = screen()
    console.print(findings_table(inspection), "", sep="\n")
    if file is None:
        say_path(console, "Scan", source)
    say_path(console, "Study", out)
    say(console, f"Next: roughvisc plan {shell_word(out)}\n      roughvisc run {shell_word(out)}")
