"""Exports of test machines: the materials that they were made of, or one message that says what to state."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from support import refused

import roughvisc as rv
from roughvisc.study.case import Case, vary

EXPORTS = Path(__file__).parent / "exports"
#: Form -> table [material], and the right contact compliance at 0.03, 1 and 30 s or "refused".
ROWS = {
    form: (tomllib.loads(keys.replace("; ", "\n")), right)
    for form, keys, right in re.findall(r"\| (.*?) \| `(.*)` \| (.*) \|\n?", (EXPORTS / "README.md").read_text())
    if "model" in keys
}
#: Largest deviation, if it is not 3 %.
DEVIATIONS = {"nine temperatures": 0.04, "creep": 0.05, "down to the noise": 0.12}


@pytest.mark.parametrize("form", ROWS)
def test_export__gives_its_material_or_is_refused(form, read_one):
    stated, right = ROWS[form]
    if "file" in stated:
        stated = stated | {"file": str(EXPORTS / stated["file"])}
    if right == "refused":
        with pytest.raises(rv.InputError) as caught:
            read_one(material=stated)
        assert caught.value.key.startswith("material")
        assert Path(stated["file"]).name in str(caught.value)
        return
    material = read_one(material=stated).material
    most = next((one for words, one in DEVIATIONS.items() if words in form), 0.03)
    exact = np.array(list(map(float, right.split(","))))
    assert material.contact_compliance(np.array([0.03, 1.0, 30.0])) == pytest.approx(exact, rel=most)
    assert material.warning == ""


def test_temperature__is_swept_with_one_superposition(read_one, monkeypatch):
    """A case needs its file no longer; at a measured temperature it is the table of that temperature."""
    stated, _ = ROWS["polymer, nine temperatures"]
    case = read_one(material=stated | {"file": str(EXPORTS / stated["file"])})
    shift = case.material.thermal.shift.__self__
    warm = vary(Case.from_json(case.to_json()), {"material.temperature": "45 degC"})
    assert warm.material.thermal.shift.__self__ is shift
    assert warm.material == case.material.at("45 degC")
    assert warm.shift_factor < case.shift_factor < 1
    assert warm.key != case.key
    slower = vary(case, {"material.shift_factor": 2.0}).material
    assert slower.contact_compliance(2.0) == pytest.approx(case.material.contact_compliance(1.0), rel=1e-12)


NAMES = {"frequency": "f", "storage": "G'", "loss": 'G"'}


def read(folder, text, columns=NAMES, encoding="utf-8", **keys):
    path = folder / "export.txt"
    path.write_bytes(text.encode(encoding))
    return rv.read_material(path, "dynamic_table", columns=columns, **{"kind": "shear"} | keys)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("f [Hz],G' [MPa],G\" [MPa]\n1,2,0.3\n10,2.5,0.5\n", NAMES),
        ("f\tG'\tG\"\tTemp.\nHz\tMPa\tMPa\t°C\n1,0\t2\t0,3\t20,0\n10\t2,5\t0,5\t20\n", NAMES),
        ("Test;7\n\nf;G';G\"\nfrequency;moduli;\n[Hz];[MPa];[MPa]\n1;2;0.3\n10;2.5;0.5\nend of test\n", NAMES),
        ("f;F;G';G\"\nHz;N;MPa;MPa\n1;3;2;0.3\n10;4;2.5;0.5\n", NAMES),
        ("# f (Hz)   G' (MPa)   G\" (MPa)\n1 2 0.3\n10 2.5 0.5\n", NAMES),
        (
            "ang. frequency  storage modulus  loss factor\n6.283185307179586  2  0.15\n62.83185307179586  2.5  0.2\n",
            {"frequency": "ang. frequency [rad/s]", "storage": "storage modulus [MPa]", "tan_delta": "loss factor"},
        ),
        (
            "f,G',G\"\nHz,kPa,kPa\n1,2000,300\n,,\n****,****,****\n5,2200,---\nf,G',G\"\nHz,kPa,kPa\n10,2500,500\n",
            NAMES,
        ),
    ],
)
def test_material__is_the_same_in_any_form(tmp_path, text, columns):
    exact = rv.dynamic_table([1, 10], [2e6, 2.5e6], [3e5, 5e5], frequency_unit="Hz", kind="shear")
    t = np.array([0.0, 0.1, 10.0])
    for encoding in ("utf-8", "utf-16", "cp1252"):
        material = read(tmp_path, text, columns, encoding)
        assert material.contact_compliance(t) == pytest.approx(exact.contact_compliance(t), rel=1e-9)
    assert ("4 rows without numbers left out" in material.note) == ("****" in text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f,G',G\"\n1,2,0.3\n10,2.5,0.5\n", "line 1: .*'f' without a unit.*Hz"),
        ("f [1/min],G' [Pa],G\" [Pa]\n1,2,0.3\n10,2.5,0.5\n", r"line 1: unit of frequency: .*1/min.*Hz"),
        ("f [Hz],G' [Pa],G\" [s]\n1,2,0.3\n10,2.5,0.5\n", "line 1: unit of loss"),
        ("f [Hz],G' [Pa],G\"\nrad/s,Pa,Pa\n1,2,0.3\n10,2.5,0.5\n", "'Hz'.*'rad/s'"),
        ("f [Hz],G' [Pa],G'' [Pa]\n1,2,0.3\n10,2.5,0.5\n", 'G"'),
        ("f;G';G\"\nHz;Pa;Pa\n1;2.000,5;0,3\n10;2;0,5\n", r"line 3: found '2.000,5'"),
        ("f;G';G\"\nHz;Pa;Pa\n1;2;0,3\n10;2.5;0,5\n", "one decimal mark"),
        ("f,G',G\"\nHz,Pa,Pa\n1,2,0.3,7\n10,2,0.5,7\n", "line 3: found 4 cells"),
        ("f,G',G\"\nHz,Pa,Pa\n\n", "no rows"),
        ("f;G';G\"\nHz;Pa;Pa\n1;2;1\n10;3;1\nstep 2\nt;G;T\ns;Pa;K\n1;2;3\n", "line 8: .*another step.* line 5.*part"),
        ("f;G';G\"\nHz;Pa;Pa\n1;2;1\nf;G';G\"\nHz;Pa;Pa\n1;3;1\n10;4;1\n", "line 3|line 6.*temperature"),
        ("f;G';G\";f\nHz;Pa;Pa;Hz\n1;2;1;1\n", "frequency.*fits"),
    ],
)
def test_export__is_refused_with_its_line(tmp_path, text, said):
    with pytest.raises(rv.InputError, match=rf"export\.txt.*({said})"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("key", "found"),
    [
        ("columns.stress", "f"),
        ("columns.storage", 3),
        ("part", ""),
        ("part", "2"),
        ("model", "zener"),
        ("kind", "bulk"),
    ],
)
def test_wrong_description__is_refused_at_its_key(tmp_path, key, found):
    (tmp_path / "a.txt").write_text("sweep 2\nsweep 2\nf,G',G\"\nHz,Pa,Pa\n1,2,0.3\n10,2.5,0.5\n")
    columns = NAMES | ({key.partition(".")[2]: found} if "." in key else {})
    keys = {"model": "dynamic_table", "kind": "shear"} | ({} if "." in key else {key: found})
    with refused(key, found):
        rv.read_material(tmp_path / "a.txt", columns=columns, **keys)
