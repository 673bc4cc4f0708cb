"""Commands on a scan file: ``scan``, and ``new``, which begins a study of one."""

from __future__ import annotations

import shutil
from pathlib import Path

import click

from roughvisc.cli.group import PATH, say
from roughvisc.cli.reading import read_options, reading_options
from roughvisc.errors import InputError, printable


@click.command()
@click.argument("file", type=PATH)
@click.option("--plot", type=PATH, help="Picture to save. [default: FILE's name.png, here]")
@click.option("--to", type=PATH, help="Convert the heights to a .nc, .x3p or .sdf file.")
@click.option("--force", is_flag=True, help="Overwrite an existing picture or converted file.")
@click.option(
    "--card",
    type=PATH,
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

    from roughvisc.study.storage.files import atomic_write
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


@click.command()
@click.argument("file", type=PATH, required=False)
@click.option("-o", "--out", type=PATH, help="Study file to write. [default: FILE's name-study.toml, here]")
@click.option(
    "--contact",
    metavar="PART",
    default="5 %",
    show_default=True,
    help="Part of the area in contact at the end, which sets the pressure.",
)
@reading_options
def new(file: Path | None, out: Path | None, contact: str, **given: str | None) -> None:
    """Write a first study for a scan.

    The study file is commented and ready to run or edit. It uses the preprocessing that `roughvisc scan` recommends
    and presses the scan on a rubber, at a pressure that brings the part --contact of the area into contact. FILE is an
    instrument file or a surface card. Without FILE, the command also writes an example scan, focus_variation.x3p.

    \b
    Example:
      roughvisc new
      roughvisc plan focus_variation-study.toml
      roughvisc run focus_variation-study.toml
      roughvisc new focus_variation.x3p --contact "20 %" --out other.toml
    """
    from rich.console import Console

    from roughvisc.study.first_pressure import first_pressure
    from roughvisc.study.statement.starter import starter_study
    from roughvisc.study.storage.files import atomic_write
    from roughvisc.study.trade.files import part_of_one
    from roughvisc.topography.example import EXAMPLE
    from roughvisc.topography.inspection import inspect_scan
    from roughvisc.topography.scans import open_scan
    from roughvisc.views.console.scan_advice import advice_table

    options, part = read_options(**given), part_of_one(contact, "--contact")
    wanted = file or Path(EXAMPLE)
    out = out or Path(f"{wanted.stem}-study.toml")
    if out.suffix.lower() != ".toml":
        raise InputError(f"{out}: has the suffix {out.suffix!r}: expected a study file, .toml")
    if out.exists():
        raise InputError(f"{out}: already exists: expected another name (--out)")
    if file is None:
        for option in (name for name, value in given.items() if value):
            raise InputError(f"--{option}: has no meaning without FILE: expected FILE")
        _write_example(wanted)
    scan = open_scan(wanted, **options)
    found = inspect_scan(scan)
    text = starter_study(wanted, out, options, found, first_pressure(scan, found, part))
    with atomic_write(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    console = Console()
    console.print(advice_table(found))
    console.print()
    if file is None:
        say(console, "Scan", wanted)
    say(console, "Study", out)
    following = f"Next: roughvisc plan {out}\n      roughvisc run {out}"
    console.print(printable(following), soft_wrap=True, highlight=False, markup=False)


def _write_example(path: Path) -> None:
    """Write the scan that ships with roughvisc; one that is there already stays, and has to be the same."""
    from roughvisc.study.storage.files import atomic_write
    from roughvisc.topography.example import example_scan

    held = example_scan()
    if not path.exists():
        with atomic_write(path) as temporary:
            shutil.copyfile(held, temporary)
    elif path.read_bytes() != held.read_bytes():
        raise InputError(
            f"{path}: already exists and differs from the example: expected an empty folder, or your own FILE"
        )
