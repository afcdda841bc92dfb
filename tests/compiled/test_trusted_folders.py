"""Class of attack: code from a place that others may write to."""

from __future__ import annotations

import grp
import os
from pathlib import Path

import pytest

from compiled.trusted_folders import is_trusted_file, why_untrusted

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners here")
as_root = pytest.mark.skipif(os.name == "nt" or os.geteuid() != 0, reason="only root gives files away")


@pytest.fixture
def own(tmp_path: Path) -> Path:
    folder = tmp_path / "above" / "kernels"
    folder.mkdir(parents=True)
    for path in (tmp_path, folder.parent, folder):
        path.chmod(0o755)
    return folder


def test_a_folder_of_ones_own_is_trusted(own: Path) -> None:
    assert why_untrusted(own) is None
    assert why_untrusted(own / "not" / "there" / "yet") is None
    own.chmod(0o700)
    assert why_untrusted(own) is None


@pytest.mark.parametrize("mode", [0o777, 0o757, 0o702, 0o1777])
def test_a_folder_for_everybody_is_not(own: Path, mode: int) -> None:
    own.chmod(mode)
    assert "everybody" in str(why_untrusted(own))
    assert f"{mode:04o}" in str(why_untrusted(own))


def test_nor_is_one_below_a_folder_for_everybody(own: Path) -> None:
    own.parent.chmod(0o777)
    for folder in (own, own / "later"):
        assert str(own.parent) in str(why_untrusted(folder))
    own.parent.chmod(0o1777)  # as /tmp: what is there already stays its owner's
    assert why_untrusted(own) is None


def test_nor_is_one_that_is_still_to_be_made_where_everybody_may_make_it(own: Path) -> None:
    """In /tmp anybody may have made it first: it is looked at again once it is there."""
    own.chmod(0o777)
    assert why_untrusted(own / "later") is not None


def test_a_link_is_followed(own: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(own)
    assert why_untrusted(link) is None
    own.chmod(0o777)
    assert str(own) in str(why_untrusted(link))


@as_root
def test_a_folder_of_somebody_else_is_not(own: Path) -> None:
    os.chown(own, 12345, 0)
    assert "user 12345" in str(why_untrusted(own))
    os.chown(own, 0, 0)
    os.chown(own.parent, 12345, 0)
    assert str(own.parent) in str(why_untrusted(own))


@as_root
def test_a_group_counts_unless_it_is_ones_own(own: Path) -> None:
    own.chmod(0o775)
    assert why_untrusted(own) is None  # of root's
    other = next(group.gr_gid for group in grp.getgrall() if group.gr_gid not in (0, os.getegid()))
    os.chown(own, -1, other)
    assert f"group {other}" in str(why_untrusted(own))


def test_files(own: Path) -> None:
    file = own / "kernel"
    file.write_bytes(b"")
    file.chmod(0o644)
    assert is_trusted_file(file)
    file.chmod(0o666)
    assert not is_trusted_file(file)
    file.chmod(0o644)
    link = own / "link"
    link.symlink_to(file)
    assert not is_trusted_file(link)
    assert not is_trusted_file(own)
    with pytest.raises(FileNotFoundError):
        is_trusted_file(own / "none")
