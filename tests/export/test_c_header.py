"""The C header gives the results of Python: as C and C++, with sanitizers, and on a simulated AVR."""

import shutil
import subprocess
from binascii import crc32
from pathlib import Path

import numpy as np
import pytest
from scripts.exports.c_header import c_header

from motorcade.words.field import WordError
from motorcade.words.formats import FORMATS, FRAME, fingerprint
from support.waiting import DEADLINE_S

HERE = Path(__file__).parent
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow"]
SANITIZERS = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
RANDOM_WORDS = 10_000
every_format = pytest.mark.parametrize("word_format", FORMATS, ids=lambda each: each.name)


def probe_formats():
    """The header that tells probe.c which formats there are."""
    lines = ['#include "motorcade_words.h"', "#define FORMATS(F) " + " ".join(f"F({each.name})" for each in FORMATS)]
    for each in FORMATS:
        fields = " ".join(f"F({field.name})" for field in each.fields)
        types = " ".join(f"F({field.name}, {c_type_bits(field)})" for field in each.fields)
        lines += [f"#define {each.name}_FIELDS(F) {fields}", f"#define {each.name}_TYPES(F) {types}"]
        lines.append(f"#define {each.name}_DEFAULTS MOTORCADE_{each.name.upper()}_DEFAULTS")
        lines.append(f"#define {each.name}_COUNT {len(each.fields)}")
        computed = [f"motorcade_{each.name}_{field.name}_is_good(word)" for field in each.fields if field.parity_masks]
        complete = f"motorcade_{each.name}_complete(word)" if computed else "word"
        lines.append(f"#define {each.name}_COMPLETE(word) {complete}")
        lines.append(f"#define {each.name}_GOOD(word) {' + 2 * '.join(computed) or 0}")
    return "\n".join(lines) + "\n"


def c_type_bits(field):
    return 8 if field.width <= 8 else 16 if field.width <= 16 else 32


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The probe's sources."""
    folder = tmp_path_factory.mktemp("probe")
    shutil.copy(HERE / "probe.c", folder)
    (folder / "probe_formats.h").write_text(probe_formats())
    (folder / "motorcade_words.h").write_text(c_header(), encoding="utf-8")
    return folder


def build(folder, name, command):
    subprocess.run([*command, *WARNINGS, "probe.c", "-o", name], cwd=folder, check=True, timeout=DEADLINE_S)
    return folder / name


@pytest.fixture(scope="module")
def probe(folder, gcc):
    return build(folder, "probe", [str(gcc), "-std=c99", "-O1", *SANITIZERS])


def run(probe, word_format, mode, data):
    """What the probe answers to ``data``, as an array with a record for each word."""
    command = [str(probe), str(FORMATS.index(word_format)), mode]
    done = subprocess.run(command, input=data, capture_output=True, check=False, timeout=DEADLINE_S)
    assert (done.returncode, done.stderr.decode()) == (0, "")
    return np.frombuffer(done.stdout, records(word_format, mode))


def records(word_format, mode):
    if mode == "encode":
        return np.dtype([("checked", "u1"), ("fault", "u1"), ("word", ">u4")])
    fields = [(f"field {field.name}", ">u4") for field in word_format.fields]
    return np.dtype(
        [
            ("strict", "u1"),
            ("fault", "u1"),
            *fields,
            ("again", "u1"),
            ("word", ">u4"),
            ("complete", ">u4"),
            ("good", "u1"),
        ]
    )


def big_endian(numbers):
    return np.asarray(numbers, ">u4").tobytes()


def mixed_words(word_format, count):
    """Half of them any words, half a good one with up to three bits flipped."""
    random = np.random.default_rng(7)
    words = random.integers(0, 1 << 32, count, dtype=np.uint32)
    good = np.full(count // 2, word_format.encode(), np.uint32)
    for field in word_format.fields:
        allowed = np.array([raw for raw in range(min(field.raw_mask, 1 << 17) + 1) if field.allows(raw)], np.uint32)
        if not field.goes_with and field.name not in {each.goes_with for each in word_format.paired}:
            good = good & ~np.uint32(field.word_mask) | random.choice(allowed, len(good)) << np.uint32(field.low)
    for _ in range(3):
        flipped = np.uint32(1) << random.integers(0, 32, len(good), dtype=np.uint32)
        good ^= np.where(random.integers(0, 3, len(good)) == 0, flipped, np.uint32(0))
    words[::2] = good
    return words


def fault_by_python(word_format, word, strict):
    names = [field.name for field in word_format.fields]
    try:
        word_format.decode(word, strict)
    except WordError as error:
        return names.index(error.field) + 1
    return 0


@every_format
def test_many_words_mean_the_same_in_c(word_format, probe):
    words = mixed_words(word_format, RANDOM_WORDS)
    found = run(probe, word_format, "decode", big_endian(words))
    assert len(found) == len(words)
    for strict, column in ((False, "fault"), (True, "strict")):
        assert found[column].tolist() == [fault_by_python(word_format, word, strict) for word in words.tolist()]

    good = found["fault"] == 0
    for field in word_format.fields:
        column = words[good] >> np.uint32(field.low) & np.uint32(field.raw_mask)
        assert np.array_equal(found[f"field {field.name}"][good], column)
    assert np.array_equal(found["again"], found["fault"])
    assert np.array_equal(found["word"], np.where(good, words, 0))
    # Enough of both: else nothing much was compared.
    assert good.sum() > 1000
    assert word_format.name in ("control", "frame") or (~good).sum() > 1000


def test_c_completes_frames_and_finds_wrong_checks_and_parities(probe):
    words = mixed_words(FRAME, RANDOM_WORDS)
    # Every fourth word is right, every other fourth of them but for one bit.
    right = np.array([FRAME.complete(word) for word in words[::4].tolist()], np.uint32)
    words[::4] = right
    words[1::4] = right ^ np.uint32(1) << np.arange(len(right), dtype=np.uint32) % np.uint32(32)
    found = run(probe, FRAME, "decode", big_endian(words))
    assert found["complete"].tolist() == [FRAME.complete(word) for word in words.tolist()]
    codes = [{warning.key for warning in FRAME.warnings(word)} for word in words.tolist()]
    check_is_good = np.array([not each & {"bad-check", "bad-reserved"} for each in codes])
    parity_is_good = np.array(["bad-parity" not in each for each in codes])
    assert np.array_equal(found["good"], check_is_good + 2 * parity_is_good)
    assert set(found["good"].tolist()) == {0, 1, 2, 3}


@every_format
def test_values_are_refused_in_c_as_in_python(word_format, probe):
    random = np.random.default_rng(3)
    names = [field.name for field in word_format.fields]
    base = word_format.decode(word_format.encode())._asdict()
    cases = []
    for field in word_format.fields:
        most = (1 << c_type_bits(field)) - 1
        edges = {0, 1, field.minimum - 1, field.maximum, field.maximum + 1, field.raw_mask, field.raw_mask + 1, most}
        edges |= set(random.integers(0, most + 1, 20).tolist())
        cases += [base | {field.name: raw} for raw in edges if 0 <= raw <= most]
    found = run(probe, word_format, "encode", big_endian([[case[name] for name in names] for case in cases]))
    for case, (checked, fault, word) in zip(cases, found.tolist(), strict=True):
        try:
            expected = (0, word_format.encode(**case))
        except WordError as error:
            expected = (names.index(error.field) + 1, 0)
        assert (fault, word) == expected
        assert checked == fault


@every_format
def test_c_knows_fingerprints_and_defaults(word_format):
    name, defaults = (
        f"MOTORCADE_{word_format.name.upper()}",
        ", ".join(str(each.default) for each in word_format.fields),
    )
    assert f"#define {name}_DEFAULTS {{ {defaults} }}\n" in c_header()
    assert f"#define {name}_FINGERPRINT 0x{fingerprint(word_format):08X}UL\n" in c_header()


def test_cxx_answers_the_same(folder, probe, gxx):
    (folder / "probe.cpp").write_bytes((folder / "probe.c").read_bytes())
    command = [str(gxx), "-std=c++11", "-O1", *WARNINGS, "probe.cpp", "-o", "probe_cpp"]
    subprocess.run(command, cwd=folder, check=True, timeout=DEADLINE_S)
    for word_format in FORMATS:
        data = big_endian(mixed_words(word_format, 5_000))
        expected = run(probe, word_format, "decode", data)
        assert run(folder / "probe_cpp", word_format, "decode", data).tobytes() == expected.tobytes()


def test_an_avr_whose_int_has_16_bits_answers_the_same(folder, probe, avr_gcc, simavr):
    words = np.concatenate([mixed_words(word_format, 100) for word_format in FORMATS])
    listed = ", ".join(f"0x{word:08X}UL" for word in words.tolist())
    (folder / "probe_words.h").write_text(f"static const uint32_t WORDS[] PROGMEM = {{ {listed} }};\n")
    chip = build(folder, "probe.elf", [str(avr_gcc), "-std=c99", "-Os", "-mmcu=atmega2560", "-DF_CPU=16000000UL"])
    command = [str(simavr), "-m", "atmega2560", "-f", "16000000", str(chip)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=DEADLINE_S)
    expected = [
        f"{crc32(run(probe, word_format, 'decode', big_endian(words)).tobytes()):08x}" for word_format in FORMATS
    ]
    assert [line for line in expected if line not in printed.stdout + printed.stderr] == []
