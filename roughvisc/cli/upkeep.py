"""Commands on a folder of results: ``verify`` and ``clean``."""

from __future__ import annotations

from pathlib import Path

import click

from roughvisc.cli.group import Failure, complain, counted
from roughvisc.errors import printable


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
def verify(results: Path) -> None:
    """Read results again, and say which are damaged.

    Every byte is held against the checksum that a file ends with when it is written. Nothing is changed; a run of
    their study sets damaged results aside and computes them anew. The exit status is 1 if any is damaged. A file that
    another program has changed has lost its checksum: it is named, and whether its values are right cannot be said.

    \b
    Example:
      roughvisc verify results/focus_variation-study
    """
    from roughvisc.study.storage.checksum import UNSEALED
    from roughvisc.study.storage.upkeep import verify as verified

    found = verified(results)
    bad = [one for one in found if one.flaw]
    bare = [one for one in found if not one.flaw and not one.sealed]
    for one in bad:
        complain(f"{one.path}: is damaged: {one.flaw}")
    for one in bare:
        complain(f"{one.path}: {UNSEALED}")
    whole = f"{len(found) - len(bad)} of {counted(len(found), 'file')} whole"
    click.echo(whole + (f", {len(bare)} of them without a checksum" if bare else ""))
    if bad:
        raise Failure(f"{counted(len(bad), 'damaged file')}: run the study again to have the results computed anew", 1)


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--all", "everything", is_flag=True, help="Also checkpoints, damaged results and records of failures.")
@click.option("--superseded", is_flag=True, help="Also results of other versions that this one has computed again.")
def clean(results: Path, everything: bool, superseded: bool) -> None:
    """Remove what killed runs and earlier versions left.

    Those are torn files, locks of dead runs, and checkpoints of cases that are finished or of an earlier version, from
    which nothing goes on. Results stay, and so does what an unfinished case would go on from, unless --all is given.
    Results of another version, whose cases this one computes again, are named; --superseded removes those that it has
    computed again. A case that a run is at work on is left alone.

    \b
    Example:
      roughvisc clean results/focus_variation-study
    """
    from roughvisc.study.storage.upkeep import clean_folder, kept_of_other_versions

    removed = clean_folder(results, everything=everything, outdated=True, superseded=superseded)
    for path in removed:
        click.echo(printable(f"removed {path.name}"))
    for line in kept_of_other_versions(results):
        click.echo(printable(f"kept {line}"))
    click.echo(f"{counted(len(removed), 'leftover')} removed")
