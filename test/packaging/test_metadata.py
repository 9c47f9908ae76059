"""package.xml, setup.py, CHANGELOG.rst, CITATION.cff and the sources agree."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import pytest
from ruamel.yaml import YAML
from setup_arguments import setup_arguments

import gameinfer_ros
from gameinfer_ros.nodes.table import NODES

ROOT = Path(__file__).parents[2]
OWN = {"gameinfer_ros", "msg_adapters"}


class Origin(NamedTuple):
    """Where a module comes from: its project on PyPI, and its key in rosdep."""

    project: str | None
    key: str | None


def ros(*names: str) -> dict[str, Origin]:
    """Modules of ROS packages, which are no projects on PyPI."""
    return {name: Origin(None, name) for name in names}


def python(*names: str) -> dict[str, Origin]:
    """Modules with the name of their project, and the usual key."""
    return {name: Origin(name, f"python3-{name.replace('_', '-')}") for name in names}


#: Every module that the package imports and Python does not have.
MODULES = {
    **python("aiohttp", "argcomplete", "filelock", "joblib", "matplotlib", "numba", "numpy"),
    **python("pydantic", "rich", "scipy", "typing_extensions"),
    **ros("builtin_interfaces", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rcl_interfaces"),
    **ros("rclpy", "rosgraph_msgs", "sensor_msgs", "std_msgs", "std_srvs", "trajectory_msgs"),
    **ros("visualization_msgs"),
    "PIL": Origin("Pillow", "python3-pil"),
    "dask": Origin("distributed", None),  # only if there is a cluster
    "jinja2": Origin("Jinja2", "python3-jinja2"),
    "llvmlite": Origin("numba", "python3-numba"),  # numba requires one version of it
    "mcap": Origin("mcap", "mcap-ros2-support"),  # which depends on it
    "pydantic_core": Origin("pydantic", "python3-pydantic"),  # likewise of pydantic
    "rosbags": Origin("rosbags", "python3-rosbags-pip"),
    "ruamel": Origin("ruamel.yaml", "python3-ruamel.yaml"),
}

#: Likewise what only tests import, and what they are run by.
TEST_MODULES = {
    **ros("ament_index_python"),
    **python("hypothesis", "packaging", "pytest", "selenium"),
    "mcap_ros2": Origin("mcap-ros2-support", "mcap-ros2-support"),
    "xdist": Origin("pytest-xdist", "python3-pytest-xdist"),
}


@pytest.fixture(scope="module")
def setup() -> dict[str, Any]:
    return setup_arguments()


@pytest.fixture(scope="module")
def package() -> ElementTree.Element:
    """The content of package.xml."""
    return ElementTree.parse(ROOT / "package.xml").getroot()


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    """The content of CITATION.cff."""
    return YAML(typ="safe").load(ROOT / "CITATION.cff")


def text(package: ElementTree.Element, tag: str) -> str:
    (element,) = package.findall(tag)
    return " ".join("".join(element.itertext()).split())


def keys(package: ElementTree.Element, *tags: str) -> list[str]:
    return sorted(element.text or "" for tag in tags for element in package.findall(tag))


def projects(requirements: Iterable[str]) -> set[str]:
    """Names of requirements, without their versions."""
    return {re.split(r"[^\w.-]", requirement)[0] for requirement in requirements}


def imported(folders: Iterable[str]) -> set[str]:
    """Modules that are imported anywhere in these folders, and are not Python's."""
    found = set()
    for path in (path for folder in folders for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names)


def test_the_version_is_the_same_everywhere(
    setup: dict[str, Any], package: ElementTree.Element, citation: dict[str, Any]
) -> None:
    versions = {gameinfer_ros.__version__, setup["version"], text(package, "version")}
    assert versions == {citation["version"]}
    assert re.fullmatch(r"\d+\.\d+\.\d+", citation["version"])


def test_name_people_and_licence_are_the_same_everywhere(
    setup: dict[str, Any], package: ElementTree.Element, citation: dict[str, Any]
) -> None:
    assert {setup["name"], text(package, "name"), citation["title"]} == {"gameinfer_ros"}
    assert {setup["license"], text(package, "license"), citation["license"]} == {"Apache-2.0"}
    assert (setup["maintainer"], setup["author"]) == (
        text(package, "maintainer"),
        text(package, "author"),
    )
    assert package.find("maintainer").attrib == {"email": setup["maintainer_email"]}
    assert [author["name"] for author in citation["authors"]] == [setup["author"]]
    licence = package.find("license").attrib["file"]
    assert "Apache License" in (ROOT / licence).read_text(encoding="utf-8")


def test_what_is_imported_is_declared_and_nothing_else(
    setup: dict[str, Any], package: ElementTree.Element
) -> None:
    assert imported(OWN) - OWN == set(MODULES)
    wanted = {origin.project for origin in MODULES.values()} - {None}
    optional = projects(setup["extras_require"]["dask"])
    assert projects(setup["install_requires"]) | optional == wanted
    keys_wanted = {origin.key for origin in MODULES.values()} - {None}
    assert keys(package, "depend", "exec_depend") == sorted(keys_wanted)


def test_what_tests_import_is_declared_and_nothing_else(
    setup: dict[str, Any], package: ElementTree.Element
) -> None:
    files = [path for folder in ("test", "benchmarks") for path in (ROOT / folder).rglob("*.py")]
    own = {path.stem for path in files} | {"gameinfer_docs"}
    used = imported(["test", "benchmarks"]) | {"xdist"}  # which only `./dev test` uses
    assert used - OWN - own - set(MODULES) == set(TEST_MODULES)
    wanted = {origin.project for origin in TEST_MODULES.values()} - {None}
    extra = projects(setup["extras_require"]["test"])
    assert extra == wanted | projects(setup["extras_require"]["dask"])
    # What the package itself needs is there anyway.
    own_keys = {origin.key for origin in MODULES.values()}
    keys_wanted = {origin.key for origin in TEST_MODULES.values()} - own_keys
    assert keys(package, "test_depend") == sorted(keys_wanted)


def test_the_form_of_package_xml(package: ElementTree.Element) -> None:
    assert (package.tag, package.attrib) == ("package", {"format": "3"})
    assert text(package, "export/build_type") == "ament_python"
    order = ["name", "version", "description", "maintainer", "license", "author"]
    assert [element.tag for element in package][: len(order)] == order


def test_ros2_run_finds_every_executable_that_pip_installs(
    setup: dict[str, Any], tmp_path: Path
) -> None:
    install = [sys.executable, "setup.py", "-q", "install_data", "--install-dir", str(tmp_path)]
    subprocess.run(install, cwd=ROOT, capture_output=True, check=True)
    (tmp_path / "bin").mkdir()
    names = {entry.partition(" = ")[0] for entry in setup["entry_points"]["console_scripts"]}
    assert {"gameinfer", "orchestrator", *NODES} == names
    assert {path.name for path in (tmp_path / "lib/gameinfer_ros").iterdir()} == names
    for name in names:
        script = tmp_path / "bin" / name
        script.write_text('#!/bin/sh\necho "$0: $*"\n')
        script.chmod(0o755)
        link = tmp_path / f"link_to_{name}"
        link.symlink_to(tmp_path / "lib/gameinfer_ros" / name)
        done = subprocess.run([link, "one", "two"], capture_output=True, text=True, check=True)
        assert Path(done.stdout.partition(": ")[0]).resolve() == script
        assert done.stdout.endswith(": one two\n")


def test_executables_import_little(setup: dict[str, Any]) -> None:
    modules = {
        entry.partition(" = ")[2].partition(":")[0]
        for entry in setup["entry_points"]["console_scripts"]
    }
    lines = [f"import {module}" for module in modules]
    code = "\n".join(["import sys", *lines, "print(*sys.modules, sep='\\n')"])
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    heavy = set(MODULES) - {"argcomplete", "typing_extensions"}
    assert not heavy & {module.split(".")[0] for module in done.stdout.splitlines()}


def test_the_changelog_has_the_form_of_rep_132(setup: dict[str, Any]) -> None:
    lines = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8").splitlines()
    assert lines[1] == "Changelog for package gameinfer_ros"
    assert lines[0] == lines[2] == "^" * len(lines[0]) and len(lines[0]) >= len(lines[1])
    titles = [
        title
        for title, line in pairwise(lines)
        if re.fullmatch("-+", line) and len(line) == len(title)
    ]
    assert titles, "there is no section"
    released = titles[1:] if titles[0] == "Forthcoming" else titles
    for title in released:
        assert re.fullmatch(r"\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)", title), title
    if released:
        assert released[0].split()[0] == setup["version"]


def test_the_citation_has_the_form_of_cff(citation: dict[str, Any]) -> None:
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] == "software"
    assert {"message", "title", "authors"} <= set(citation)
    (paper,) = citation["references"]
    assert paper["type"] == "conference-paper" and paper["year"] == 2020
    assert paper["title"].startswith("Inference-Based Strategy Alignment for General-Sum")
    names = ["Peters", "Fridovich-Keil", "Tomlin", "Sunberg"]
    assert [author["family-names"] for author in paper["authors"]] == names


def documents() -> list[Path]:
    return sorted(ROOT.glob("*.md"))


def test_the_documents_of_a_repository_are_there() -> None:
    names = {path.name for path in documents()}
    assert {"README.md", "CONTRIBUTING.md", "QUALITY_DECLARATION.md"} <= names
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in ("CONTRIBUTING.md", "QUALITY_DECLARATION.md", "CITATION.cff", "LICENSE"):
        assert f"]({name})" in readme


@pytest.mark.parametrize("document", documents(), ids=lambda path: path.name)
def test_links_of_documents_lead_somewhere(document: Path) -> None:
    content = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", content):
        assert (document.parent / target).exists(), target
