"""The documentation: every command and code block runs, and the site is complete."""

import base64
import json
import os
import re
import subprocess
import sys
import tomllib
import venv
import zlib
from contextlib import ExitStack

import pytest
from scripts.blocks_page import SAMPLES
from scripts.site_pages import SITE_PAGES

from motorcade.engine import linear_memory
from motorcade.program.steps import KINDS
from motorcade.service.documents import example, examples, open_text
from motorcade.service.messages import Blocks
from motorcade.service.programs import compile_blocks
from support import doc_pages, roverhat
from support.doc_pages import ROOT, Reader, blocks_of, fill_folder
from support.soak import SOAK

DOCS = ROOT / "docs"
PAGES = sorted(path for path in (*DOCS.glob("*.md"), *DOCS.glob("shop/*.md")) if not path.name.endswith(".zh.md"))
READMES = [ROOT / "README.md"]
LANGUAGES = {"console", "python", "toml", "json", "text"}
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc=["']?([^"'\s>]+)"""
    r"""|<link\b(?![^>]*rel=["']?(?:canonical|alternate|next|prev)\b)[^>]*\bhref=["']?([^"'\s>]+)"""
    r"""|@import\s+["']([^"']+)|url\(["']?([^"')]+)""",
    re.IGNORECASE,
)
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


def translated(page):
    return page.with_name(f"{page.stem}.zh.md")


@posix_only
@pytest.mark.parametrize("page", PAGES + READMES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run(page, tmp_path):
    fill_folder(tmp_path)
    roverhat.switch_on()
    with ExitStack() as running:
        reader = Reader(tmp_path, running)
        for block in blocks_of(page):
            try:
                reader.follow(block)
            except Exception as problem:
                raise AssertionError(f"{page.name}, line {block.line}: {problem}") from problem


@posix_only
@pytest.mark.skipif(not SOAK, reason="pip downloads what the page installs; make soak does")
@pytest.mark.parametrize("page", [*READMES, DOCS / "tutorial.md"], ids=lambda page: page.stem)
def test_the_blocks_run_in_what_pip_really_installs(page, tmp_path, monkeypatch):
    def install(folder, extras):
        venv.create(folder, with_pip=True)
        what = f"{ROOT}[{','.join(sorted(extras))}]"
        subprocess.run([folder / "bin" / "python", "-m", "pip", "install", "--quiet", what], check=True)
        return folder / "bin"

    monkeypatch.setattr(doc_pages, "make_environment", install)
    test_the_blocks_of_a_page_run(page, tmp_path)


@pytest.mark.parametrize("page", [*DOCS.glob("*.md"), *READMES, ROOT / "README.zh.md"], ids=lambda page: page.name)
def test_a_block_names_its_language_and_parses(page):
    for block in blocks_of(page):
        assert block.language in LANGUAGES, f"line {block.line}"
        if block.language == "toml":
            tomllib.loads(block.text)
        elif block.language == "json":
            json.loads(block.text)


@pytest.mark.parametrize("page", PAGES + READMES, ids=lambda page: page.stem)
def test_both_languages_show_the_same_code(page):
    assert [block.code for block in blocks_of(translated(page))] == [block.code for block in blocks_of(page)]


def test_a_chinese_page_leads_to_chinese_pages_and_to_its_own_in_english():
    wrong = []
    for page in (*DOCS.rglob("*.zh.md"), *ROOT.glob("*.zh.md")):
        for text, link in re.findall(r"\[([^]]*)\]\(([^)#\s:]+\.md)", page.read_text(encoding="utf-8")):
            target = page.parent / link
            is_chinese = link.endswith(".zh.md")
            if is_chinese if text == "English" else not is_chinese and translated(target).exists():
                wrong.append(f"{page.name}: {link}")
    assert wrong == []


def test_a_link_leads_to_a_file_also_where_the_files_themselves_are_read():
    pages = [
        *ROOT.glob("*.md"),
        *DOCS.rglob("*.md"),
        *(ROOT / "benchmarks").glob("*.md"),
        *(ROOT / "tests").glob("*/*.md"),
    ]
    links = [
        (page, link)
        for page in pages
        for link in re.findall(r"\]\(([^)#\s:]+)[)#\s]", page.read_text(encoding="utf-8"))
    ]
    assert len(links) > 300
    assert [f"{page.name}: {link}" for page, link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", [DOCS / "profiles.md", DOCS / "profiles.zh.md"], ids=lambda page: page.name)
def test_every_key_of_a_profile_is_explained(page):
    text = (ROOT / "src" / "motorcade" / "profiles" / "classroom.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    keys = [key for key, value in table.items() if not isinstance(value, dict)]
    keys += [f"{name}.{key}" for name, part in table.items() if isinstance(part, dict) for key in part]
    told = re.findall(r"^\| `([\w.]+)` \|", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert told == keys


def test_the_size_of_the_engine_is_that_of_its_file():
    page = ROOT / "benchmarks" / "README.md"
    (told,) = re.findall(r"`engine\.wasm` \D*([\d,]+)", page.read_text(encoding="utf-8"))
    assert int(told.replace(",", "")) == linear_memory.PATH.stat().st_size


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "CONTRIBUTING.zh.md"])
def test_the_lists_of_what_to_add_name_files_that_are_there(page):
    """Where a list says <name>, it is of a new file, whose folder is there."""
    text = (ROOT / page).read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]+) \|", text[text.index("## ") :], re.MULTILINE)
    paths = [path for row in rows for path in re.findall(r"`([\w./<>*-]+/[\w./<>*-]*)`", row)]
    roots = (ROOT, ROOT / "src" / "motorcade")
    assert len(paths) > 50
    parts = {path: re.split(r"[^/]*[<*]", path)[0] for path in paths}
    assert [path for path, part in parts.items() if not any((root / part).exists() for root in roots)] == []


def test_every_kind_of_step_is_on_the_page_of_blocks():
    shown = {kind for samples in SAMPLES.values() for step in samples.values() for kind in step}
    assert KINDS.keys() - shown == set()


def test_no_picture_of_the_documentation_is_large():
    sizes = {path.name: path.stat().st_size for path in (DOCS / "pictures").rglob("*.webp")}
    assert [name for name, size in sizes.items() if size > 100_000] == []
    assert sum(sizes.values()) < 2_000_000


def test_each_promise_names_the_tests_that_attack_it():
    """tests/promises.json has the promises of docs/security.md, and its tests are there."""
    attacks = json.loads((ROOT / "tests" / "promises.json").read_text(encoding="utf-8"))
    promises = (DOCS / "security.md").read_text(encoding="utf-8").partition("## What is not promised")[0]
    promised = re.findall(r"^- (.*)", promises.replace("\n  ", " "), re.MULTILINE)
    assert promised == list(attacks)
    missing = [path for paths in attacks.values() for path in paths if not (ROOT / path).exists()]
    assert missing == []
    assert [promise for promise, paths in attacks.items() if not paths] == []


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "MOTORCADE_STUDIO": "https://studio.example/"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_has_every_page_in_both_languages(site):
    for page in (*(page.relative_to(DOCS).with_suffix("").as_posix() for page in PAGES), *SITE_PAGES):
        for folder in (site, site / "zh"):
            assert (folder / f"{page}.html").is_file()
    assert 'lang="zh"' in (site / "zh" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("language", ["", "zh"])
def test_each_example_and_each_whole_program_opens_in_the_studio(site, language):
    """The links hold what the studio's own requests open and compile."""
    links = {page: links_of(site / language / f"{page}.html") for page in ("programs", "tutorial")}
    shown = [project_in(link) for link in links["programs"]]
    titles = {each.title[language or "en"]: each.id for each in examples()}
    assert {titles[name]: each.leader for name, each in shown if name in titles} == {
        name: example(name).leader for name in titles.values()
    }
    assert [name for name, _ in shown if name not in titles] == ["patrol", "laps"]
    assert [name for name, _ in map(project_in, links["tutorial"])] == ["square", "sheepdog"]
    for _, project in shown:
        compiled = compile_blocks(Blocks(project.leader, project.followers, project.profile))
        assert [each for each in compiled.diagnostics if each.severity == "error"] == []


def links_of(page):
    """The links of a page to the studio."""
    return re.findall(r'href="(https://studio\.example/[^"]*#project=[^"]*)"', page.read_text(encoding="utf-8"))


def project_in(link):
    """The name and the project in a link, read as the page reads it."""
    packed = link.partition("#project=")[2]
    shared = json.loads(zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -zlib.MAX_WBITS))
    return shared["name"], open_text(shared["text"])


def test_the_site_loads_nothing_from_another_host(site):
    asked = set()
    for file in site.rglob("*"):
        if file.suffix in (".html", ".css"):
            for found in LOADED.findall(file.read_text(encoding="utf-8")):
                asked.update(address for address in found if re.match(r"(https?:)?//", address))
    assert asked == set()


def test_the_reference_names_every_public_name(site):
    import motorcade

    told = (site / "api.html").read_text(encoding="utf-8")
    assert [name for name in motorcade.__all__ if name != "__version__" and f'id="motorcade.{name}"' not in told] == []
