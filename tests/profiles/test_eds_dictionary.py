"""Data sheets as makers write them, and files that are none."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_profiles import ProfileError, load_drive
from cdpr_profiles.eds.dictionary import load_dictionary

EDS = load_drive("generic-cia402").eds


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_names_in_the_encodings_that_makers_use(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.EDS"
    text = EDS.read_text("utf-8").replace("ParameterName=Statusword", "ParameterName=Wärme")
    path.write_bytes(text.replace("\n", "\r\n").encode(encoding))
    dictionary = load_dictionary(path, 5)
    assert dictionary[0x6041].name == "Wärme"
    assert dictionary[0x1800][1].default & 0x7FF == 0x185


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[DeviceInfo]\n", "object 1000h is missing"),
        (b"\xd2\x00\xff nothing of the kind" * 50, "is no EDS: File contains no section headers"),
        (EDS.read_bytes().replace(b"0x0007", b"seven"), "is no EDS: invalid literal"),
    ],
)
def test_a_file_that_is_none_is_told_by_name(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=r"drive\.eds: ") as told:
        load_dictionary(path)
    assert words in str(told.value)
    assert "\n" not in str(told.value)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="is no regular file"):
        load_dictionary(tmp_path)
