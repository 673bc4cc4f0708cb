"""The command line of roughvisc.

Commands: ``scan | new | plan | run | trade | budget | plot | report | audit | verify | clean``.

Exit status: 0 all done, 1 a case failed, did not converge or is held by another run, 2 the input is wrong, 130
interrupted, 143 terminated. Heavy imports are made inside the commands, so that ``--help`` is quick.
"""

from roughvisc.cli.interrupts import ending_at_once

with ending_at_once():
    from roughvisc.cli.costs import budget, plan, trade
    from roughvisc.cli.group import main
    from roughvisc.cli.results import audit, clean, plot, report, verify
    from roughvisc.cli.scans import new, scan
    from roughvisc.cli.studies import run

__all__ = ["main"]

for _command in (run, plan, trade, budget, scan, new, plot, report, audit, verify, clean):
    main.add_command(_command)
