"""The locks fit setup.py, are whole, and are what gets installed."""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

import pytest
from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from setup_arguments import setup_arguments

ROOT = Path(__file__).parents[2]
REQUIREMENTS = ROOT / "requirements"
LOCKS = sorted(path.stem for path in REQUIREMENTS.glob("*.in"))
PYTHONS = ("3.10.0", "3.11.4", "3.12.3", "3.13.0")


class Pin(NamedTuple):
    """One version of a project, for some environments."""

    name: str
    version: str
    marker: Marker | None
    hashes: tuple[str, ...]

    def counts(self, environment: dict[str, str]) -> bool:
        return self.marker is None or self.marker.evaluate(environment)


def read(lock: str) -> list[Pin]:
    text = (REQUIREMENTS / f"{lock}.txt").read_text(encoding="utf-8")
    pins = []
    for line in text.replace("\\\n", " ").splitlines():
        words, *hashes = re.split(r"\s+--hash=", line.strip())
        requirement = Requirement(words)
        (version,) = requirement.specifier
        assert version.operator == "==", line
        name = canonicalize_name(requirement.name)
        pins.append(Pin(name, version.version, requirement.marker, tuple(hashes)))
    return pins


def environment(python: str) -> dict[str, str]:
    """What markers ask for, on Linux and with this version of CPython."""
    return {
        "implementation_name": "cpython",
        "implementation_version": python,
        "os_name": "posix",
        "platform_machine": "x86_64",
        "platform_python_implementation": "CPython",
        "platform_system": "Linux",
        "python_full_version": python,
        "python_version": python.rpartition(".")[0],
        "sys_platform": "linux",
        "extra": "",
    }


def wanted(lock: str) -> list[Requirement]:
    """What the lock is made for."""
    lines: list[str] = (REQUIREMENTS / f"{lock}.in").read_text(encoding="utf-8").splitlines()
    if lock in ("wheels", "native"):
        given = setup_arguments()
        lines += given["install_requires"]
        lines += [line for extra in given["extras_require"].values() for line in extra]
    return [Requirement(line) for line in lines if not line.startswith("#")]


def check(requirements: Iterable[Requirement], pins: dict[str, Pin]) -> None:
    for requirement in requirements:
        name = canonicalize_name(requirement.name)
        assert name in pins, f"{requirement} is not in the lock: renew it"
        assert requirement.specifier.contains(pins[name].version, prereleases=True), (
            f"{pins[name].version} of the lock is not {requirement}: renew it"
        )


@pytest.mark.parametrize("lock", LOCKS)
@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_has_one_version_of_all_that_is_wanted(lock: str, python: str) -> None:
    here = environment(python)
    pins = [pin for pin in read(lock) if pin.counts(here)]
    names = [pin.name for pin in pins]
    assert len(names) == len(set(names))
    asked = [r for r in wanted(lock) if r.marker is None or r.marker.evaluate(here)]
    assert asked
    check(asked, {pin.name: pin for pin in pins})


@pytest.mark.parametrize("lock", LOCKS)
def test_every_version_of_a_lock_has_hashes(lock: str) -> None:
    for pin in read(lock):
        assert pin.hashes, pin.name
        for digest in pin.hashes:
            assert re.fullmatch(r"sha256:[0-9a-f]{64}", digest), pin.name


@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_has_what_its_projects_need(python: str) -> None:
    here = environment(python)
    pins = {pin.name: pin for pin in read("wheels") if pin.counts(here)}
    looked = 0
    for distribution in metadata.distributions():
        pin = pins.get(canonicalize_name(distribution.name))
        if pin is None or pin.version != distribution.version:
            continue
        looked += 1
        needs = [Requirement(line) for line in distribution.requires or []]
        check((n for n in needs if n.marker is None or n.marker.evaluate(here)), pins)
    if not looked:
        pytest.skip("nothing of the lock is installed here")


def test_dev_installs_nothing_but_what_the_locks_hold() -> None:
    script = (ROOT / "dev").read_text(encoding="utf-8")
    (install,) = re.findall(r"^install\(\) \{\n.*?^\}", script, re.DOTALL | re.MULTILINE)
    joined = install.replace("\\\n", " ")
    commands = [
        line for line in joined.splitlines() if re.search(r"(pip\[@\]}\"|uv\" pip) inst", line)
    ]
    assert len(commands) == 4
    (locked,) = re.findall(r"local locked=\((.*)\)", joined)
    assert "--require-hashes" in locked and "--no-build-isolation" in locked
    for command in commands:
        assert (
            "--require-hashes" in command
            or '"${locked[@]}"' in command
            or ("--no-index --no-deps --no-build-isolation" in command)
        ), command
