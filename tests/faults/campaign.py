"""Opens thousands of changed studies, tables, scans and results, and kills runs: what comes of each, and every fault.

    python tests/faults/campaign.py --seed 1 --report report.txt

A mutant is drawn from the seed, its kind and its number, whatever else is run: ``--only tables:113`` shows one again.
Each kind is opened in processes of their own, whose addresses are limited, so that a library of C that crashes, hangs
or asks for the whole memory ends one of them and counts as a fault of one mutant. A fault is

- any exception that is not a RoughviscError, a warning of arithmetic, the death of the process;
- an opening that takes more than 20 s;
- a refusal that does not name the file, and of a study the key or the line, of a table the line, the column or what is
  missing; or one of more than 4000 signs;
- a value that the mutant does not say, by a parse that shares nothing with the package; of formats with a checksum any
  value but the original's, unless a word is said; of a killed run any bit.

Mutants that open with other values than the original are no faults as long as they say them: the report lists each.
Exit status 1 if there is a fault.
"""

import argparse
import dataclasses
import importlib
import json
import resource
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import numpy as np  # noqa: E402
from outcome import ENDS, PATIENCE, Outcome  # noqa: E402

#: Kind -> the file that makes and judges its mutants, how many by default, and how many a process takes.
KINDS = {
    "studies": ("mutant_studies", 2000, 250),
    "tables": ("mutant_tables", 500, 250),
    "scans": ("mutant_scans", 300, 60),
    "results": ("mutant_results", 300, 60),
    "kills": ("killed_runs", 100, 20),
}
#: Addresses that a process may have, but for runs that start others. [bytes]
_ADDRESSES = 6 << 30
#: Seconds without a word after which a process hangs where no Python runs, and those that a killed run may take.
_SILENCE = {"kills": 400.0}


def examined(kind, seed, numbers, folder, *more):
    """Outcome of each of some mutants, in this process."""
    maker = importlib.import_module(KINDS[kind][0])
    originals = maker.prepare(Path(folder), *more)
    for number in numbers:
        yield maker.examine(
            originals, Path(folder), number, np.random.default_rng([seed, list(KINDS).index(kind), number])
        )


def in_processes(kind, seed, count, command, at_once, silence=2 * PATIENCE):
    """Outcomes of so many mutants, by processes that each take some; ``command(first, last)`` starts one.

    A process writes the number of a mutant before it opens it, and its outcome after: a process that ends between the
    two, or is silent for too long, is the mutant's fault.
    """
    first = 0
    while first < count:
        process = subprocess.Popen(
            command(first, min(first + at_once, count)), stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        begun = None
        for line in _lines(process, silence):
            if line is None:
                process.kill()
                break
            said = json.loads(line)
            if "begun" in said:
                begun = said["begun"]
            else:
                yield Outcome(**said)
                first, begun = said["number"] + 1, None
        _, complaint = process.communicate()
        if begun is None and process.returncode == 0:
            continue
        if begun is None:  # it does not come as far as a mutant
            raise SystemExit(f"{kind}: the process ended by {process.returncode}: {complaint.decode()[-2000:]}")
        how = (
            "a hang in a library"
            if line is None
            else f"the process ended by {process.returncode}: {complaint.decode()[-500:]}"
        )
        yield Outcome(begun, "", "").failed(how)
        first = begun + 1


def _lines(process, silence):
    """Lines that a process writes, and None once it has been silent for too long."""
    rest = b""
    while True:
        ready, _, _ = select.select([process.stdout], [], [], silence)
        if not ready:
            yield None
            return
        part = process.stdout.read1(1 << 16)
        if not part:
            return
        *lines, rest = (rest + part).split(b"\n")
        yield from lines


def _work(kind, seed, first, last, real):
    """A process of its own: mutants from one number to another, each told of before and after."""
    if kind != "kills":
        resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, resource.getrlimit(resource.RLIMIT_AS)[1]))
    said, sys.stdout = sys.stdout, sys.stderr
    numbers = range(first, last)

    def announced():
        for number in numbers:
            print(json.dumps({"begun": number}), file=said, flush=True)
            yield number

    with tempfile.TemporaryDirectory() as folder:
        for outcome in examined(kind, seed, announced(), folder, *([real] if kind == "scans" and real else [])):
            print(json.dumps(dataclasses.asdict(outcome)).replace(folder, "FOLDER"), file=said, flush=True)


def listed(kind, outcome):
    """One line of the report."""
    told = [f"{kind} {outcome.number} ({outcome.subject}): {outcome.change}"]
    told += [f"differs: {'; '.join(outcome.differs)}"] if outcome.differs else []
    told += [f"said: {'; '.join(outcome.warned)}"] if outcome.warned else []
    told += [f"FAULT: {outcome.fault}"] if outcome.fault else []
    return " | ".join(told).replace("\n", " / ")


def table(counts):
    """How the mutants of each kind ended, as a table in Markdown."""
    head = ["kind", "mutants", "same values", "other values", "refused", "faults"]
    rows = [[kind, sum(found.values()), *(found[end] for end in ENDS)] for kind, found in counts.items()]
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in [head, ["---"] * len(head), *rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    for kind, (_, count, _) in KINDS.items():
        parser.add_argument(f"--{kind}", type=int, default=count, metavar="N", help=f"how many; by default {count}")
    parser.add_argument("--real", metavar="FOLDER", help="of scans of real instruments")
    parser.add_argument("--report", metavar="FILE", help="where mutants with other values, and faults, are listed")
    parser.add_argument("--only", metavar="KIND:NUMBER", help="one mutant, in this process")
    parser.add_argument("--worker", nargs=3, metavar=("KIND", "FIRST", "LAST"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.worker:
        kind, first, last = given.worker
        _work(kind, given.seed, int(first), int(last), given.real)
        return
    if given.only:
        kind, _, number = given.only.partition(":")
        with tempfile.TemporaryDirectory() as folder:
            more = [given.real] if kind == "scans" and given.real else []
            for outcome in examined(kind, given.seed, [int(number)], folder, *more):
                print(json.dumps(dataclasses.asdict(outcome), indent=1, ensure_ascii=False))
        return
    counts, lines, began = {}, [], time.monotonic()
    for kind, (_, _, at_once) in KINDS.items():
        count = getattr(given, kind)
        if not count:
            continue

        def command(first, last, kind=kind):
            real = ["--real", given.real] if given.real else []
            return [sys.executable, __file__, "--seed", str(given.seed), *real, "--worker", kind, str(first), str(last)]

        counts[kind] = Counter()
        for outcome in in_processes(kind, given.seed, count, command, at_once, _SILENCE.get(kind, 2 * PATIENCE)):
            counts[kind][outcome.end] += 1
            if outcome.end in ("other", "fault"):
                lines.append(listed(kind, outcome))
            if outcome.end == "fault":
                print(lines[-1], flush=True)
            done = sum(counts[kind].values())
            if done % at_once == 0 or done == count:
                print(f"{kind}: {done} of {count}, {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    if given.report:
        Path(given.report).write_text("\n".join([f"seed {given.seed}", *lines]) + "\n", encoding="utf-8")
    print(table(counts))
    sys.exit(any(found["fault"] for found in counts.values()))


if __name__ == "__main__":
    main()
