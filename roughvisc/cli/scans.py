"""The command on a scan file: ``scan``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from roughvisc.cli.group import say
from roughvisc.errors import InputError


@click.command()
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

    from roughvisc.study.storage.store import whole_file
    from roughvisc.topography.parameters import levelled_parameters
    from roughvisc.topography.readers import list_channels
    from roughvisc.topography.scans import open_scan
    from roughvisc.topography.writers import card_text, known_suffix, save_scan
    from roughvisc.views.console.tables import scan_table
    from roughvisc.views.plot import surface
    from roughvisc.views.sweep_figures.files import write_figure

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
    console.print(scan_table(height, levelled_parameters(height), file.name, channels))
    say(console, "Picture", write_figure(surface(height), picture))
    if to:
        with whole_file(to) as temporary:
            save_scan(height, temporary)
        say(console, "Converted", to)
    if card:
        with whole_file(card) as temporary:
            temporary.write_text(text, encoding="utf-8")
        say(console, "Card", card)


def _sides(text: str | None) -> Any:
    """Distance of the points along x and y, or one for both. [m]"""
    from roughvisc.units import quantity

    if text is None:
        return None
    sides = [float(part) if part.strip().replace(".", "").isdecimal() else part for part in text.split(",")]
    if len(sides) > 2:
        raise InputError(f"--spacing: found {text!r}: expected one length, or two with a comma between them")
    metres = [quantity(side, "m", "--spacing") for side in sides]
    return metres[0] if len(metres) == 1 else tuple(metres)
