"""Studies that are changed: each value that is served is held against what the text says, by a parse of its own."""

import contextlib
import itertools
import json
import math
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
from damage import damaged_study
from outcome import Outcome, compared, opened, text_change
from stated_units import UnknownUnit, quantity_said, unit_said

from roughvisc.errors import InputError
from roughvisc.study.execution.run import compute
from roughvisc.study.statement.case import read_cases

ROOT = Path(__file__).parents[2]
#: Cells beyond which a surface is not made, and beyond which it is not pressed; steps that are taken.
_MADE, _PRESSED, _STEPS = 20_000, 700, 3

_BALL = """title = "A ball"
[surface]
generate = "sphere"
radius = "10 mm"
size = ["1 mm", "0.9 mm"]
shape = [12, 9]
level = 0
[material]
{material}
[[program]]
load = "5 mN"
over = 0
[[program]]
hold = "0.2 s"
[solve]
boundary = "free"
tolerance = 1e-2
[keep]
fields = ["pressure", "displacement"]
times = [0, "0.1 s", "200 ms"]
"""
_ZENER = 'model = "zener"\nshear_modulus = "3 MPa"\nkelvin_modulus = "1 MPa"\nkelvin_viscosity = "0.1 MPa s"\n'
_ROUGH = """[surface]
generate = "self_affine"
size = "1 mm"
shape = [15, 13]
hurst = 0.8
rms_slope = 0.1
shortcut = "0.2 mm"
seed = 3
{surface}
[material]
{material}
{program}
[solve]
boundary = "periodic"
tolerance = 2e-2
grid_error = false
[keep]
times = {times}
{more}
"""
_PROGRAM = '[[program]]\npressure = "20 kPa"\nover = "50 ms"\n[[program]]\nhold = 0.1\n'

#: Studies that between them have most keys, and all kinds of value.
STUDIES = {
    "ball": _BALL.format(material=_ZENER),
    "sweep": _BALL.format(material=_ZENER)
    + '[sweep]\n"program.0.load" = ["4 mN", "5 mN"]\n"material.kelvin_viscosity" = ["0.05 MPa s", 1e5]\n',
    "runs": _BALL.format(material=_ZENER)
    + '[[sweep]]\n"program.0.load" = ["4 mN", 5e-3]\nsurface.radius = ["8 mm", "9 mm"]\n',
    "temperature": _BALL.format(
        material=_ZENER + 'temperature = "25 degC"\nreference_temperature = "40 degC"\nwlf_c1 = 8.9\nwlf_c2 = "102 K"\n'
    ),
    "sheet": _BALL.format(material=_ZENER + 'thickness = "2 mm"\nbase = "slipping"\n'),
    "prony": _BALL.format(
        material='model = "prony"\nglassy = "0.3 1/MPa"\nfluidity = 1e-9\ncompliances = ["0.2 1/MPa", 4e-7]\n'
        'times = ["10 ms", "1 s"]\npoisson = 0.45\n'
    )
    .replace('"0.3 1/MPa"', '"0.3 MPa^-1"')
    .replace('"0.2 1/MPa"', '"0.2 MPa^-1"'),
    "power law": _BALL.format(
        material='model = "power_law"\nglassy = 1e-7\ncoefficient = "1 MPa^-1"\nexponent = 0.3\ntime_scale = "1 s"\n'
    ),
    "relaxation": _ROUGH.format(
        surface="",
        material='model = "from_relaxation"\nequilibrium = "0.3 MPa"\nmoduli = ["3 MPa", "2 MPa"]\n'
        'times = [0.01, "100 ms"]\nbulk_modulus = "2 GPa"',
        program=_PROGRAM,
        times='"all"',
        more="",
    ),
    "table": _ROUGH.format(
        surface="mirror = true",
        material='model = "relaxation_table"\nfile = "relaxation.csv"\nkind = "tensile"',
        program='[[program]]\ntable = "loads.csv"\n',
        times=3,
        more="",
    ),
    "inline": _ROUGH.format(
        surface='amplitudes = "gaussian"',
        material='model = "tabulated"\ntimes = [0.01, 0.1, 1]\ncompliances = [1e-7, 2e-7, "0.5 MPa^-1"]',
        program='[[program]]\ncontrol = "pressure"\n'
        'table = { times = [0, "0.1 s", 0.2], values = [0, "10 kPa", 2e4] }\n',
        times='[0.1, "200 ms"]',
        more="",
    ),
    "pair": _ROUGH.format(
        surface="",
        material='model = "pair"\n[material.a]\nmodel = "elastic"\nshear_modulus = "30 MPa"\n'
        '[material.b]\nmodel = "maxwell"\nshear_modulus = "1 MPa"\nviscosity = "1 MPa s"',
        program=_PROGRAM,
        times=2,
        more='[observe.conductance]\nresistivity = [5.0, "5 K m/W"]\n',
    ),
    "cycle": _ROUGH.format(
        surface="",
        material='model = "kelvin_voigt"\nshear_modulus = "1 MPa"\nviscosity = "50 kPa s"',
        program='[[program]]\napproach = "2 um"\nover = "10 ms"\n[[program]]\ncontrol = "approach"\n'
        'cycle = { mean = "2 um", amplitude = "1 um", period = "0.1 s", cycles = 2 }\n',
        times=4,
        more="",
    ),
    "slide": _ROUGH.format(
        surface="",
        material=_ZENER,
        program='[[program]]\npressure = "20 kPa"\nover = "1 ms"\n[[program]]\n'
        'slide = "0.2 mm"\nspeed = "1 mm/s"\ndirection = "-x"\n',
        times=3,
        more="",
    ).replace("tolerance = 2e-2", "tolerance = 0.2"),
    "friction": """[surface]
generate = "self_affine"
size = "1 mm"
shape = [18, 16]
hurst = 0.8
rms_slope = 0.1
shortcut = "0.25 mm"
seed = 3
[material]
model = "from_relaxation"
equilibrium = "1 MPa"
moduli = ["2 MPa"]
times = ["10 ms"]
[friction]
pressure = "20 kPa"
speeds = { from = "1 mm/s", to = "0.1 m/s", count = 3 }
[solve]
boundary = "periodic"
[keep]
fields = ["pressure"]
precision = 1e-4
""",
    "scan": """title = "A scan"
[surface]
file = "scan.csv"
unit = "um"
spacing = ["10 um", "12 um"]
crop = { x = ["10 um", "90 um"] }
level = 1
outliers = { window = 5, threshold = 6 }
fill = true
filter = { cutoff = "25 um", keep = "long" }
resample = [10, 8]
[material]
model = "elastic"
shear_modulus = "3 MPa"
poisson = 0.4
[[program]]
load = "1 mN"
over = "10 ms"
[solve]
boundary = "periodic"
method = "seed"
[keep]
times = 2
[audit]
work_of_adhesion = "50 mJ/m^2"
""",
}
#: What the files beside the studies hold, which stays as it is.
FILES = {
    "relaxation.csv": (
        "time [s], modulus [MPa]\n0.01, 3\n0.1, 2\n1, 1.5\n10, 1.2\n",
        {"times": [0.01, 0.1, 1.0, 10.0], "moduli": [3e6, 2e6, 1.5e6, 1.2e6]},
    ),
    "loads.csv": (
        "time [ms]; load [mN]\n0; 0\n10; 2,5\n200; 5\n",
        {"times": [0.0, 0.01, 0.2], "values": [0.0, 0.0025, 0.005]},
    ),
}
#: What a study takes where it says nothing, as its documentation has it.
DEFAULTS = {
    "title": "untitled",
    "invert": False,
    "level": False,
    "outliers": False,
    "fill": False,
    "filter": False,
    "mirror": False,
    "missing": "refuse",
    "exact": False,
    "anisotropy": 1.0,
    "amplitudes": "fixed",
    "seed": 0,
    "boundary": "auto",
    "tolerance": 1e-3,
    "time_step": "auto",
    "method": "fast",
    "edge": "error",
    "memory": "auto",
    "grid_error": False,
    "fields": ["pressure", "gap"],
    "times": "all",
    "poisson": 0.5,
    "modulus_factor": 1.0,
    "kind": "shear",
    "glassy": 0.0,
    "fluidity": 0.0,
    "compliances": [],
    "equilibrium": 0.0,
    "time_scale": 1.0,
    "noise": 0.0,
    "direction": "x",
    "last_octave": False,
    "window": 9,
    "threshold": 8.0,
    "keep": "long",
    "periodic": False,
    "control": "load",
    "waves": 1,
    "offset": [0.0, 0.0],
    "flip": "x",
    "conductance.kind": "thermal",
}
_MISSING = object()


def prepare(folder):
    """The files that studies name, and the originals with what they are read as."""
    for name, (text, _) in FILES.items():
        (folder / name).write_text(text)
    heights = np.add.outer(0.1 * np.arange(11.0), 0.02 * np.arange(13.0) ** 2) + np.sin(np.arange(13.0))
    np.savetxt(folder / "scan.csv", heights, delimiter=";", fmt="%.6f")
    shutil.copy(ROOT / "surfaces" / "ball.toml", folder / "ball.toml")
    originals = {}
    for name, text in STUDIES.items():
        path = folder / "study.toml"
        path.write_text(text)
        originals[name] = text, [values(case) for case in read_cases(path)]
    return originals


def examine(originals, folder, number, rng):
    name = list(originals)[rng.integers(len(originals))]
    text, before = originals[name]
    raw = damaged_study(rng, text).encode(errors="replace") if rng.random() < 0.3 else slipped(rng, text)
    path = folder / f"study{number}.toml"
    path.write_bytes(raw)
    outcome = Outcome(number, name, text_change(text, shown_text(raw)))
    cases = opened(outcome, lambda: begun(path), path, lambda message: names_key(message, path, raw))
    if cases is not None:
        after = [values(case) for case in cases]
        try:
            wrong = unsaid(raw, after)
        except UnknownUnit as unit:  # the parse here is the poorer one: a person has to look
            wrong = [f"not judged, for the unit {unit}"]
        compared(outcome, differences(before, after), wrong)
    path.unlink()
    return outcome


def begun(path):
    """Cases of a study, once the surface of the first is made and it has taken some steps."""
    cases = read_cases(path)
    case = cases[0]
    steps = itertools.count(1)
    case.experiment(), case.material(), case.body(), case.solving(), case.key
    if math.prod(case.made_shape or (1, 1)) > _MADE:
        return cases
    if case.height().size > _PRESSED or case.settings.friction is not None:  # a speed is one step, however long
        return cases

    def reached(now, end):
        if next(steps) >= _STEPS:
            raise Enough

    with contextlib.suppress(Enough):
        try:
            compute(case, progress=reached)
        except InputError as error:
            raise InputError(f"{path}: program: {error}") from error  # as a run names it
    return cases


class Enough(Exception):
    """A run has come as far as is asked for."""


def values(case):
    """What a case was read as, without whence it came."""
    stated = json.loads(case.to_json())
    return {key: value for key, value in stated.items() if key not in ("origin", "varied", "written")}


def flat(stated, above=""):
    """Dotted keys and values of nested tables."""
    if isinstance(stated, dict):
        return {k: v for key, one in stated.items() for k, v in flat(one, f"{above}.{key}" if above else key).items()}
    if isinstance(stated, list) and any(isinstance(one, dict) for one in stated):
        return {k: v for i, one in enumerate(stated) for k, v in flat(one, f"{above}.{i}").items()}
    return {above: stated}


def differences(before, after):
    """Key, value before and after, of each case."""
    found = [] if len(before) == len(after) else [f"cases: {len(before)} -> {len(after)}"]
    for number, (one, other) in enumerate(zip(before, after, strict=False)):
        lead = f"case {number} " if len(before) > 1 else ""
        one, other = flat(one), flat(other)
        keys = [key for key in {**one, **other} if repr(one.get(key)) != repr(other.get(key))]
        found += [f"{lead}{key}: {brief(one.get(key))} -> {brief(other.get(key))}" for key in keys]
    return found


def brief(value):
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= 80 else text[:77] + "..."


# ----------------------------------------------------------------------------------------------------------------
# what the text says


def unsaid(raw, served):
    """What was served and is not what the text says, or was said and not served."""
    try:
        data = tomllib.loads(raw.decode("utf-8-sig"))
    except ValueError as error:
        return [f"read although it is no TOML: {error}"]
    cases = list(said_cases(data))
    if len(cases) != len(served):
        return [f"{len(served)} cases served, {len(cases)} said"]
    return [one for said, taken in zip(cases, served, strict=True) for one in unlike(said, taken, "")]


def said_cases(data):
    """The cases of a sweep, each with its values in place."""
    sweep = data.pop("sweep", {})
    tables = sweep if isinstance(sweep, list) else [sweep]
    for table in tables:
        keys = flat(table)
        if isinstance(sweep, list):
            runs = max((len(v) for v in keys.values() if isinstance(v, list)), default=1)
            chosen = [[v[run] if isinstance(v, list) else v for v in keys.values()] for run in range(runs)]
        else:
            chosen = itertools.product(*keys.values())
        for one in chosen:
            case = json.loads(json.dumps(data, default=str))
            for key, value in zip(keys, one, strict=True):
                *above, last = key.split(".")
                here = case
                for part in above:
                    here = here[int(part)] if isinstance(here, list) else here.setdefault(part, {})
                here[int(last) if isinstance(here, list) else last] = value
            yield case


def unlike(said, taken, key):
    """Where what was taken is not what is said at a key, or below it."""
    last = key.rpartition(".")[2]
    if said is _MISSING:
        if isinstance(taken, dict):
            return [one for name, v in taken.items() for one in unlike(_MISSING, v, f"{key}.{name}")]
        below = ".".join(key.split(".")[-2:])
        right = taken in [DEFAULTS[name] for name in (below, last) if name in DEFAULTS]
        return [] if right else [f"{key} = {brief(taken)}, which is not said"]
    if isinstance(said, dict) and isinstance(taken, dict):
        said = with_columns(said, taken, key)
        found = [f"{key}.{name} is said and not taken" for name in said if name not in taken]
        return found + [
            one for name, v in taken.items() for one in unlike(said.get(name, _MISSING), v, f"{key}.{name}".lstrip("."))
        ]
    try:
        right = same(said, taken, last, key)
    except (TypeError, ValueError, LookupError):  # what is said is no value of this kind
        right = False
    return [] if right else [f"{key} = {brief(taken)}, where {said!r} is said"]


def with_columns(said, taken, key):
    """A table with the columns of its file in the file's place."""
    name = said.get("file")
    if isinstance(name, str) and Path(name).name in FILES and key.startswith("material"):
        rest = {k: v for k, v in said.items() if k != "file" and not k.endswith("_unit")}
        return rest | FILES[Path(name).name][1]
    if isinstance(said.get("table"), str) and Path(said["table"]).name in FILES:
        return said | {"table": FILES[Path(said["table"]).name][1]}
    return said


def same(said, taken, last, key):
    """Whether a value is the one that is said, as the documentation has it."""
    if isinstance(said, bool) and last in ("level", "fill", "outliers") and said:
        return taken == {"level": 1, "fill": "harmonic", "outliers": {"window": 9, "threshold": 8.0}}[last]
    if isinstance(said, bool) or isinstance(taken, bool):
        return said is taken
    if key == "friction.speeds":
        return close(speeds_said(said), taken, 1e-11)
    if isinstance(taken, dict):  # a cut-off length stands for a table
        return last == "filter" and same(said, taken["cutoff"], "cutoff", key) and not taken.get("periodic")
    if isinstance(taken, list):
        if last == "fields":
            return sorted(set(said)) == sorted(taken)
        if not isinstance(said, list):
            return last in ("size", "shape", "spacing", "resample", "band_limit", "offset") and all(
                same(said, one, last, key) for one in taken
            )
        if isinstance(taken[0] if taken else None, dict):
            return len(said) == len(taken) and not any(
                one for i, (a, b) in enumerate(zip(said, taken, strict=True)) for one in unlike(a, b, f"{key}.{i}")
            )
        numbers = [number_said(one, last) for one in said]
        return close(sorted(set(numbers)) if key == "keep.times" else numbers, taken)
    if isinstance(taken, str):
        return said == taken or (last == "file" and Path(said).name == Path(taken).name)
    return close([number_said(said, last)], [taken])


def speeds_said(said):
    if isinstance(said, dict):
        return list(np.geomspace(number_said(said["from"], ""), number_said(said["to"], ""), said["count"]))
    return sorted({number_said(one, "") for one in (said if isinstance(said, list) else [said])})


def number_said(value, last):
    """A value in SI. The dimension of a key is that which the originals have for it."""
    if not isinstance(value, str):
        return float(value)
    size, dimension = quantity_said(value)
    if last in DIMENSIONS and dimension != DIMENSIONS[last]:
        raise ValueError(f"{value} is of another dimension than {last}")
    return size


DIMENSIONS = {
    **dict.fromkeys(("radius", "size", "shortcut", "approach", "slide", "cutoff", "thickness"), unit_said("m")[1]),
    **dict.fromkeys(("over", "hold", "times", "period", "time_scale"), unit_said("s")[1]),
    **dict.fromkeys(("shear_modulus", "kelvin_modulus", "bulk_modulus", "moduli", "pressure"), unit_said("Pa")[1]),
    **dict.fromkeys(("viscosity", "kelvin_viscosity"), unit_said("Pa s")[1]),
    **dict.fromkeys(("glassy", "compliances", "coefficient"), unit_said("1/Pa")[1]),
    "load": unit_said("N")[1],
    "speed": unit_said("m/s")[1],
    "wlf_c2": unit_said("K")[1],
}


def close(said, taken, tolerance=1e-13):
    if len(said) != len(taken) or any(isinstance(one, str) for one in taken):
        return False
    return all(math.isclose(a, b, rel_tol=tolerance) for a, b in zip(said, taken, strict=True))


# ----------------------------------------------------------------------------------------------------------------
# what a refusal names


def names_key(message, path, raw):
    """Whether a refusal names a line of the file, or begins with a key; each of its lines where it has several."""
    lines = message.split("\n")
    if "is not valid TOML" in lines[0]:
        return bool(re.search(r"line \d+|end of document|UTF-16", lines[0]))
    said = [line.strip().removeprefix(f"{path}: ") for line in lines]
    if len(said) > 1:
        said = said[1:]
    known = ("title", "surface", "material", "friction", "program", "solve", "keep", "observe", "audit", "sweep")
    for one in said:
        key = one.partition(": ")[0].split(".")[0].strip("'\"")
        if key not in known and (" " in key or key not in shown_text(raw)):  # a key that the study has and may not
            return False
    return True


# ----------------------------------------------------------------------------------------------------------------
# slips of the hand


def shown_text(raw):
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"
    return raw.decode(encoding, errors="backslashreplace")


def slipped(rng, text):
    """A study as a hand or an editor may leave it: what it says is often still a study, though another one."""
    for _ in range(1 if rng.random() < 0.75 else 2):
        text = _SLIPS[rng.integers(len(_SLIPS))](rng, text)
    kind = rng.integers(24)
    if kind == 0:
        return text.encode("utf-16")
    if kind == 1:
        return text.encode("utf-8-sig")
    if kind == 2:
        return text.replace("\n", "\r\n").encode()
    if kind == 3:
        return text.encode().replace(b"um", b"\xb5m")  # as an editor in Windows-1252 saves it
    return text.encode()


def _one(pattern, make):
    """A slip at one of the places that a pattern fits."""

    def slip(rng, text):
        found = list(re.finditer(pattern, text))
        if not found:
            return text
        at = found[rng.integers(len(found))]
        return text[: at.start()] + make(rng, at) + text[at.end() :]

    return slip


def _exchange(rng, text):
    lines = text.splitlines()
    places = [i for i, line in enumerate(lines) if " = " in line]
    one, other = rng.choice(places, 2)
    (a, b), (c, d) = (lines[i].split(" = ", 1) for i in (one, other))
    lines[one], lines[other] = f"{a} = {d}", f"{c} = {b}"
    return "\n".join(lines) + "\n"


def _pick(rng, *choices):
    return str(choices[rng.integers(len(choices))])


_SLIPS = (
    *[_one(r"\d", lambda rng, at: _pick(rng, *range(10)))] * 6,  # of those that are read the most
    _one(r"\d", lambda rng, at: at[0] + _pick(rng, *range(10), "_0", "e2", "e-3", ".")),
    _one(r"\d\.?", lambda rng, at: ""),
    _one(r'(?<=\d )[a-zA-Z]+(?=[ "/^])', lambda rng, at: _pick(rng, "um", "mm", "m", "µm", "nm", "N", "mN", "MN", "kN",
                                                              "Pa", "MPa", "mPa", "GPa", "s", "ms", "min", "h", "bar")),
    _one(r'(?<=\d) (?=[a-zA-Z]+")', lambda rng, at: _pick(rng, "", "  ", "\u00a0", "\t", " 1 ", "e", "-")),
    _one(r"(?<=\d)\.(?=\d)", lambda rng, at: _pick(rng, ",", "..", " ", "'", "·")),
    _one(r'"[^"\n]*"', lambda rng, at: at[0].strip('"')),
    _one(r'(?<== )"[-\d.]+ [^"]*"', lambda rng, at: re.match(r'"([-\d.]+)', at[0])[1]),
    _one(r"(?<== )[-\d.e]+(?=\n)", lambda rng, at: f'"{at[0]}{_pick(rng, "", " s", " m", " %", " 1", " Pa")}"'),
    _one(r"(?m)^[a-z_]+(?= =)", lambda rng, at: _misspelt(rng, at[0])),
    _one(r'(?<=")[a-z_]+(?=")', lambda rng, at: _misspelt(rng, at[0])),
    _one(r"(?m)^\[+[a-z.]+\]+", lambda rng, at: _pick(rng, "", at[0].strip("[]"), f"[{at[0]}]", at[0].upper())),
    _one(r"(?m)^[^\n]+\n", lambda rng, at: _pick(rng, "", at[0] * 2, "# " + at[0], at[0].upper(), at[0].rstrip())),
    _one(r"(?<=[\[ ])[-\d.e]+(?=[,\]])", lambda rng, at: _pick(rng, "", f"{at[0]}, {at[0]}", "inf", f"-{at[0]}")),
    _one(r"(?<== )true|false", lambda rng, at: _pick(rng, "true", "false", "True", "1", '"true"')),
    _one(r"(?<== )-?\d", lambda rng, at: _pick(rng, "-", "+", "−", "0", "0x", "") + at[0]),
    _one(r"\d+", lambda rng, at: "".join(chr(ord(c) + 0xFEE0) for c in at[0])),  # of full width
    _exchange,
)  # fmt: skip


def _misspelt(rng, word):
    at = int(rng.integers(len(word)))
    return _pick(rng, word[:at] + word[at + 1 :], word[:at] + word[at] * 2 + word[at + 1 :], word.title(),
                 word[:at] + "abcdefghij"[rng.integers(10)] + word[at + 1 :], word + " ")  # fmt: skip
