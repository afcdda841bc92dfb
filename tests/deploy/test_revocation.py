"""Class of attack: a key that was taken back. In each form of deployment the service sees that its files changed."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.admission.keys import Keyring, Role
from service.errors import UnknownKeyError
from tests.issuing import key_lines

DEPLOY = Path(__file__).parents[2] / "deploy"
ONE, OTHER = key_lines("sesame", ["read"]), key_lines("other", ["read"])


@contextmanager
def in_place(folder: Path) -> Iterator[None]:
    """As `>>` and some editors write."""
    (folder / "keys.toml").write_text(ONE + OTHER)
    yield
    (folder / "keys.toml").write_text(OTHER)


@contextmanager
def replaced(folder: Path) -> Iterator[None]:
    """As most editors, and tools that copy files, write."""
    (folder / "keys.toml").write_text(ONE + OTHER)
    yield
    (folder / "new").write_text(OTHER)
    (folder / "new").rename(folder / "keys.toml")


@contextmanager
def as_if_nothing_had_changed(folder: Path) -> Iterator[None]:
    """Of the same length, and with the time of the old one, as some tools that copy set it."""
    (folder / "keys.toml").write_text(ONE + OTHER)
    before = (folder / "keys.toml").stat()
    yield
    (folder / "keys.toml").write_text(key_lines("change", ["read"]) + OTHER)
    os.utime(folder / "keys.toml", ns=(before.st_atime_ns, before.st_mtime_ns))
    assert (folder / "keys.toml").stat().st_size == before.st_size


@contextmanager
def a_file_each(folder: Path) -> Iterator[None]:
    (folder / "one.toml").write_text(ONE)
    (folder / "other.toml").write_text(OTHER)
    yield
    (folder / "one.toml").unlink()


@contextmanager
def mounted(folder: Path) -> Iterator[None]:
    """As the kubelet mounts a secret, and exchanges it."""
    for version, text in (("..1", ONE + OTHER), ("..2", OTHER)):
        (folder / version).mkdir()
        (folder / version / "keys.toml").write_text(text)
    (folder / "..data").symlink_to("..1")
    (folder / "keys.toml").symlink_to("..data/keys.toml")
    yield
    (folder / "..data_tmp").symlink_to("..2")
    (folder / "..data_tmp").rename(folder / "..data")


@pytest.mark.parametrize("taken_back", [in_place, replaced, as_if_nothing_had_changed, a_file_each, mounted])
def test_a_key_is_refused_however_its_files_change(
    taken_back: Callable[[Path], AbstractContextManager[None]], tmp_path: Path
) -> None:
    """A service that runs reads them again, too: test_roles."""
    first, other = ([(b"authorization", b"Bearer " + key)] for key in (b"sesame", b"other"))
    with taken_back(tmp_path):
        ring = Keyring([], tmp_path)
        assert ring.grant(first).roles == {Role.READ}
    ring.refresh()
    with pytest.raises(UnknownKeyError):
        ring.grant(first)
    assert ring.grant(other).roles == {Role.READ}


def test_the_unit_reads_keys_where_they_are_changed() -> None:
    """LoadCredential= copies a file once, at the start."""
    settings = [line for line in (DEPLOY / "linefix.service").read_text().splitlines() if not line.startswith("#")]
    assert not any(line.startswith(("LoadCredential", "SetCredential", "ImportCredential")) for line in settings)
    (file,) = [line.removeprefix("Environment=LINEFIX_KEYS_FILE=") for line in settings if "LINEFIX_KEYS_FILE=" in line]
    assert Path(file).is_absolute()
    assert not any("LINEFIX_KEYS=" in line for line in settings)


@pytest.mark.parametrize("name", ["compose.yaml", "replicas/compose.yaml"])
def test_containers_have_the_folder_of_the_keys(name: str) -> None:
    """Of a single file that is mounted they keep the old one when it is replaced."""
    linefix = yaml.safe_load((DEPLOY / name).read_text())["services"]["linefix"]
    assert "LINEFIX_KEYS" not in linefix["environment"]
    place = linefix["environment"]["LINEFIX_KEYS_FILE"]
    (source,) = [volume.split(":")[0] for volume in linefix["volumes"] if volume.endswith(f":{place}:ro")]
    assert Path(source).suffix == ""
    assert "keys" not in linefix.get("secrets", ())


def test_a_pod_has_the_folder_of_the_keys() -> None:
    """With a subPath it would keep the files that it had at its start; so it does what the environment says."""
    pod: dict[str, Any] = yaml.safe_load((DEPLOY / "kubernetes" / "deployment.yaml").read_text())
    pod = pod["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    told = {one["name"]: one.get("value") for one in container["env"]}
    assert "LINEFIX_KEYS" not in told
    (mount,) = [one for one in container["volumeMounts"] if one["mountPath"] == told["LINEFIX_KEYS_FILE"]]
    assert "subPath" not in mount
    assert any(one["name"] == mount["name"] and "secret" in one for one in pod["volumes"])


def test_grafana_has_no_password_that_everybody_knows() -> None:
    grafana = yaml.safe_load((DEPLOY / "replicas" / "compose.yaml").read_text())["services"]["grafana"]
    assert grafana["environment"]["GF_SECURITY_ADMIN_PASSWORD"] == "${GRAFANA_PASSWORD:?}"
    assert all(port.startswith("127.0.0.1:") for port in grafana["ports"])
