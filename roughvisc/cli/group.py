"""The group of commands, their output, and their failures: one message and an exit status."""

from __future__ import annotations

import errno
import io
import logging
import os
import shutil
import signal
import sys
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.errors import InputError, RoughviscError, printable
from roughvisc.paths import path_of

if TYPE_CHECKING:
    from rich.console import Console


class _Path(click.Path):
    """Type of an argument or option that names a file or a folder; empty text is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        return path_of(value, param.get_error_hint(ctx).replace("'", "") if param and ctx else "path")


PATH = _Path()
WORKERS = click.option(
    "--workers", type=click.IntRange(1), help="Number of parallel processes. [default: one per core]"
)
QUIET = click.option("-q", "--quiet", is_flag=True, help="Print errors only.")


def quantity(name: str, metavar: str, meaning: str, **settings: Any) -> Any:
    """Return an option whose value is text with a unit, which the functions of the package check."""
    return click.option(name, metavar=metavar, help=meaning, **settings)


class Failure(click.ClickException):
    """Failure with one message on the standard error stream, and an exit status."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        vars(self)["exit_code"] = status  # click declares it for the class

    def show(self, file: Any = None) -> None:
        complain(self.message)


def complain(message: str) -> None:
    """Write one message to the standard error stream."""
    text = f"roughvisc: {printable(message)}"
    if sys.stderr.isatty():
        width = max(20, shutil.get_terminal_size().columns)
        fill = textwrap.TextWrapper(width, break_long_words=False, break_on_hyphens=False)
        text = "\n".join(fill.fill(line) for line in text.split("\n"))
    click.echo(text, err=True)


def screen(quiet: bool = False) -> Console:
    """Return the console: the terminal, or the file to which output is redirected."""
    from rich.console import Console  # slow to import

    return Console(quiet=quiet)


def counted(count: int, what: str) -> str:
    """Return a count of things in words."""
    return f"{count} {what}" + ("" if count == 1 else "s")


def say(console: Console, line: str) -> None:
    """Write one line, unwrapped, so that it can be copied or cut out by a program."""
    console.print(printable(line), soft_wrap=True, highlight=False, markup=False)


def say_path(console: Console, what: str, path: Path) -> None:
    """Write a line with a path, relative to this folder if it is below it."""
    relative = os.path.relpath(path)
    say(console, f"{what}: {path if relative.startswith('..') else relative}")


def say_figures(console: Console, written: Sequence[Path]) -> None:
    """Write the path of a figure, or the number of figures and their folder."""
    what, path = ("Figure", written[0]) if len(written) == 1 else (f"{len(written)} figures", written[0].parent)
    say_path(console, what, path)


class _Screen(logging.Handler):
    """Handler that shows each warning of roughvisc once."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._written: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if record.name == "roughvisc" and message not in self._written:
            self._written.add(message)
            complain(message)


class Terminated(KeyboardInterrupt):
    """SIGTERM, which batch systems send some time before they kill a process."""


def _terminate(number: int, _: Any) -> None:
    signal.signal(number, signal.SIG_IGN)  # another signal would interrupt the writing of the checkpoint
    raise Terminated


@contextmanager
def _settings_of_process() -> Iterator[None]:
    """Show warnings as messages and treat SIGTERM as an interrupt."""
    usual = logging.lastResort, warnings.showwarning, signal.signal(signal.SIGTERM, _terminate)
    logging.lastResort = _Screen()
    warnings.showwarning = lambda warning, *_: complain(f"warning: {warning}")
    try:
        yield
    finally:
        logging.lastResort, warnings.showwarning, on_term = usual
        signal.signal(signal.SIGTERM, on_term)


def _failure(error: BaseException) -> tuple[str, int] | None:
    """Return the message and the exit status of a known error of a command; None for any other error."""
    match error:
        case RoughviscError():
            return str(error), 2 if isinstance(error, InputError) else 1
        case OSError() if error.errno != errno.EPIPE:  # the reader of the output has closed it: click ends quietly
            place = f"{error.filename}: " if error.filename else ""
            return f"{place}{error.strerror or error}", 1
        case UnicodeEncodeError():
            return f"the locale of this process lacks letters of a file name ({error}): set LC_ALL=C.UTF-8", 2
        case MemoryError():
            return "not enough memory: run `roughvisc plan STUDY` to see how much the study needs", 1
        case RecursionError():
            return "the input is nested too deeply: expected a few levels of tables", 2
        case OverflowError():
            return f"a number in the input is too large ({error}): expected one below 1e308", 2
        case RuntimeError() if str(error).startswith("NetCDF: "):
            return f"a result cannot be read ({error}): run `roughvisc verify FOLDER` to find a damaged file", 1
        case KeyboardInterrupt():
            text = "interrupted; finished work is kept; repeat the command to resume"
            return text, 143 if isinstance(error, Terminated) else 130
    return None


class Commands(click.Group):
    """Commands that print one message for a known error and return an exit status, without a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # in the order of their use

    def main(self, *arguments: Any, **settings: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):  # characters that its encoding lacks are escaped
                stream.reconfigure(errors="backslashreplace")
        return super().main(*arguments, **settings)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with _settings_of_process():
                return super().invoke(ctx)
        except BaseException as error:
            if known := _failure(error):
                raise Failure(*known) from error
            raise


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="roughvisc", message="roughvisc %(version)s")
def main() -> None:
    """\b
    Contact of measured rough surfaces with viscoelastic materials. First result:
      roughvisc new
      roughvisc run focus_variation-study.toml
    """
