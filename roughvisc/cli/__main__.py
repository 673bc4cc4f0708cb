"""``python -m roughvisc.cli``: the command line."""

from roughvisc.cli import main

if __name__ == "__main__":
    main()
