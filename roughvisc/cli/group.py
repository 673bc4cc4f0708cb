"""The group of commands, what they put out, and how they fail: one message and an exit status."""

from __future__ import annotations

import errno
import io
import logging
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from roughvisc.cli.interrupts import INTERRUPTED, Terminated, ending_at_once, terminable
from roughvisc.cli.reading import naming_keys, naming_options
from roughvisc.errors import ON_SCREEN, InputError, RoughviscError, printable, shortened

if TYPE_CHECKING:
    from rich.console import Console

#: Type of an argument or option that names a file or a folder.
PATH = click.Path(path_type=Path)
#: Commands that take options for what a scan file does not state; the others take a study, which has keys for it.
_READING = ("scan", "new")


#: Where the context of a command says which folder its results are in.
_RESULTS = "roughvisc.results"


class Failure(click.ClickException):
    """One message on the standard error stream, and an exit status."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.exit_code = status
        self._results = _results_folder()  # the context is gone when it is shown

    def show(self, file: Any = None) -> None:
        _complain(self.message, self._results)


def complain(message: str) -> None:
    """One message on the standard error stream; all of a long one is in the log of the results, if there is one."""
    _complain(message, _results_folder())


def _complain(message: str, results: Path | None) -> None:
    text = f"roughvisc: {printable(message)}"
    log = None
    if len(text) > ON_SCREEN and results is not None:
        from roughvisc.study.storage.failures import append

        log = append(results, message)
    click.echo(shortened(text, ON_SCREEN, str(log or "")), err=True)


def complain_of_all(messages: Sequence[str], log: Path) -> None:
    """Several messages that a log has whole; together they are not longer than one may be."""
    text = "\n".join(f"roughvisc: {' '.join(printable(one).split())}" for one in messages)
    if text:
        click.echo(shortened(text, ON_SCREEN, str(log) if log.exists() else ""), err=True)


def keep_long_messages(results: Path) -> None:
    """Have what is too long for the screen written to the log of a folder of results, where that is there."""
    click.get_current_context().meta[_RESULTS] = results


def _results_folder() -> Path | None:
    context = click.get_current_context(silent=True)
    return context.meta.get(_RESULTS) if context else None


def counted(count: int, what: str) -> str:
    """A count of things, in words."""
    return f"{count} {what}" + ("" if count == 1 else "s")


def say(console: Console, what: str, path: Path, *, before: str = "") -> None:
    """A path, or a command on one, on one line of its own, so that it can be copied or cut out by a program."""
    shown = os.path.relpath(path)
    line = printable(f"{what}: {before}{path if shown.startswith('..') else shown}")
    console.print(line, soft_wrap=True, highlight=False, markup=False)


def say_figures(console: Console, written: Sequence[Path]) -> None:
    """How many figures were written and the folder that they are in; the file itself of a single one."""
    what, path = ("Figure", written[0]) if len(written) == 1 else (f"{len(written)} figures", written[0].parent)
    say(console, what, path)


class _Screen(logging.Handler):
    """Warnings of roughvisc that no log takes, each once."""

    def __init__(self, otherwise: logging.Handler | None) -> None:
        super().__init__(logging.WARNING)
        self._otherwise = otherwise
        self._said: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if record.name != "roughvisc":
            if self._otherwise is not None:
                self._otherwise.handle(record)
        elif message not in self._said:
            self._said.add(message)
            complain(naming_keys(message))


@contextmanager
def warnings_on_screen() -> Iterator[None]:
    """Have warnings that are logged look like all other messages, where nobody has set up logging."""
    before = logging.lastResort
    logging.lastResort = _Screen(before)
    try:
        yield
    finally:
        logging.lastResort = before


class Commands(click.Group):
    """Errors made on purpose end in one message and an exit status, never in a traceback."""

    def main(self, *arguments: Any, **settings: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):  # letters that its encoding lacks are spelt out
                stream.reconfigure(errors="backslashreplace")
        with ending_at_once():
            return super().main(*arguments, **settings)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with terminable(), warnings_on_screen():
                return super().invoke(ctx)
        except InputError as error:
            named = naming_options if ctx.invoked_subcommand in _READING else naming_keys
            raise Failure(named(str(error)), 2) from error
        except RoughviscError as error:
            raise Failure(naming_keys(str(error)), 1) from error
        except OSError as error:  # a full disk, a file taken away
            if error.errno == errno.EPIPE:  # whoever read the output has seen enough: click ends quietly
                raise
            place = f"{error.filename}: " if error.filename else ""
            raise Failure(f"{place}{error.strerror or error}", 1) from error
        except MemoryError as error:
            raise Failure("not enough memory: run `roughvisc plan STUDY` to see how much the study needs", 1) from error
        except RecursionError as error:
            raise Failure("the input is nested too deeply: expected a few levels of tables", 2) from error
        except OverflowError as error:
            raise Failure(f"a number in the input is too large ({error}): expected one below 1e308", 2) from error
        except RuntimeError as error:
            if not str(error).startswith("NetCDF: "):
                raise
            advice = "a file is damaged; run `roughvisc verify FOLDER` to find it"
            raise Failure(f"a result cannot be read ({error}): {advice}", 1) from error
        except KeyboardInterrupt as error:
            status = 143 if isinstance(error, Terminated) else 130
            raise Failure(INTERRUPTED, status) from error


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="roughvisc", message="roughvisc %(version)s")
def main() -> None:
    """Contact of measured rough surfaces with viscoelastic materials.

    Reads a scan and a study file. Writes NetCDF results over (time, x, y) and figures.

    \b
    Example:
      roughvisc new
      roughvisc scan focus_variation.x3p
      roughvisc run focus_variation-study.toml
      roughvisc report results/focus_variation-study
    """
