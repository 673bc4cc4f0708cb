"""What came of opening one mutant, and how that is judged."""

import logging
import warnings
from dataclasses import dataclass, field

from damage import Hang, within

from roughvisc.errors import RoughviscError

#: Seconds that an opening may take, and signs that a refusal may have.
PATIENCE, LONGEST = 20.0, 4000
#: How it may end. A fault is told whatever else there is to tell.
ENDS = ("same", "other", "refused", "fault")


@dataclass
class Outcome:
    """One mutant: what was changed, how opening it ended, and in what its values differ from those of the original."""

    number: int
    subject: str
    change: str
    end: str = "same"
    differs: list[str] = field(default_factory=list)
    message: str = ""
    warned: list[str] = field(default_factory=list)
    fault: str = ""

    def failed(self, fault):
        """The same, as a fault; of several the first is told."""
        self.end, self.fault = "fault", self.fault or fault
        return self


class _Heard(logging.Handler):
    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


def opened(outcome, read, path, names_place):
    """What is read; None, with the outcome settled, if it is refused or anything else happens.

    ``names_place(message)`` says whether a refusal names the place in the file, or what is missing in it.
    """
    heard, log = _Heard(), logging.getLogger("roughvisc")
    log.addHandler(heard)
    before, log.propagate = log.propagate, False
    try:
        with within(PATIENCE), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = read()
    except RoughviscError as error:
        outcome.end, outcome.message = "refused", str(error)
        if path.name not in outcome.message:
            outcome.failed(f"a refusal that does not name the file: {outcome.message}")
        elif not names_place(outcome.message):
            outcome.failed(f"a refusal that does not name the place: {outcome.message}")
        elif len(outcome.message) > LONGEST:
            outcome.failed(f"a message of {len(outcome.message)} signs: {outcome.message[:200]}")
        return None
    except Hang as error:
        outcome.failed(f"a hang: {error}")
        return None
    except BaseException as error:  # noqa: BLE001  (whatever it is, it is a traceback to whoever opens the file)
        outcome.failed(f"a traceback: {type(error).__name__}: {error}")
        return None
    finally:
        log.removeHandler(heard)
        log.propagate = before
    outcome.warned = heard.lines + [str(one.message) for one in caught if issubclass(one.category, UserWarning)]
    odd = [one for one in caught if issubclass(one.category, RuntimeWarning)]
    if odd:
        outcome.failed(f"a warning of arithmetic: {odd[0].message} ({odd[0].filename}:{odd[0].lineno})")
    return found


def compared(outcome, differs, unsaid=()):
    """The outcome once values were served: what differs from the original's, and what the mutant does not say."""
    outcome.differs = list(differs)
    if outcome.end != "fault":
        outcome.end = "other" if outcome.differs else "same"
    if unsaid:
        outcome.failed("a wrong value served: " + "; ".join(unsaid))
    return outcome


def text_change(before, after):
    """Lines that differ between two texts, in short."""
    import difflib

    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), "", "", n=0, lineterm="")
    told = " ".join(repr(line)[1:-1] for line in list(lines)[2:] if not line.startswith("@@"))
    return told if len(told) < 400 else told[:397] + "..."


def byte_change(before, after):
    """Where two contents differ first and last, counted from either end."""
    if before == after:
        return "nothing"
    shorter = min(len(before), len(after))
    first = next((i for i in range(shorter) if before[i] != after[i]), shorter)
    last = next((i for i in range(1, shorter - first + 1) if before[-i] != after[-i]), shorter - first + 1) - 1
    one, other = before[first : len(before) - last], after[first : len(after) - last]
    return f"byte {first}: {len(one)} bytes {one[:12].hex()} became {len(other)}: {other[:12].hex()}"
