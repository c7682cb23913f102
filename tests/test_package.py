"""What an installed package holds: built here, from the checkout and again from the source archive."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import softnlp

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
NAME = f"softnlp-{PROJECT['version']}"


def build(source: Path, target: str, into: Path) -> Path:
    """Build without a network: the backend is among the tools for development."""
    words = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(into)]
    subprocess.run(words, cwd=source, check=True, capture_output=True, timeout=60)
    (made,) = into.glob("*.whl" if target == "wheel" else "*.tar.gz")
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    return zipfile.ZipFile(build(ROOT, "wheel", tmp_path_factory.mktemp("wheel")))


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sdist")
    with tarfile.open(build(ROOT, "sdist", folder)) as file:
        file.extractall(folder, filter="data")
    return folder / NAME


def files(folder: Path, pattern: str) -> set[str]:
    return {file.relative_to(folder).as_posix() for file in folder.rglob(pattern) if file.is_file()}


def test_the_wheel_holds_the_package_its_data_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    expected = {f"softnlp/{name}" for kind in ("*.py", "*.js", "*.html") for name in files(ROOT / "softnlp", kind)}
    expected |= {"softnlp/py.typed"}
    expected |= {"softnlp/materials.toml"} | {f"softnlp/scenarios/{name}" for name in files(ROOT / "scenarios", "*.*")}
    about = {f"{NAME}.dist-info/{name}" for name in ("METADATA", "RECORD", "WHEEL", "entry_points.txt")}
    assert set(wheel.namelist()) == expected | about | {f"{NAME}.dist-info/licenses/LICENSE"}
    assert wheel.read("softnlp/materials.toml") == (ROOT / "materials.toml").read_bytes()


def test_the_wheel_says_what_it_is(wheel: zipfile.ZipFile) -> None:
    about = Parser().parsestr(wheel.read(f"{NAME}.dist-info/METADATA").decode())
    assert (about["Name"], about["Version"], about["Requires-Python"]) == ("softnlp", PROJECT["version"], ">=3.11")
    assert about["License-Expression"] == "MIT"
    assert "Typing :: Typed" in about.get_all("Classifier", [])
    assert "# softnlp" in about.get_payload()  # the README
    assert "softnlp = softnlp.cli:main" in wheel.read(f"{NAME}.dist-info/entry_points.txt").decode()


def test_the_source_archive_makes_the_same_wheel(archive: Path, wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    again = zipfile.ZipFile(build(archive, "wheel", tmp_path))
    assert set(again.namelist()) == set(wheel.namelist())
    assert all(again.read(name) == wheel.read(name) for name in wheel.namelist())


def test_the_source_archive_holds_what_the_tests_need(archive: Path) -> None:
    for name in ("README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "materials.toml"):
        assert (archive / name).read_bytes() == (ROOT / name).read_bytes()
    for folder in ("tests", "docs", "scenarios", "benchmarks"):
        assert files(archive / folder, "*.py") == files(ROOT / folder, "*.py")
        assert files(archive / folder, "*.md") == files(ROOT / folder, "*.md")
    assert not list(archive.rglob("*.pyc"))


def test_the_version_stands_in_one_place() -> None:
    # everything else asks the installed package; the change log has a section for it
    assert softnlp.__version__ == PROJECT["version"]
    assert f"\n## [{PROJECT['version']}]" in (ROOT / "CHANGELOG.md").read_text()
