"""The group of commands, what they put out, and how they fail: one message and an exit status."""

from __future__ import annotations

import errno
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.reading import naming_keys, naming_options
from roughvisc.errors import InputError, RoughviscError, printable

if TYPE_CHECKING:
    from rich.console import Console

#: Commands that take options for what a scan file does not state; the others take a study, which has keys for it.
_READING = ("scan", "new")


class Failure(click.ClickException):
    """One message on the standard error stream, and an exit status."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.exit_code = status

    def show(self, file: Any = None) -> None:
        complain(self.message)


def complain(message: str) -> None:
    """One message on the standard error stream."""
    click.echo(f"roughvisc: {printable(message)}", err=True)


def counted(count: int, what: str) -> str:
    """A count of things, in words."""
    return f"{count} {what}" + ("" if count == 1 else "s")


def say(console: Console, what: str, path: Path) -> None:
    """A path on one line of its own, whole, so that it can be copied or cut out by a program."""
    shown = os.path.relpath(path)
    line = printable(f"{what}: {path if shown.startswith('..') else shown}")
    console.print(line, soft_wrap=True, highlight=False, markup=False)


class Terminated(KeyboardInterrupt):
    """SIGTERM, which batch systems send some time before they kill."""


@contextmanager
def terminable() -> Iterator[None]:
    """Have SIGTERM end what is inside as Ctrl-C does, so that a running case writes its checkpoint first."""

    def end(*_: Any) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once is enough: the checkpoint is being written
        raise Terminated

    mine = threading.current_thread() is threading.main_thread()
    if not mine or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:  # somebody else takes care of it
        yield
        return
    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


class Commands(click.Group):
    """Errors made on purpose end in one message and an exit status, never in a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with terminable():
                return super().invoke(ctx)
        except InputError as error:
            named = naming_options if ctx.invoked_subcommand in _READING else naming_keys
            raise Failure(named(str(error)), 2) from error
        except RoughviscError as error:
            raise Failure(str(error), 1) from error
        except OSError as error:  # a full disk, a file taken away
            if error.errno == errno.EPIPE:  # whoever read the output has seen enough: click ends quietly
                raise
            raise Failure(f"{error.filename or 'input or output'}: {error.strerror or error}", 1) from error
        except MemoryError as error:
            raise Failure("not enough memory: roughvisc plan says how much a study needs", 1) from error
        except RecursionError as error:
            raise Failure("the input is nested too deeply: expected tables of a few levels", 2) from error
        except OverflowError as error:
            raise Failure(
                f"a number of the input is too large ({error}): expected one that a double can hold", 2
            ) from error
        except RuntimeError as error:
            if not str(error).startswith("NetCDF: "):
                raise
            advice = "a file is damaged, and roughvisc verify says which"
            raise Failure(f"a result cannot be read ({error}): {advice}", 1) from error
        except ImportError as error:  # as libraries of C tell it that are interrupted while they are loaded
            if not isinstance(error.__cause__, KeyboardInterrupt):
                raise
            raise _interrupted(error.__cause__) from error
        except KeyboardInterrupt as error:
            raise _interrupted(error) from error


def _interrupted(by: KeyboardInterrupt) -> Failure:
    return Failure("interrupted; what was finished is kept", 143 if isinstance(by, Terminated) else 130)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="roughvisc", message="roughvisc %(version)s")
def main() -> None:
    """Contact of measured rough surfaces with viscoelastic materials.

    A scan and a study file in; labelled (time, x, y) NetCDF results and figures out.

    \b
    Example:
      roughvisc new
      roughvisc scan ground_steel.x3p
      roughvisc run ground_steel-study.toml
      roughvisc report results/ground_steel-study
    """
