"""The command on this machine: ``validate``."""

from __future__ import annotations

import click

from roughvisc.cli.group import Failure


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
