"""Settings: the command line beats ``LINEFIX_<NAME>`` beats the default."""

from __future__ import annotations

import argparse
import ipaddress
import os
import re
import ssl
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import AllowInfNan, Field, SecretStr, StringConstraints, ValidationError, field_validator
from pydantic_settings import BaseSettings, CliSettingsSource, NoDecode, SettingsConfigDict
from sqlalchemy import URL

from linefix.documents.limits import Limits
from linefix.documents.strict import descriptions_of

from .admission.keys import KeyFileError, read_keys
from .database_location import database_url

Finite = Annotated[float, AllowInfNan(False)]
HELP = "Start the service. Each option may also be set in the environment, as LINEFIX_ and its name: LINEFIX_PORT=8001."
# Value names in the help for settings that are no numbers, and for defaults that are found when the service starts.
_METAVARS = {
    "host": "ADDRESS",
    "data_dir": "DIRECTORY",
    "database_url": "URL",
    "keys_file": "PATH",
    "hosts": "NAME,...",
    "cors_origins": "ORIGIN,...",
    "tls_cert": "PATH",
    "tls_key": "PATH",
    "log_level": "LEVEL",
}
_DEFAULTS = {"data_dir": "~/.local/share/linefix", "searches": "the cores"}
_ORIGIN = re.compile(r"https?://[a-z0-9.-]+(:[0-9]+)?|https?://\[[0-9a-f:]+\](:[0-9]+)?")
_PRINTABLE = re.compile(r"[!-~]+")


def _data_home() -> Path:
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "linefix"


def _cores() -> int:
    """Return how many cores this process may use, a container's quota included."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        if quota != "max":
            cores = min(cores, max(1, int(quota) // int(period)))
    except (OSError, ValueError):
        pass
    return cores


class SettingsError(Exception):
    """The settings contradict each other or are out of range; the message names them."""


class Settings(BaseSettings):
    """Settings of the service.

    Attributes
    ----------
    host
        address to listen on
    port
        port to listen on; 0 takes a free one
    data_dir
        folder of the map store (SQLite)
    database_url
        postgresql://user:password@host/name or sqlite:///path; default: SQLite in the data directory
    keys
        bearer keys with all rights, comma separated
    keys_file
        file with keys and roles, or folder of such files; a change applies within 2 s
    hosts
        without keys: accepted host names in the Host header, comma separated
    cors_origins
        sites whose pages may send requests, as https://site.example, comma separated
    tls_cert
        file of the certificate chain, PEM; the service then accepts HTTPS only
    tls_key
        file of the private key, PEM, without a password
    allow_anonymous
        accept every client: listen on other addresses than loopback without keys
    workers
        processes that share the port, the searches and the queue
    searches
        searches that run at once
    queue
        maximum number of requests that wait for a search
    max_body_bytes
        maximum bytes of a request, uncompressed
    max_values
        maximum number of numbers, strings, arrays and objects in a request
    max_bodies_bytes
        maximum bytes of all requests that are being read, uncompressed; half of it for one key
    max_answers_bytes
        maximum bytes of large answers that wait to be read; half of it for one key
    max_stored_bytes
        maximum bytes of all stored maps
    max_import_bytes
        maximum bytes of memory of a process that reads an import; at most two run, of different keys
    max_connections
        number of open connections at which further requests are refused
    max_map_segments
        maximum number of segments of a map, and of its points
    max_scan_segments
        maximum number of segments of a scan
    max_beams
        maximum number of ranges or points of a scan
    max_correspondences
        maximum number of correspondences of a registration
    max_batch
        maximum number of scans of a batch
    max_deadline_ms
        longest deadline of a request in milliseconds, and the default
    cache_bytes
        bytes of indexed maps that are cached in memory
    request_timeout_s
        seconds for the body of a request, and between two requests of a connection
    drain_s
        seconds of answering after SIGTERM, while /readyz returns 503
    log_level
        level of the log on stderr: debug, info, warning or error
    """

    model_config = SettingsConfigDict(
        env_prefix="LINEFIX_",
        extra="forbid",
        cli_kebab_case=True,
        cli_implicit_flags=True,
        frozen=True,
    )

    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535)
    data_dir: Path = Field(default_factory=_data_home)
    database_url: SecretStr | None = None
    keys: Annotated[tuple[SecretStr, ...], NoDecode] = ()
    keys_file: Path | None = None
    hosts: Annotated[tuple[Annotated[str, StringConstraints(to_lower=True)], ...], NoDecode] = ()
    cors_origins: Annotated[tuple[str, ...], NoDecode] = ()
    tls_cert: Path | None = None
    tls_key: Path | None = None
    allow_anonymous: bool = False

    workers: int = Field(1, ge=1, le=256)
    searches: int = Field(default_factory=_cores, ge=1, le=1024)
    queue: int = Field(16, ge=0, le=10_000)
    max_body_bytes: int = Field(32_000_000, ge=1_000, le=1_000_000_000)
    max_values: int = Field(2_000_000, ge=1_000)
    max_bodies_bytes: int = Field(96_000_000, ge=1_000)
    max_answers_bytes: int = Field(64_000_000, ge=1_000)
    max_stored_bytes: int = Field(4_000_000_000, ge=1_000)
    max_import_bytes: int = Field(1_000_000_000, ge=400_000_000)
    max_connections: int = Field(512, ge=8, le=100_000)
    max_map_segments: int = Field(200_000, ge=1)
    max_scan_segments: int = Field(2_000, ge=1)
    max_beams: int = Field(20_000, ge=1)
    max_correspondences: int = Field(200_000, ge=1)
    max_batch: int = Field(256, ge=1)
    max_deadline_ms: Finite = Field(30_000.0, gt=0.0, le=3.6e6)
    cache_bytes: int = Field(112_000_000, ge=0)
    request_timeout_s: Finite = Field(9.0, gt=0.0, le=3600.0)
    drain_s: Finite = Field(1.0, ge=0.0, le=5.0)
    log_level: str = Field("info", pattern="^(debug|info|warning|error)$")

    @field_validator("keys", "hosts", "cors_origins", mode="before")
    @classmethod
    def _split(cls, value: Any) -> Any:
        items = [value] if isinstance(value, str) else value
        if not (isinstance(items, list | tuple) and all(isinstance(item, str) for item in items)):
            return value
        found = tuple(filter(None, (part.strip() for item in items for part in item.split(","))))
        if any(items) and not found:  # it may be set, but to nothing, as compose files do
            raise ValueError("found only spaces, expected a value; for none, leave it empty")
        if not all(map(_PRINTABLE.fullmatch, found)):
            raise ValueError(
                "found a space, or a character that HTTP headers cannot contain; expected keys of printable ASCII"
            )
        return found

    @field_validator("cors_origins")
    @classmethod
    def _named(cls, origins: tuple[str, ...]) -> tuple[str, ...]:
        if not all(_ORIGIN.fullmatch(origin) for origin in origins):
            raise ValueError("expected origins as browsers send them: https://site.example, optionally with a port")
        return origins

    @field_validator("database_url")
    @classmethod
    def _usable(cls, value: SecretStr | None) -> SecretStr | None:
        if value is not None:
            database_url(value.get_secret_value())
        return value

    @property
    def guarded(self) -> bool:
        """Return whether the service requires keys."""
        return bool(self.keys) or self.keys_file is not None

    @property
    def url(self) -> URL:
        """The URL of the store."""
        if self.database_url is not None:
            return database_url(self.database_url.get_secret_value())
        return URL.create("sqlite", database=str(self.data_dir / "maps.sqlite3"))

    def share(self, whole: int) -> int:
        """Return one worker's part of something that all workers have together."""
        return whole // self.workers

    def limits(self) -> Limits:
        """Return the counts that requests are held to."""
        return Limits(
            values=self.max_values,
            map_segments=self.max_map_segments,
            scan_segments=self.max_scan_segments,
            beams=self.max_beams,
            pairs=self.max_correspondences,
            batch=self.max_batch,
        )


for _field, _description in descriptions_of(Settings).items():
    Settings.model_fields[_field].description = _description


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def read_settings(arguments: Sequence[str]) -> Settings:
    """Read command line and environment.

    Raises
    ------
    SettingsError
        When a value is wrong, or the service would listen to the world without keys.
    """
    _require_text(arguments)
    if any(argument.partition("=")[0] == "--keys" for argument in arguments):
        # Arguments of a process are seen by everyone on the machine.
        raise SettingsError(
            "keys: name their file with --keys-file or LINEFIX_KEYS_FILE; other users of the machine can see arguments"
        )
    parser = argparse.ArgumentParser(prog="linefix serve", description=HELP, allow_abbrev=False)
    try:
        source: CliSettingsSource[argparse.ArgumentParser] = CliSettingsSource(
            Settings, root_parser=parser, add_argument_method=_add_argument
        )
        settings = Settings(_cli_settings_source=source(args=list(arguments)))
    except ValidationError as error:
        wrong = (f"{'.'.join(str(part) for part in item['loc'])}: {item['msg']}" for item in error.errors())
        raise SettingsError("; ".join(wrong)) from error
    if not settings.guarded and not settings.allow_anonymous and not is_loopback(settings.host):
        raise SettingsError(
            f"refusing to listen on {settings.host} without keys: set LINEFIX_KEYS_FILE or LINEFIX_KEYS, or "
            "LINEFIX_ALLOW_ANONYMOUS=1 to let anyone who reaches the port use the service"
        )
    _require_usable_keys(settings)
    _require_usable_certificate(settings)
    if settings.workers > settings.searches:
        raise SettingsError(
            f"workers: expected at most {settings.searches}, the number of searches, found {settings.workers}"
        )
    return settings


def _require_usable_keys(settings: Settings) -> None:
    """Refuse keys that could not be checked later: an operator reads the errors of a start."""
    if settings.keys_file is not None:
        try:
            read_keys(settings.keys_file)
        except KeyFileError as error:
            raise SettingsError(f"keys_file: {error}") from None


def _require_usable_certificate(settings: Settings) -> None:
    """Refuse a certificate that cannot be loaded with its key."""
    if (settings.tls_cert is None) != (settings.tls_key is None):
        one = "tls_key" if settings.tls_cert is None else "tls_cert"
        raise SettingsError(f"tls_cert, tls_key: expected both or neither, found {one} only; set the other one, too")
    if settings.tls_cert is not None:
        try:
            # Without a callback the start would wait for a password to be typed.
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(settings.tls_cert, settings.tls_key, lambda: "")
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) and error.strerror else "no such certificate and key"
            raise SettingsError(f"tls_cert, tls_key: {why}") from None


def _add_argument(parser: argparse.ArgumentParser, *names: str, **how: Any) -> None:
    """Add an option to the command line, described in words of its user."""
    name = names[0].lstrip("-").replace("-", "_")
    field = Settings.model_fields[name]
    default = _DEFAULTS.get(name, field.default)
    how["help"] = argparse.SUPPRESS if name == "keys" else field.description
    if name != "keys" and default not in (None, (), False):
        how["help"] += f" (default: {default})"
    if field.annotation is not bool:
        how["metavar"] = _METAVARS.get(name, "N" if field.annotation is int else "X")
    parser.add_argument(*names, **how)


def _require_text(arguments: Sequence[str]) -> None:
    """Refuse what is not UTF-8: nothing later could name it in a message, or compare it with what is sent."""
    named = [(name, name + value) for name, value in os.environ.items() if name.upper().startswith("LINEFIX_")]
    for name, text in [*named, *((f"argument {index + 1}", text) for index, text in enumerate(arguments))]:
        if any("\ud800" <= letter <= "\udfff" for letter in text):
            raise SettingsError(f"{ascii(name)[1:-1]}: expected UTF-8")
