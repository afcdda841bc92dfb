"""Files in deploy/: read as their programs read them, and run if the program is installed."""

from __future__ import annotations

import configparser
import os
import re
import shutil
import socket
import ssl
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import httpx
import pytest
import trustme
from ruamel.yaml import YAML

from examples.running import free_port
from linefix.documents import examples
from service.database_location import database_url
from service.settings import Settings
from tests.deploy.replicas import DEPLOY, changed, temporary
from tests.issuing import key_lines
from tests.running import JSON, RunningService, answers, until

ROOT = DEPLOY.parent
SETTING = re.compile(r"LINEFIX_([A-Z_]+)")


@pytest.mark.parametrize("name", ["compose.yaml", "linefix.service", "nginx.conf"])
def test_every_setting_is_one(name: str) -> None:
    found = {setting.lower() for setting in SETTING.findall((DEPLOY / name).read_text())}
    assert found
    assert found - {"kernels"} <= set(Settings.model_fields)


def test_compose_names_what_it_uses() -> None:
    document = YAML(typ="safe").load((DEPLOY / "compose.yaml").read_text())
    pytest.importorskip("compose_spec").PyCompose.from_yaml((DEPLOY / "compose.yaml").read_text()).validate()
    services = document["services"]
    assert set(services) == {"linefix", "postgres"}
    for service in services.values():
        assert set(service["secrets"]) <= set(document["secrets"])
        named = {volume.split(":")[0] for volume in service.get("volumes", ())}
        assert named <= {*document["volumes"], "../secrets/keys"}
    for secret in document["secrets"].values():
        assert (DEPLOY / secret["file"]).resolve().parent == ROOT / "secrets"
    linefix = services["linefix"]
    assert (DEPLOY / linefix["build"]).resolve() == ROOT
    assert linefix["cap_drop"] == ["ALL"]
    assert linefix["read_only"] is True
    assert all(port.startswith("127.0.0.1:") for port in linefix["ports"])
    url = database_url(linefix["environment"]["LINEFIX_DATABASE_URL"])
    assert url.password is None
    database = services["postgres"]["environment"]
    assert (url.host, url.username, url.database) == ("postgres", database["POSTGRES_USER"], database["POSTGRES_DB"])


def test_the_forge_runs_what_a_checkout_has_to_pass() -> None:
    jobs = YAML(typ="safe").load((ROOT / ".github" / "workflows" / "ci.yml").read_text())["jobs"]
    commands = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert ".ci/run" in commands
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    made = [word for line in commands if line.startswith("make ") for word in line.split()[1:] if "=" not in word]
    assert made
    assert set(made) <= set(targets)
    for template in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"):
        assert YAML(typ="safe").load(template.read_text()), template
    assert YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())["title"] == "Linefix"


def unit_of(name: str) -> configparser.RawConfigParser:
    unit = configparser.RawConfigParser(strict=False)
    unit.optionxform = str  # type: ignore[method-assign,assignment]
    unit.read(DEPLOY / name)
    return unit


@pytest.mark.parametrize(("name", "command"), [("linefix.service", "serve"), ("linefix-ros2.service", "ros2")])
def test_the_unit_is_one(name: str, command: str) -> None:
    unit = unit_of(name)
    assert unit["Service"]["ExecStart"].split()[1] == command
    assert unit["Service"]["DynamicUser"] == "yes"
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd-analyze")
    verify = ["systemd-analyze", "verify", "--man=no", str(DEPLOY / name)]
    told = subprocess.run(verify, capture_output=True, text=True, check=False).stderr
    # That the program is not where the unit expects it is all that may be said of it here.
    wrong = [line for line in told.splitlines() if name in line and "not executable" not in line]
    assert wrong == []


def test_units_with_users_of_their_own_share_no_folder() -> None:
    """Else systemd takes the folder from the unit that runs, and gives it to the one that starts."""
    units = {name: unit_of(name)["Service"] for name in ("linefix.service", "linefix-ros2.service")}
    for kind in ("StateDirectory", "CacheDirectory"):
        folders = [folder for unit in units.values() for folder in unit.get(kind, "").split()]
        assert len(folders) == len(set(folders)), kind
    for name, unit in units.items():
        assert f"LINEFIX_KERNELS=%C/{unit['CacheDirectory']}\n" in (DEPLOY / name).read_text()


def nginx(service_port: int, port: int, folder: Path) -> list[str]:
    """Write its configuration with the test's ports and files; return the command that runs it."""
    made = trustme.CA().issue_cert("127.0.0.1")
    (folder / "tls.crt").write_bytes(b"".join(blob.bytes() for blob in made.cert_chain_pems))
    made.private_key_pem.write_to_path(str(folder / "tls.key"))
    user = "user root;\n" if os.geteuid() == 0 else ""  # its usual one cannot read the test's folder
    changes = {
        "127.0.0.1:8000": f"127.0.0.1:{service_port}",
        "listen 443 ssl": f"listen 127.0.0.1:{port} ssl",
        "/etc/linefix": str(folder),
        "events {": f"{user}daemon off;\npid {folder}/pid;\nerror_log {folder}/error.log;\nevents {{",
        "http {": f"http {{\n{temporary(folder)}",
    }
    written = changed(DEPLOY / "nginx.conf", folder, changes)
    return ["nginx", "-e", str(folder / "error.log"), "-c", str(written)]


def caddy(service_port: int, port: int, folder: Path) -> list[str]:
    """Write its configuration with the test's ports, and a certificate of its own; return the command that runs it."""
    changes = {
        "127.0.0.1:8000": f"127.0.0.1:{service_port}",
        "linefix.example {": f"{{\nadmin off\nskip_install_trust\n}}\nhttps://127.0.0.1:{port} {{\ntls internal",
    }
    written = changed(DEPLOY / "Caddyfile", folder, changes)
    data = ["env", f"XDG_DATA_HOME={folder}", f"XDG_CONFIG_HOME={folder}", f"HOME={folder}"]
    return [*data, "caddy", "run", "--adapter", "caddyfile", "--config", str(written)]


Proxy = Callable[[int, int, Path], list[str]]
BEARER = {"authorization": "Bearer sesame"}


@contextmanager
def behind(proxy: Proxy, service: RunningService, folder: Path, *, elsewhere: bool = False) -> Iterator[httpx.Client]:
    """Put a proxy in front of a service; it takes us for a client on this machine, or on another one."""
    if shutil.which(proxy.__name__) is None:
        pytest.skip(f"no {proxy.__name__}")
    port = free_port()
    command = proxy(service.port, port, folder)
    if elsewhere:
        (written,) = [path for path in (folder / "nginx.conf", folder / "Caddyfile") if path.exists()]
        rule = "allow 127.0.0.1;" if proxy is nginx else "not remote_ip 127.0.0.1"
        assert rule in written.read_text()
        written.write_text(written.read_text().replace(rule, ""))
    with (folder / "proxy.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        with httpx.Client(base_url=f"https://127.0.0.1:{port}", headers=JSON, verify=False, timeout=60) as client:
            until(lambda: answers(client))
            yield client
    finally:
        process.terminate()
        process.wait(60)


@pytest.mark.long
@pytest.mark.parametrize("proxy", [nginx, caddy])
def test_a_proxy_stands_in_front(proxy: Proxy, start_service: Callable[..., RunningService], tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    keys.write_text(key_lines("sesame", ["associate"]))
    with behind(proxy, start_service(keys_file=keys), tmp_path) as client:
        assert client.post("/v1/associate", json=examples.ASSOCIATE, headers=BEARER).status_code == 200
        assert client.post("/v1/associate", json=examples.ASSOCIATE).json()["code"] == "unauthorized"
        assert client.put("/v1/maps/m", json=examples.MAP, headers=BEARER).json()["code"] == "forbidden"
        assert client.post("/v1/associate", content=b" " * 34_000_000, headers=BEARER).status_code == 413
        assert client.get("/metrics").status_code == 200  # from here


def silent(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port))


def in_a_handshake(port: int) -> socket.socket:
    connection = silent(port)
    connection.sendall(b"\x16\x03\x01")
    return connection


def in_a_head(port: int) -> socket.socket:
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    connection = context.wrap_socket(silent(port))
    connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nX-A: a")
    return connection


@pytest.mark.long
@pytest.mark.parametrize(("kind", "count"), [(silent, 600), (in_a_handshake, 600), (in_a_head, 100)])
def test_connections_that_say_little_end_at_nginx(
    kind: Callable[[int], socket.socket], count: int, start_service: Callable[..., RunningService], tmp_path: Path
) -> None:
    """The service alone would refuse other clients: it serves seven connections, and ends none of them in time."""
    running = start_service(max_connections=8, request_timeout_s=600)
    with ExitStack() as held, behind(nginx, running, tmp_path) as client:
        connections = [held.enter_context(kind(client.base_url.port or 0)) for _ in range(count)]
        assert httpx.get(f"{client.base_url}/livez", verify=False, timeout=60).status_code == 200
        connections[0].settimeout(60)
        with suppress(ConnectionError):
            assert connections[0].recv(65_536) == b""  # nginx ends it


CONTROLS = ("%0A", "%0D%0A", "%00", "%09", "%7F", "%C2%85", "%E2%80%A8", "%23", "%3F", "%2F", "/", ";x", "%20", "#x")
WRITINGS = ("//metrics", "/./metrics", "/x/../metrics", "/x/%2e%2e/metrics", "/%6detrics", "/METRICS", "/%0A/metrics")


@pytest.mark.long
@pytest.mark.parametrize("proxy", [nginx, caddy])
def test_no_way_of_writing_a_path_passes_its_rule(proxy: Proxy, service: RunningService, tmp_path: Path) -> None:
    """Class of attack: two that read one path differently."""
    with behind(proxy, service, tmp_path, elsewhere=True) as client:
        assert client.get("/metrics").status_code == 403
        for path in [*(f"/metrics{control}" for control in CONTROLS), *WRITINGS]:
            answer = client.get("/", extensions={"target": path.encode()})  # as it stands there
            assert answer.status_code in (400, 403, 404), path
            assert "linefix_" not in answer.text, path
