"""The command that begins a study: ``new``."""

from __future__ import annotations

from pathlib import Path

import click

from roughvisc.cli.group import say
from roughvisc.cli.reading import read_options, reading_options
from roughvisc.errors import InputError, printable


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="The study. [default: FILE's name-study.toml, here]")
@reading_options
def new(file: Path, out: Path | None, **given: str | None) -> None:
    """Write a first study for a scan, with comments: ready to be run, and to be changed.

    The scan is looked at as `roughvisc scan` does, and the study conditions it accordingly. It is pressed on a rubber
    with a pressure that brings some per cent of its area into contact. FILE is an instrument file or a surface card.

    \b
    Example:
      roughvisc new ground.sur
      roughvisc plan ground-study.toml
      roughvisc run ground-study.toml
    """
    from rich.console import Console

    from roughvisc.study.statement.starter import starter_study
    from roughvisc.study.storage.store import whole_file
    from roughvisc.topography.inspection import inspect_scan
    from roughvisc.topography.scans import open_scan
    from roughvisc.views.console.scan_advice import advice_table

    options = read_options(**given)
    out = out or Path(f"{file.stem}-study.toml")
    if out.suffix.lower() != ".toml":
        raise InputError(f"{out}: found the suffix {out.suffix!r}: expected the name of a study, .toml")
    if out.exists():
        raise InputError(f"{out}: exists already, and is not written over: expected another name (--out)")
    found = inspect_scan(open_scan(file, **options))
    text = starter_study(file, out, options, found)
    with whole_file(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    console = Console()
    console.print(advice_table(found))
    console.print()
    say(console, "Study", out)
    following = f"Next: roughvisc plan {out}\n      roughvisc run {out}"
    console.print(printable(following), soft_wrap=True, highlight=False, markup=False)
