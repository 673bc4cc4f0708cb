"""Do the tests of the numerics notice a fault? Faults are made one at a time, and the tests of the room must fail.

    pip install -e ".[test,mutation]"
    python tests/mutate.py ROOM [--sample N] [--seed S] [--first LINE --last LINE]

ROOM is one of those below, or all. Of all mutants of its files (cosmic-ray's operators) a random sample of 60 is made
unless given, without those that change nothing: type annotations, and texts. Printed are the score and the survivors.
It changes the files that it mutates, one after the other, and restores them: run it in a checkout of its own.
"""

import argparse
import ast
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[1]
#: room -> its files, and the tests that are to notice a fault in them, the quickest first
ROOMS = {
    "contact": (("mechanics/contact",), ("mechanics/test_contact.py",)),
    "stepping": (
        tuple(f"mechanics/stepping/{name}.py" for name in (
            "apart", "attempt", "companion", "control", "domain", "energy", "events", "march", "pace", "scene",
        )),
        ("mechanics/stepping", "study/storage/test_checkpoint.py", "test_convergence.py"),
    ),
    "hereditary": (("mechanics/hereditary",), ("mechanics/hereditary", "mechanics/stepping/test_march.py")),
    "halfspace": (("mechanics/halfspace",), ("mechanics/halfspace",)),
    "rows": (
        ("study/simulation/rows.py",),
        ("study/simulation/test_rows.py", "study/simulation/test_simulate.py", "study/simulation/test_perimeter.py"),
    ),
    "grid_error": (
        ("study/simulation/grid_error.py", "study/simulation/grid_convergence.py"),
        ("study/simulation/test_grid_error.py",),
    ),
    "checkpoint": (("study/storage/checkpoint.py",), ("study/storage/test_checkpoint.py",)),
    "estimate": (("study/cost/estimate.py",), ("study/cost/test_plan.py",)),
    "conditioning": (
        tuple(f"topography/{name}.py" for name in ("bandwidth", "framing", "missing_points")),
        ("topography/test_conditioning.py",),
    ),
}  # fmt: skip
#: a mutant whose tests take longer hangs
TIMEOUT = 200.0


def files_of(room):
    found = [ROOT / "roughvisc" / name for name in ROOMS[room][0]]
    found = [path if path.exists() else path.with_suffix(".py") for path in found]
    return [file for path in found for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]


def changes_nothing(path):
    """Spans of lines and columns in which no mutant changes what is computed: annotations, texts, type checks."""
    spans = []
    for node in ast.walk(ast.parse(path.read_text())):
        parts = []
        if isinstance(node, ast.FunctionDef):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            parts = [node.returns, *(argument.annotation for argument in arguments)]
        elif isinstance(node, ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert):  # what a message says; an assertion for mypy
            parts = [node]
        spans += [(p.lineno, p.col_offset, p.end_lineno, p.end_col_offset) for p in parts if p is not None]
    return spans


def is_viable(mutation, spans):
    (line, column), _ = mutation.start_pos, mutation.end_pos
    inside = any((a, b) <= (line, column) <= (c, d) for a, b, c, d in spans)
    return not inside and "NoOp" not in mutation.operator_name


def main(room, sample=60, seed=1, lines=(0, 10**9)):
    from cosmic_ray.work_db import WorkDB, use_db
    from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkResult

    with tempfile.TemporaryDirectory() as folder:
        config, session = pathlib.Path(folder) / "config.toml", pathlib.Path(folder) / "session.sqlite"
        tests = " ".join(f"tests/{name}" for name in ROOMS[room][1])
        command = f"{sys.executable} -m pytest -q -x -p no:cacheprovider {tests}"
        modules = [str(path.relative_to(ROOT)) for path in files_of(room)]
        config.write_text(
            f"[cosmic-ray]\nmodule-path = {modules}\ntimeout = {TIMEOUT}\nexcluded-modules = []\n"
            f'test-command = "{command}"\n[cosmic-ray.distributor]\nname = "local"\n'
        )
        run = [sys.executable, "-m", "cosmic_ray.cli"]
        subprocess.run([*run, "init", str(config), str(session)], cwd=ROOT, check=True)
        spans = {name: changes_nothing(ROOT / name) for name in modules}
        with use_db(session, WorkDB.Mode.open) as db:
            items = {item.job_id: item.mutations[0] for item in db.work_items}
            viable = sorted(
                (str(m.module_path), m.start_pos, m.operator_name, m.occurrence, job)
                for job, m in items.items()
                if is_viable(m, spans[str(m.module_path)]) and lines[0] <= m.start_pos[0] <= lines[1]
            )
            chosen = {entry[-1] for entry in random.Random(seed).sample(viable, min(sample, len(viable)))}
            for job in items.keys() - chosen:
                db.set_result(job, WorkResult(worker_outcome=WorkerOutcome.SKIPPED))
        subprocess.run([*run, "exec", str(config), str(session)], cwd=ROOT, check=True)
        with use_db(session, WorkDB.Mode.open) as db:
            results = {job: result for job, result in db.results if job in chosen}
    survivors = [job for job, result in results.items() if result.test_outcome == TestOutcome.SURVIVED]
    print(f"{room}: {len(viable)} viable mutants, {len(chosen)} tried, {len(chosen) - len(survivors)} caught: "
          f"{1 - len(survivors) / len(chosen):.0%}")  # fmt: skip
    for job in sorted(survivors, key=lambda job: (str(items[job].module_path), items[job].start_pos)):
        mutation = items[job]
        print(f"\n{mutation.module_path}:{mutation.start_pos[0]} {mutation.operator_name} {mutation.operator_args}")
        print("\n".join(line for line in (results[job].diff or "").splitlines() if line[:1] in "+-"))


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
