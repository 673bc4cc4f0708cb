"""``python -m roughvisc``: the command line."""

from roughvisc.cli import main

main()
