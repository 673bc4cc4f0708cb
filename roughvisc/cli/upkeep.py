"""Commands on a folder of results: ``verify`` and ``clean``."""

from __future__ import annotations

from pathlib import Path

import click

from roughvisc.cli.group import Failure, complain, counted
from roughvisc.errors import printable


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
def verify(results: Path) -> None:
    """Check results for damage.

    Compares every file with its checksum and changes nothing. The exit status is 1 if a file is damaged. Run the study
    again to replace damaged results. Files that another program has changed have no checksum; they are listed, and
    cannot be checked.

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
    whole = f"{len(found) - len(bad)} of {counted(len(found), 'file')} intact"
    click.echo(whole + (f", {len(bare)} of them without a checksum" if bare else ""))
    if bad:
        raise Failure(f"{counted(len(bad), 'damaged file')}: run the study again to replace the results", 1)


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--all", "everything", is_flag=True, help="Also remove checkpoints, damaged results and failure records.")
@click.option("--superseded", is_flag=True, help="Also remove results that this version has computed again.")
def clean(results: Path, everything: bool, superseded: bool) -> None:
    """Remove leftovers of interrupted runs and earlier versions.

    Removes incomplete files, locks of dead runs, and checkpoints that no run can use: of finished cases, or of earlier
    versions. Keeps results, and checkpoints of unfinished cases unless --all is given. Lists results of other versions;
    --superseded removes those that this version has computed again. Cases in use by a run are not touched.

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
