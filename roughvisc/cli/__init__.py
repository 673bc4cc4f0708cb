"""The command line of roughvisc.

Commands: ``new | scan | plan | run | view | plot | report | table | audit | trade | budget | verify | clean``.

Exit status: 0 all done, 1 a case failed, did not converge or is in use by another run, 2 the input is wrong, 130
interrupted, 143 terminated. Heavy imports are inside the commands, so that ``--help`` is quick.
"""

from roughvisc.cli.group import main
from roughvisc.cli.results import audit, clean, plot, report, table, verify, view
from roughvisc.cli.scans import new, scan
from roughvisc.cli.studies import budget, plan, run, trade

__all__ = ["main"]

for _command in (new, scan, plan, run, view, plot, report, table, audit, trade, budget, verify, clean):
    main.add_command(_command)
