"""Do two checkouts read the same body, experiment and settings from each study, to the last digit?

    python workflows/benchmarks/same_studies.py OTHER_CHECKOUT [TESTS ...]

Run it from the checkout that is to be judged. The studies are those of ``workflows``, those printed in the docs, and
those that TESTS (all of ``tests`` unless given) read while they pass. Creep is compared at 25 times, kernels at five
wavelengths, programs by segments. Exit status 1 if a study that both read differs; studies that only one reads are
listed with the reason of the other.
"""

import dataclasses
import inspect
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[2]
#: Folder in which a run of the tests stores the studies that it reads.
RECORDED = "SAME_STUDIES_RECORDED"
#: Largest file that is stored with a study. [bytes]
LARGEST = 2_000_000
TIMES = [0.0, *np.geomspace(1e-12, 1e12, 25)]
WAVES = 2 * np.pi / np.geomspace(1e-7, 1e-2, 5)
#: What has another name in the first edition, and the name there.
RENAMED = {'"dynamic_table"': '"dynamic"', 'boundary = "mirror"': 'boundary = "periodic"'}
RENAMED_BOUNDARY = {"mirror": "periodic"}
#: Settings that both editions have.
SETTINGS = ("boundary", "tolerance", "times", "fields", "edge", "missing", "time_step")


def main(other, tests):
    """Compare all studies; return the number that differ."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [*sorted(HERE.glob("workflows/*.toml")), *printed(Path(folder) / "docs")]
        paths += recorded(Path(folder) / "tests", tests)
        here, there = (descriptions(checkout, paths, folder) for checkout in (HERE, Path(other).resolve()))
    counts = Counter()
    for path in map(str, paths):
        new, old = here[path], there[path]
        if isinstance(new, list) and isinstance(old, list):
            differing = sorted({key for a, b in zip(new, old, strict=False) for key in a if a[key] != b.get(key)})
            differing += ["number of cases"] if len(new) != len(old) else []
            kind = "different" if differing else "the same"
            pairs = [(key, a[key], b.get(key)) for a, b in zip(new, old, strict=False) for key in a if key in differing]
            told = "; ".join(f"{key}: {change(str(b), str(a))}" for key, a, b in pairs[:2])
        else:
            kind = "refused by both" if isinstance(new, str) and isinstance(old, str) else "read by one"
            told = f"here {new if isinstance(new, str) else 'read'}; there {old if isinstance(old, str) else 'read'}"
        counts[kind] += 1
        if kind in ("different", "read by one"):
            print(f"{Path(path).relative_to(HERE) if path.startswith(str(HERE)) else path}: {kind}: {told[:600]}")
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()))
    return counts["different"]


def change(old, new):
    """Return two texts from their first difference on."""
    first = next((at for at, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
    at = max(first - 20, 0)
    return f"...{old[at : at + 60]} -> ...{new[at : at + 60]}"


def printed(folder):
    """Return the studies in the pages, each in a file of its own."""
    found = []
    for page in [HERE / "README.md", *sorted(HERE.glob("docs/**/*.md"))]:
        for number, text in enumerate(re.findall(r"```toml\n(.*?)```", page.read_text(), re.S)):
            if "[material]" in text and "[surface]" in text:
                found.append(folder / f"{page.stem}-{number}" / "study.toml")
                found[-1].parent.mkdir(parents=True)
                shutil.copytree(HERE / "surfaces", found[-1].parent / "surfaces")
                found[-1].write_text(text)
    return found


def recorded(folder, tests):
    """Run tests, and return the studies that they read."""
    folder.mkdir()
    environment = os.environ | {RECORDED: str(folder), "PYTHONPATH": f"{HERE}:{Path(__file__).parent}"}
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "same_studies", "-p", "no:cacheprovider"]
    subprocess.run([*command, *(tests or ["tests"])], cwd=HERE, env=environment, check=False)
    return sorted(folder.glob("*/*.toml"))


def pytest_configure(config):
    """Store each study file that the tests read, with what lies beside it; a study is known by its text."""
    if RECORDED not in os.environ:
        return
    from roughvisc.study import case

    read = case.read_toml

    def storing(path, *args, **options):
        path, tables = Path(path), read(path, *args, **options)  # refuses what is no regular file
        text = path.read_text(encoding="utf-8-sig")
        beside = [one for one in path.parent.iterdir() if one.is_file() and one.stat().st_size < LARGEST]
        folder = Path(os.environ[RECORDED]) / f"{hash_of(text, beside)}"
        if not folder.exists() and len(beside) < 40:
            part = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".part"))
            for one in beside:
                if one.suffix != ".toml" or one == path:
                    shutil.copy(one, part)
            try:
                part.rename(folder)
            except OSError:  # another worker was first
                shutil.rmtree(part)
        return tables

    case.read_toml = storing


def hash_of(text, beside):
    """Return a name for a study and the files beside it."""
    import hashlib

    digest = hashlib.sha256(text.encode())
    for one in sorted(beside):
        if one.suffix != ".toml":
            digest.update(one.name.encode() + one.read_bytes())
    return digest.hexdigest()[:16]


def descriptions(checkout, paths, folder):
    """Return what a checkout reads from each study: a list of cases, or the text of its refusal."""
    listed = Path(folder) / "paths.json"
    listed.write_text(json.dumps([str(path) for path in paths]))
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    command = [sys.executable, "-W", "ignore", __file__, "--describe", str(listed)]
    done = subprocess.run(command, env=environment, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout)


def describe(listed):
    """Print what this interpreter's package reads from the studies of a list."""
    import roughvisc as rv

    found = {}
    is_first = hasattr(rv, "study_schema")
    for path in json.loads(Path(listed).read_text()):
        read = Path(path)
        try:
            if is_first:
                read = read.with_name(f".{read.name}")
                read.write_text(in_first_edition(Path(path).read_text()))
            found[path] = [described(case) for case in rv.read_cases(read)]
        except Exception as error:
            found[path] = f"{type(error).__name__}: {error}"
        finally:
            if is_first:
                read.unlink(missing_ok=True)
    print(json.dumps(found))


def in_first_edition(text):
    """Return a study under the names of the first edition."""
    for name, former in RENAMED.items():
        text = text.replace(name, former)
    return text


def value_of(case, name):
    """Return a part of a case, which is a method in the first edition."""
    found = getattr(case, name)
    return found() if inspect.ismethod(found) else found


def described(case):
    """Return body, experiment and settings of a case, with all digits."""
    body = value_of(case, "body")
    settings = case.solving() if hasattr(case, "solving") else case.settings
    told = {"title": case.title}
    for number, material in enumerate(body.materials):
        told[f"creep {number}"] = repr(np.asarray(material.contact_compliance(np.array(TIMES))).tolist())
    told["kernel"] = "layers"
    if getattr(body, "separates", True):
        told["kernel"] = repr(np.asarray(body.kernel.transfer(WAVES, 0 * WAVES)).tolist())
    if "friction" in json.loads(case.to_json()):
        experiment = value_of(case, "experiment")
        names = [one.name for one in dataclasses.fields(experiment)]
        told |= {name: repr(getattr(experiment, name)) for name in names if name not in ("last_octave",)}
    else:
        told["program"] = repr([dataclasses.astuple(segment) for segment in value_of(case, "program").segments])
    stated = {name: getattr(settings, name) for name in SETTINGS}
    stated["boundary"] = RENAMED_BOUNDARY.get(stated["boundary"], stated["boundary"])
    stated["fields"] = sorted(stated["fields"])
    return told | {name: repr(value) for name, value in stated.items()}


if __name__ == "__main__":
    if sys.argv[1] == "--describe":
        describe(sys.argv[2])
    else:
        sys.exit(main(sys.argv[1], sys.argv[2:]) > 0)
