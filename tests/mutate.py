"""Do the tests of the numerics notice a fault? Faults are made one at a time, and the tests of the room must fail.

    pip install -e ".[test,mutation]"
    python tests/mutate.py ROOM [--sample N] [--seed S] [--first LINE --last LINE]

ROOM is one of those below, or all. Of all viable mutants of its files (cosmic-ray's operators) a random sample of 60 is
made unless given; :func:`changes_nothing` says which are not viable. Printed are the score and the survivors. The tests
must pass without a mutant first. It changes the files that it mutates, one after the other, and restores them: run it
in a checkout of its own.
"""

import argparse
import ast
import difflib
import importlib
import json
import math
import operator
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import pytest

ROOT = pathlib.Path(__file__).parents[1]
#: room -> its files, and the tests that are to notice a fault in them
ROOMS = {
    "contact": (("mechanics/contact",), ("mechanics/contact", "mechanics/test_contact.py")),
    "stepping": (
        tuple(f"mechanics/stepping/{name}.py" for name in (
            "companion", "controller", "energy", "march", "scene", "state", "step",
        )),
        ("mechanics/stepping", "study/storage/test_checkpoint.py", "test_convergence.py"),
    ),
    "hereditary": (("mechanics/hereditary",), ("mechanics/hereditary", "mechanics/stepping/test_march.py")),
    "operator": (("mechanics/bodies",), ("mechanics/bodies",)),
    "rows": (
        ("experiment/loading.py", "experiment/stated.py"),
        tuple(f"experiment/test_{name}.py" for name in ("kept_rows", "rows", "perimeter", "simulate")),
    ),
    "grid_error": (
        ("experiment/grid_error.py",),
        ("experiment/test_grid_error.py",),
    ),
    "checkpoint": (("study/storage/checkpoint.py",), ("study/storage/test_checkpoint.py",)),
    "estimate": (("study/cost/estimate.py",), ("study/cost/test_plan.py", "study/cost/test_growth.py")),
    "press": (("study/cost/press.py", "study/cost/first_pressure.py"), ("study/cost/test_press.py",)),
    "stages": (("study/cost/estimate.py",), ("study/cost/test_growth.py",)),
    "conditioning": (
        tuple(f"topography/{name}.py" for name in ("bandwidth", "framing", "missing_points")),
        ("topography/test_conditioning.py",),
    ),
}  # fmt: skip
#: A test that takes longer is left out: what a quick one does not notice counts as not noticed. [s]
LONGEST = 3.0
#: Not even timed: the test of the allocator.
LEFT_OUT = "not freed_memory"
#: A mutant hangs whose tests take so many times as long as those of the code as it is, and these seconds more.
LONGER, LEAST = 3.0, 20.0
#: Libraries that are imported once for all mutants.
LIBRARIES = {
    "numpy", "scipy", "xarray", "pandas", "netCDF4", "dask", "distributed", "matplotlib", "jinja2", "click", "rich",
    "pydantic", "pint", "tomlkit", "SurfaceTopography", "ducc0", "mpmath",
}  # fmt: skip

#: Constants that decide how long it takes and not what is found: with the value beside it, measured or round, the
#: answer is the same to the tolerance.
TUNING = {
    "_FARTHEST": "contact: longest step along a direction without curvature",
    "_PATIENCE": "contact: iterations before a safeguarding step",
    "_SHRINKAGE": "contact: step length from one iteration to the next",
    "_GROWTH": "contact: step length from one iteration to the next",
    "_GROWTH_IF_CUT": "contact: step length from one iteration to the next",
    "_SINGLE_FROM": "contact: cells from which single precision pays",
    "_FAR": "contact: distance from which single precision pays",
    "_COARSE_FROM": "contact: cells from which a guess on a coarse grid pays",
    "_COARSE_TOLERANCE": "contact: tolerance of that guess",
    "_MOST_TWICE": "hereditary: exponentials up to which two forms are kept, rather than one convolved",
    "_BLOCK": "hereditary, window: what is summed or transformed together",
    "_COLUMN_BYTES": "operator: what is transformed together",
    "_COLUMNS": "operator: what is transformed together",
    "_ROWS": "operator, contact: what is transformed, averaged or spread together",
    "_ROW_POINTS": "operator: what is transformed together",
    "_SHORT": "operator: what is transformed together",
    "_LINE": "operator: where rows begin",
    "_THREADED": "arrays: cells from which threads pay",
    "_SMALLEST": "operator: smallest window",
    "_LARGEST": "operator: part of the domain from which a window does not pay",
    "_CALIBRATION": "estimate: seconds for timing solves",
}
#: What is zero or positive: beside zero, ``==`` is ``<=`` and ``>`` is ``!=``.
NEVER_NEGATIVE = {
    "pressure", "source_pressure", "held", "taken", "load", "force", "largest_force", "largest_approach", "step",
    "duration", "count", "mean",
}  # fmt: skip
SAME_BESIDE_ZERO = {("Eq", "LtE"), ("LtE", "Eq"), ("Gt", "NotEq"), ("NotEq", "Gt")}
#: Whether the border belongs to it is no question of a constant that tunes.
SAME_BESIDE_TUNING = {("Gt", "GtE"), ("GtE", "Gt"), ("Lt", "LtE"), ("LtE", "Lt")}
COMPARISONS = {
    "Eq": operator.eq, "NotEq": operator.ne,
    "Lt": operator.lt, "LtE": operator.le, "Gt": operator.gt, "GtE": operator.ge,
}  # fmt: skip
#: All words that these may be: a comparison with one of them is another if it tells the same words apart.
WORDS = {
    "rule": ("linear", "bdf2", "euler", "right"),
    "acts_on": ("displacement", "pressure", "both"),
    "kind": ("auto", "direct"),
    "control": ("load", "approach"),
    "boundary": ("free", "periodic"),
    "name": ("pressure", "gap", "displacement"),
}


def files_of(room):
    found = [ROOT / "roughvisc" / name for name in ROOMS[room][0]]
    found = [path if path.exists() else path.with_suffix(".py") for path in found]
    return [file for path in found for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


def changes_nothing(path):
    """Spans of lines and columns in which no mutant changes what is computed.

    Annotations and protocols; what an error says; assertions, and ``strict`` of a zip, which guard against errors of
    the programmer; arguments of decorators (frozen classes) and the size of caches; -1 in a reshape, which stands for
    any negative number; the constants of :data:`TUNING`. Comparisons are judged by :func:`alike`,
    what looks like an operator by :func:`operators`.
    """
    spans = []
    for node in ast.walk(ast.parse(path.read_text())):
        parts = []
        if isinstance(node, ast.FunctionDef):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            parts = [node.returns, *(argument.annotation for argument in arguments)]
        elif isinstance(node, ast.ClassDef) and any(getattr(b, "id", "") == "Protocol" for b in node.bases):
            parts = [*node.body, *(line for part in node.body for line in getattr(part, "decorator_list", ()))]
        elif isinstance(node, ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert):
            parts = [node]
        elif isinstance(node, ast.Call):
            parts = [keyword for keyword in node.keywords if keyword.arg in ("strict", "maxsize")]
            if getattr(node.func, "attr", "") == "reshape":
                parts += [argument for argument in node.args if isinstance(argument, ast.UnaryOp)]
        elif isinstance(node, ast.Assign):
            parts = _tuning(node.targets[0], node.value)
        for decorator in getattr(node, "decorator_list", ()):
            parts += [*decorator.args, *decorator.keywords] if isinstance(decorator, ast.Call) else []
        spans += [_span(part) for part in parts if part is not None]
    return spans


def _tuning(target, value):
    """The values of an assignment that only tune."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
        return [part for pair in zip(target.elts, value.elts, strict=True) for part in _tuning(*pair)]
    return [value] if getattr(target, "id", "") in TUNING else []


def alike(path):
    """Spans of the signs of comparisons, and the changes of each that are none: pairs of names of operators."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Compare) or len(node.ops) > 1:
            continue
        name, [right] = _name(node.left), node.comparators
        same = set()
        if isinstance(right, ast.Constant) and right.value == 0 and name in NEVER_NEGATIVE:
            same = SAME_BESIDE_ZERO
        elif isinstance(right, ast.Name) and right.id in TUNING:
            same = SAME_BESIDE_TUNING
        elif isinstance(right, ast.Constant) and isinstance(right.value, str) and name in WORDS:
            told = {sign: [compare(word, right.value) for word in WORDS[name]] for sign, compare in COMPARISONS.items()}
            same = {(one, other) for one in told for other in told if told[one] == told[other]}
        found.append(((*_span(node.left)[2:], *_span(right)[:2]), same))
    return found


def operators(path):
    """Spans of the operators between two operands; stars of arguments and of sequences, which look alike, are none."""
    pairs = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.BinOp):
            pairs.append((node.left, node.right))
        elif isinstance(node, ast.AugAssign):
            pairs.append((node.target, node.value))
    return [(*_span(left)[2:], *_span(right)[:2]) for left, right in pairs]


def _name(node):
    """What is compared: the last name in ``a.name``, ``a["name"]`` or ``name[i]``."""
    while isinstance(node, ast.Subscript) and not isinstance(node.slice, ast.Constant):
        node = node.value
    return node.slice.value if isinstance(node, ast.Subscript) else getattr(node, "attr", getattr(node, "id", ""))


def _span(node):
    return node.lineno, node.col_offset, node.end_lineno, node.end_col_offset


def is_viable(mutation, spans, comparisons, signs):
    """Whether a mutant may change what is computed."""
    where = mutation.start_pos

    def lies_in(span):
        return span[:2] <= where <= span[2:]

    if any(lies_in(span) for span in spans):
        return False
    if "BinaryOperator" in mutation.operator_name:
        return any(lies_in(span) for span in signs)
    changed = tuple(mutation.operator_name.split("_")[1:])
    return not any(lies_in(span) and changed in same for span, same in comparisons)


class QuickestFirst:
    """Plugin of pytest: the first run says how long each test takes, and what it imports; later ones go by that."""

    def __init__(self, known):
        self.known = known

    def pytest_collection_modifyitems(self, items):
        if self.known.exists():
            durations = json.loads(self.known.read_text())["durations"]
            items[:] = [item for item in items if durations.get(item.nodeid, 0.0) <= LONGEST]
            items.sort(key=lambda item: durations.get(item.nodeid, 0.0))

    def pytest_terminal_summary(self, terminalreporter):
        if not self.known.exists():
            durations = {passed.nodeid: passed.duration for passed in terminalreporter.stats["passed"]}
            self.known.write_text(json.dumps({"durations": durations, "modules": list(sys.modules)}))


def noticed_by(tests, known, timeout=math.inf):
    """Whether the tests fail, or hang, in a fork of this process, which has the libraries already."""
    child = os.fork()
    if child == 0:
        os.setsid()
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        arguments = ["-q", "-x", "-p", "no:cacheprovider", "-m", "not long", "-k", LEFT_OUT, *tests]
        os._exit(int(pytest.main(arguments, plugins=[QuickestFirst(known)])) != 0)
    ends = time.monotonic() + timeout
    while time.monotonic() < ends:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status != 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return True


def mutants_of(room):
    """All mutants that cosmic-ray knows of the files of a room, and the viable ones in a fixed order."""
    from cosmic_ray.work_db import WorkDB, use_db

    with tempfile.TemporaryDirectory() as folder:
        config, session = pathlib.Path(folder) / "config.toml", pathlib.Path(folder) / "session.sqlite"
        modules = [str(path.relative_to(ROOT)) for path in files_of(room)]
        config.write_text(
            f'[cosmic-ray]\nmodule-path = {modules}\ntimeout = 1.0\nexcluded-modules = []\ntest-command = ""\n'
            '[cosmic-ray.distributor]\nname = "local"\n'
        )
        command = [sys.executable, "-m", "cosmic_ray.cli", "init", str(config), str(session)]
        subprocess.run(command, cwd=ROOT, check=True)
        with use_db(session, WorkDB.Mode.open) as db:
            mutants = [item.mutations[0] for item in db.work_items]
    judged = {name: (changes_nothing(ROOT / name), alike(ROOT / name), operators(ROOT / name)) for name in modules}
    viable = [mutant for mutant in mutants if is_viable(mutant, *judged[str(mutant.module_path)])]
    viable.sort(key=lambda m: (str(m.module_path), m.start_pos, m.operator_name, m.occurrence))
    return mutants, viable


def main(room, sample=60, seed=1, lines=(0, 10**9)):
    """Try a sample of the mutants of a room."""
    from cosmic_ray.mutating import use_mutation
    from cosmic_ray.plugins import get_operator

    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    os.environ["PYTHONPATH"] = str(ROOT)  # of what the tests start
    sys.dont_write_bytecode = True
    tests = [f"tests/{name}" for name in ROOMS[room][1]]
    mutants, viable = mutants_of(room)
    viable = [mutant for mutant in viable if lines[0] <= mutant.start_pos[0] <= lines[1]]
    chosen = random.Random(seed).sample(viable, min(sample, len(viable)))
    caught = 0
    with tempfile.TemporaryDirectory() as folder:
        known = pathlib.Path(folder) / "known.json"
        if noticed_by(tests, known):
            raise SystemExit(f"{room}: the tests fail without a mutant")
        foreseen = json.loads(known.read_text())
        for name in foreseen["modules"]:
            if name.split(".")[0] in LIBRARIES:
                importlib.import_module(name)
        timeout = LONGER * sum(d for d in foreseen["durations"].values() if d <= LONGEST) + LEAST
        for number, mutant in enumerate(chosen, start=1):
            fault = get_operator(mutant.operator_name)(**mutant.operator_args)
            with use_mutation(pathlib.Path(mutant.module_path), fault, mutant.occurrence) as (sound, faulty):
                noticed = noticed_by(tests, known, timeout)
            caught += noticed
            if not noticed:
                print(f"\n{number}. {mutant.module_path}:{mutant.start_pos[0]} {mutant.operator_name}")
                changed = difflib.unified_diff(sound.splitlines(), faulty.splitlines(), n=0, lineterm="")
                print("\n".join(line for line in list(changed)[2:] if line[:1] in "+-"), flush=True)
    found = f"{len(viable)} viable mutants of {len(mutants)}, {len(chosen)} tried, {caught} caught"
    print(f"\n{room}: {found}: {caught / len(chosen):.0%}", flush=True)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("room", choices=[*ROOMS, "all"])
    asked.add_argument("--sample", type=int, default=60)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--last", type=int, default=10**9)
    given = asked.parse_args()
    for name in ROOMS if given.room == "all" else [given.room]:
        main(name, given.sample, given.seed, (given.first, given.last))
