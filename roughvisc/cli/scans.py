"""The command on a scan file: ``scan``."""

from __future__ import annotations

from pathlib import Path

import click

from roughvisc.cli.group import say
from roughvisc.cli.reading import read_options, reading_options
from roughvisc.errors import InputError


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(path_type=Path), help="Picture to save. [default: FILE's name.png, here]")
@click.option("--to", type=click.Path(path_type=Path), help="Convert the heights to a .nc, .x3p or .sdf file.")
@click.option("--force", is_flag=True, help="Overwrite an existing picture or converted file.")
@click.option(
    "--card",
    type=click.Path(path_type=Path),
    is_flag=False,
    flag_value=Path(),
    metavar="[OUT.toml]",
    help="Write a surface card for FILE. [name: FILE's name.toml, beside it]",
)
@reading_options
def scan(
    file: Path,
    plot: Path | None,
    to: Path | None,
    card: Path | None,
    force: bool,
    **given: str | None,
) -> None:
    """Summarise a scan, recommend preprocessing, save a picture.

    Prints size, channels, missing points and areal parameters; then spikes, tilt, form, borders and noise, each with
    a recommendation; then a [surface] table to paste into a study. Parameters and picture refer to the scan without
    its mean plane. Existing files are kept unless --force is given. FILE is an instrument file or a surface card.

    \b
    Example:
      roughvisc scan focus_variation.x3p --plot scan.png
      roughvisc scan focus_variation.x3p --to scan.nc --card
    """
    from rich.console import Console

    from roughvisc.study.storage.store import atomic_write
    from roughvisc.topography.bandwidth import level
    from roughvisc.topography.inspection import inspect_scan
    from roughvisc.topography.parameters import parameters
    from roughvisc.topography.readers import list_channels
    from roughvisc.topography.scans import open_scan
    from roughvisc.topography.writers import card_text, known_suffix, save_scan, surface_table
    from roughvisc.views.console.scan_advice import advice_table
    from roughvisc.views.console.tables import scan_table
    from roughvisc.views.figures.files import write_figure
    from roughvisc.views.plot import surface

    options = read_options(**given)
    height = open_scan(file, **options)
    channels = () if "card" in height.attrs else list_channels(file, format=options["format"])
    picture, card = plot or Path(f"{file.stem}.png"), file.with_suffix(".toml") if card == Path() else card
    text = card_text(file, card.parent, options) if card else ""
    if to:
        known_suffix(to)
    for out in filter(None, (to, card, picture if plot or force else None)):
        if out.exists() and (not force or out == card or out.samefile(file)):
            advice = "expected another name" + (" or --force" if out != card and not out.samefile(file) else "")
            raise InputError(f"{out}: already exists: {advice}")
    console = Console()
    levelled = level(height)
    console.print(scan_table(height, parameters(levelled), file.name, channels))
    found = inspect_scan(height)
    console.print()
    console.print(advice_table(found))
    console.print()
    console.print(surface_table(file, Path(), options, found.steps), soft_wrap=True, highlight=False, markup=False)
    if picture.exists() and not force and not plot:
        say(console, "Existing picture kept (--force overwrites it)", picture)
    else:
        say(console, "Picture", write_figure(surface(levelled), picture))
    if to:
        with atomic_write(to) as temporary:
            save_scan(height, temporary)
        say(console, "Converted", to)
    if card:
        with atomic_write(card) as temporary:
            temporary.write_text(text, encoding="utf-8")
        say(console, "Card", card)
