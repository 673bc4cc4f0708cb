"""The campaign of mutants: a part of it finds nothing, and faults that are planted are found."""

import contextlib
import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from campaign import examined, in_processes, listed
from mutant_studies import names_key
from stated_units import UnknownUnit, quantity_said

from roughvisc import tables
from roughvisc.errors import InputError
from roughvisc.study.statement.schema import section as entries
from roughvisc.study.storage import results, store
from roughvisc.topography import cards

SEED = 1
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")


def faults(outcomes):
    return [one.fault for one in outcomes if one.end == "fault"]


@pytest.mark.parametrize(("kind", "count"), [("studies", 40), ("tables", 60), ("scans", 40), ("results", 20)])
def test_campaign__finds_no_fault(kind, count, tmp_path):
    outcomes = list(examined(kind, SEED, range(count), tmp_path))
    assert faults(outcomes) == []
    ends = [one.end for one in outcomes]
    assert min(ends.count(end) for end in ("same", "other", "refused")) > 0, "what always ends alike tests little"
    assert all(one.differs and one.change for one in outcomes if one.end == "other")


@pytest.mark.thorough
@needs_fork
def test_campaign__finds_no_fault_in_runs_that_are_killed(tmp_path, monkeypatch):
    monkeypatch.setattr("killed_runs._WAYS", ("operation", "function", "command"))
    outcomes = list(examined("kills", SEED, range(4), tmp_path))
    assert faults(outcomes) == []
    assert len({one.subject for one in outcomes}) > 1
    assert any("SIG" in one.change and "had finished" not in one.change for one in outcomes)


# ----------------------------------------------------------------------------------------------------------------
# planted


def planted(kind, numbers, tmp_path, plant):
    """Faults that are found once a fault is planted, behind the originals."""

    def after_the_originals():
        plant()
        yield from numbers

    return faults(examined(kind, SEED, after_the_originals(), tmp_path))


def test_campaign__notices_a_traceback_and_a_hang(tmp_path, monkeypatch):
    from outcome import Outcome, opened

    def broken(*_):
        raise ValueError("shape mismatch")

    found = planted("tables", range(12), tmp_path, lambda: monkeypatch.setattr(tables, "decimal_mark", broken))
    assert "a traceback: ValueError: shape mismatch" in found
    monkeypatch.setattr("outcome.PATIENCE", 0.05)

    def endless():
        while True:
            pass

    outcome = Outcome(0, "", "")
    assert opened(outcome, endless, tmp_path, lambda message: True) is None
    assert outcome.fault == "a hang: took more than 0.05 s"


@pytest.mark.parametrize(
    ("message", "found"),
    [
        ("it cannot be read", "does not name the file"),
        ("study.toml: it cannot be read", "does not name the place"),
        ("study.toml: load: " + "x" * 5000, "a message of 5018 signs"),
        ("study.toml: load: found -1: expected more", ""),
    ],
)
def test_campaign__notices_a_refusal_that_names_nothing(message, found, tmp_path):
    from outcome import Outcome, opened

    def refuse():
        raise InputError(message)

    outcome = Outcome(0, "", "")
    assert opened(outcome, refuse, tmp_path / "study.toml", lambda message: "load" in message) is None
    assert outcome.end == ("fault" if found else "refused")
    assert found in outcome.fault


def test_campaign__notices_a_wrong_value_of_a_study(tmp_path, monkeypatch):
    right = entries.bounded_quantity

    def wrong(value, unit, **bounds):
        return right(value, unit, **bounds) * (1000 if isinstance(value, str) and "kPa" in value else 1)

    found = planted("studies", range(60), tmp_path, lambda: monkeypatch.setattr(entries, "bounded_quantity", wrong))
    assert any("a wrong value served" in one and "is said" in one for one in found)


def test_campaign__notices_a_wrong_value_of_a_table(tmp_path, monkeypatch):
    right = tables.plain_number

    def wrong(cell, mark):
        return right(cell.replace(",", ""), ".")

    found = planted("tables", range(40), tmp_path, lambda: monkeypatch.setattr(tables, "plain_number", wrong))
    assert any("a wrong value served" in one and "served, " in one for one in found)


def test_campaign__notices_a_row_that_is_lost(tmp_path, monkeypatch):
    right = tables.read_text

    def wrong(path):
        lines = right(path).splitlines()[:-1]
        return "\n".join(lines)

    found = planted("tables", range(40), tmp_path, lambda: monkeypatch.setattr(tables, "read_text", wrong))
    assert any("rows served" in one for one in found)


@pytest.mark.thorough
def test_campaign__notices_a_checksum_that_is_not_looked_at(tmp_path, monkeypatch):
    found = planted(
        "scans",
        range(160),
        tmp_path,
        lambda: monkeypatch.setattr(cards, "_scan", lambda card, folder: cards.read_file(folder / card["file"])),
    )
    assert found
    assert set(found) == {"a wrong value served: a checksum, and no word of it"}


def test_campaign__notices_a_wrong_value_of_a_result(tmp_path, monkeypatch):
    right = results.read_variable

    def wrong(path, name, key):
        values = right(path, name, key)
        values[..., 0, 0] += 1e-12
        return values

    monkeypatch.setattr("mutant_results._DOORS", ("open_results", "ragged"))
    found = planted("results", range(6), tmp_path, lambda: monkeypatch.setattr(results, "read_variable", wrong))
    assert any("at (0, 0" in one and one.endswith("without a word") for one in found), found


@needs_fork
def test_campaign__notices_a_result_that_is_written_in_place(tmp_path, monkeypatch):
    @contextlib.contextmanager
    def in_place(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        yield path

    mine, seal = os.getpid(), store.append_checksum

    def killed_before(path):
        if os.getpid() != mine:
            os.kill(os.getpid(), signal.SIGKILL)
        seal(path)

    def plant():
        monkeypatch.setattr(store, "atomic_write", in_place)
        monkeypatch.setattr(store, "append_checksum", killed_before)

    monkeypatch.setattr("killed_runs._WAYS", ("operation",))
    monkeypatch.setattr("killed_runs._OPERATIONS", (10_000,))  # it dies of what is planted
    (found,) = planted("kills", [0], tmp_path, plant)
    assert "count as results and have no checksum" in found


def test_campaign__counts_a_process_that_dies_or_is_silent_against_its_mutant(tmp_path):
    script = tmp_path / "worker.py"
    script.write_text(
        "import json, os, signal, sys, time\n"
        "for number in range(int(sys.argv[1]), int(sys.argv[2])):\n"
        "    print(json.dumps({'begun': number}), flush=True)\n"
        "    if number == 1: os.kill(os.getpid(), signal.SIGSEGV)\n"
        "    if number == 4: time.sleep(60)\n"
        "    print(json.dumps({'number': number, 'subject': 's', 'change': 'c'}), flush=True)\n"
    )

    def command(first, last):
        return [sys.executable, str(script), str(first), str(last)]

    found = list(in_processes("scans", SEED, 7, command, at_once=3, silence=2.0))
    assert [one.number for one in found] == list(range(7))
    assert {one.number: one.fault for one in found if one.fault} == {
        1: "the process ended by -11: ",
        4: "a hang in a library",
    }
    assert "FAULT: a hang in a library" in listed("scans", found[4])


def test_quantity_said__is_that_of_the_units_by_hand():
    for text, value in (
        ("5 mN", 5e-3), ("0.1 MPa s", 1e5), ("0.3 MPa^-1", 3e-7), ("1 mm/s", 1e-3), ("20 um", 2e-5), ("2 h", 7200.0),
        ("5 %", 0.05), ("25 degC", 298.15), ("3 N/m^2", 3.0), ("１ mm", 1e-3), ("4 kg m^2", 4.0),
    ):  # fmt: skip
        assert quantity_said(text)[0] == pytest.approx(value, rel=1e-15)
    assert quantity_said("3 N/m^2")[1] == quantity_said("3 Pa")[1] != quantity_said("3 N")[1]
    assert quantity_said("soon") is None
    with pytest.raises(UnknownUnit):
        quantity_said("3 cubits")


@pytest.mark.parametrize(
    ("message", "named"),
    [
        ("-eep: unknown key; did you mean 'keep'?", True),
        ("surface: the scan is flat", True),
        ("2 problems\n  keep.times: found -1: expected more\n  -eep: unknown key", True),
        ("is not valid TOML: Invalid value (at line 3, column 1)", True),
        ("the load is below zero", False),
        ("2 problems\n  keep.times: found -1\n  nothing: found -1", False),
        ("is not valid TOML: it cannot be decoded", False),
    ],
)
def test_names_key__wants_a_line_or_a_key_of_the_study(message, named):
    path = Path("study.toml")
    assert names_key(f"{path}: {message}", path, b"[-eep]\nthe = 1\n") == named


def test_unsaid__tells_every_way_in_which_a_study_is_taken_wrong(tmp_path):
    import mutant_studies

    text, served = mutant_studies.prepare(tmp_path)["ball"]
    assert mutant_studies.unsaid(text.encode(), served) == []

    def taken(change):
        case = {key: dict(value) if isinstance(value, dict) else value for key, value in served[0].items()}
        change(case)
        return mutant_studies.unsaid(text.encode(), [case])

    assert taken(lambda case: case["material"].update(shear_modulus=3e5))
    assert taken(lambda case: case["material"].update(shear_modulus=np.nextafter(3e6, 4e6) * (1 + 1e-12)))
    assert taken(lambda case: case["material"].update(poisson=0.4)), "not said, and no default"
    assert taken(lambda case: case["solve"].pop("tolerance")), "said, and not taken"
    assert taken(lambda case: case["keep"].update(times=[0.0, 0.2]))
    assert mutant_studies.unsaid(text.encode(), served * 2), "two cases where one is said"
