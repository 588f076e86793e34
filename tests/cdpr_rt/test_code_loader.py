"""Code of the user's own: from files, modules and packages, and what must be allowed first."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from cdpr_rt.code_loader import (
    CodeError,
    load_allowed,
    load_code,
    load_registered,
    load_registered_one,
    require_allowed,
)

GROUP = "cdpr_rt.tests"


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def test_a_name_in_a_file_or_module_is_loaded_and_classes_are_instantiated(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from dataclasses import dataclass\n@dataclass\nclass Mine:\n    n: int = 3\nfive = 5\n"
    )
    assert load_code(f"{file}:Mine").n == 3
    assert load_code(f"{file}:five") == 5
    assert load_code("math:tau") == pytest.approx(6.283, abs=1e-3)


def test_a_file_imports_modules_of_its_folder_but_they_replace_no_installed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "gains_of_mine.py").write_text("stiff = 3000.0\n")
    (tmp_path / "colorsys.py").write_text("raise RuntimeError('replaced')\n")
    file = tmp_path / "mine.py"
    file.write_text("import colorsys\nfrom gains_of_mine import stiff\n")
    assert load_code(f"{file}:stiff") == 3000.0


@pytest.mark.parametrize(
    ("reference", "text"),
    [
        ("{}:Missing", "has no attribute 'Missing'"),
        ("{}.py:Mine", "cannot be read: No such file"),
        ("no_such_module:Mine", "ModuleNotFoundError"),
        ("mine", "give FILE.py:NAME or MODULE:NAME"),
        ("", "give FILE.py:NAME or MODULE:NAME"),
    ],
)
def test_code_that_cannot_be_loaded_is_named(tmp_path: Path, reference: str, text: str) -> None:
    file = tmp_path / "mine.py"
    file.write_text("")
    named = reference.format(file)
    with pytest.raises(CodeError, match=text) as error:
        load_code(named)
    assert str(error.value).startswith(named)


@pytest.mark.parametrize("source", ["raise SystemExit(3)", "1 / 0", "def broken(:", "x = '\\0'\0"])
def test_code_that_fails_while_it_is_loaded_is_one_error(tmp_path: Path, source: str) -> None:
    file = tmp_path / "mine.py"
    file.write_text(source)
    with pytest.raises(CodeError, match=r"mine\.py:Mine: \w+"):
        load_code(f"{file}:Mine")


def test_an_edit_within_the_same_second_is_not_missed(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    for value in (1, 2):
        file.write_text(f"value = {value}\n")
        os.utime(file, (1e9, 1e9))
        assert load_code(f"{file}:value") == value
    assert not (tmp_path / "__pycache__").exists()


def test_a_file_runs_only_with_the_content_that_was_allowed(tmp_path: Path) -> None:
    file, ran = tmp_path / "mine.py", tmp_path / "ran"
    source = f"open({str(ran)!r}, 'w').close()\nvalue = 1\n"
    file.write_text(source)
    with pytest.raises(CodeError, match=r"code that would run with your rights; .* --allow-code"):
        load_allowed("mine.py:value", tmp_path)
    require_allowed("mine.py:value", tmp_path, allow=True)
    assert not ran.exists()
    assert load_allowed("mine.py:value", tmp_path) == 1
    file.write_text(source.replace("value = 1", "value = 2"))
    with pytest.raises(CodeError, match="has changed since you allowed it"):
        load_allowed("mine.py:value", tmp_path)
    require_allowed("mine.py:value", tmp_path, allow=True)
    assert load_allowed("mine.py:value", tmp_path) == 2
    (tmp_path / "copy.py").write_bytes(file.read_bytes())
    with pytest.raises(CodeError, match=r"copy\.py is code that would run with your rights; read"):
        load_allowed("copy.py:value", tmp_path)


def package(folder: Path, entry: str) -> None:
    """Install a package `of-others` with an entry point in `folder`."""
    info = folder / "of_others-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: of-others\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{entry}\n")
    (folder / "of_others.py").write_text("class Mine:\n    pass\n")


def test_installed_packages_register_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_registered(GROUP) == {}
    with pytest.raises(CodeError, match="mine: no installed package registers this name"):
        load_registered_one(GROUP, "mine")
    package(tmp_path, "mine = of_others:Mine")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert type(load_registered_one(GROUP, "mine")).__name__ == "Mine"
    assert list(load_registered(GROUP)) == ["mine"]


def test_a_package_whose_code_fails_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package(tmp_path, "mine = of_others:Missing")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(CodeError, match="mine of the package of-others: AttributeError"):
        load_registered(GROUP)
