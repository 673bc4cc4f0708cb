"""Names of cases: what was varied, for readers and for file systems."""

import re

from roughvisc.study.case_text import case_words, file_stems, short_words, value_text


def case(**varied):
    return {"varied": {key.replace("__", "."): value for key, value in varied.items()}}


def test_case_words__are_what_the_study_says():
    assert case_words(case(program__0__load=2.0, program__1__hold=5.0)) == "Load 2 N, hold 5 s"
    assert case_words(case(program__0__load=1.0, program__2__load=2.0)) == "Load (program.0) 1 N, load (program.2) 2 N"
    assert case_words(case(surface__file="/far/away/Plate 3.sur", solve__tolerance=1e-3)) == (
        "File Plate 3.sur, tolerance 0.001"
    )
    assert case_words({}) == ""
    assert short_words({"program.0.load": 2.0, "surface.resample": [16, 24]}) == "2 N, 16 x 24 cells"
    assert short_words({"keep.times": [0.13], "solve.boundary": "mirror"}) == "times 130 ms, boundary mirror"
    assert value_text("keep.times", "[0.1, 2.0]") == value_text("keep.times", [0.1, 2.0]), "a coordinate of a sweep"


def test_file_stems__are_safe_and_tell_cases_apart():
    cases = {
        "a" * 16: case(program__0__load=2.0, program__1__hold=5.0),
        "b" * 16: case(surface__size=5e-6),
        "c" * 16: case(program__0__load=5e-3),
        "d" * 16: case(program__0__load=5e6),
        "e" * 16: case(surface__file="/scans/a.sur"),
        "f" * 16: case(surface__file="/scans/a.x3p"),
        "0" * 16: case(material__terms=[{"modulus": 1e6 * n, "time": n} for n in range(40)]),
        "1" * 16: case(surface__file='../$(rm -rf) "ä" <b>|?*.sur', material__fluidity=3e-7),
        "2" * 16: case(),
        "3" * 16: case(program__0__load=1.0, program__2__load=2.0),
        "4" * 16: {"title": "A ball on rubber"},
    }
    stems = file_stems(cases)
    assert stems["a" * 16] == "load_2N-hold_5s"
    assert stems["b" * 16] == "size_5um"
    assert stems["c" * 16] == "load_5mN-cccccccc", "not told from 5 MN where capitals do not count"
    assert stems["d" * 16] == "load_5MN-dddddddd"
    assert stems["e" * 16] == "file_a-eeeeeeee"
    assert stems["2" * 16] == "2" * 16
    assert stems["4" * 16] == "A_ball_on_rubber"
    assert stems["3" * 16] == "load_program.0_1N-load_program.2_2N"
    assert len({stem.casefold() for stem in stems.values()}) == len(cases)
    assert all(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,89}", stem) for stem in stems.values()), stems
    alone = file_stems({"a" * 16: cases["a" * 16]})
    assert alone["a" * 16] == stems["a" * 16], "whatever else lies in the folder"
