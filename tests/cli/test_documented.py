"""Every command line that a document shows is one that the program takes."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.main import get_command

from cli.errors import WrongUseError
from cli.program import app, call
from service.settings import read_settings

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *ROOT.glob("docs/**/*.md"),
    *ROOT.glob("clients/*/README.md"),
]
PLACES = {"X": "1", "Y": "2", "THETA": "0.5", "N": "3", "...": ""}
SHOWN = re.compile(r"`(linefix [^`]+)`|^(?:\s*\$ )?(linefix (?!is |tells |answers |says ).*)$", re.MULTILINE)
WITHOUT_ARGUMENTS = re.compile(r"linefix(?: map)? [a-z0-9]+")  # a command that is named in a sentence


def shown() -> dict[str, str]:
    """Return each command line with the document that it is in first; lines that go on are joined."""
    found: dict[str, str] = {}
    for document in sorted(DOCUMENTS):
        text = document.read_text().replace("\\\n", " ")
        # A quoted text may be broken at the end of a line.
        text = re.sub(r"`linefix[^`]*`", lambda match: match[0].replace("\n", " "), text)
        for quoted, line in SHOWN.findall(text):
            command = " ".join(shlex.split(quoted or line, comments=True)).partition(" >")[0]
            found.setdefault(command, document.name)
    return found


def test_there_are_some() -> None:
    found = shown()
    assert len(found) > 30
    assert {"README.md", "command-line.md", "ros2.md", "map-and-log.md"} <= set(found.values())


def parsed(line: str) -> None:
    """Read a command line as the program does, and do nothing.

    Raises
    ------
    typer.TyperException
        When it is not taken.
    """
    arguments = [PLACES.get(word, word) for word in line.split()[1:]]
    command = get_command(app)
    while hasattr(command, "commands") and arguments and not arguments[0].startswith("-"):
        command = command.commands[arguments.pop(0)]
    if arguments and arguments[0] == "--install-completion":
        assert any("--install-completion" in option.opts for option in command.params)
    elif command.name == "serve":
        if arguments != ["--help"]:
            read_settings(arguments)
    else:
        try:
            command.make_context(str(command.name), arguments).close()
        except typer.Exit:  # --help, --version
            return


@pytest.mark.parametrize("line", sorted(shown()))
def test_the_program_takes_it(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if "COMMAND" in line:
        return
    monkeypatch.chdir(tmp_path)
    Path("linefix.yaml").write_text("/**:\n  ros__parameters: {}\n")
    try:
        parsed(line)
    except Exception as error:
        if not (WITHOUT_ARGUMENTS.fullmatch(line) and "Missing" in str(error)):
            pytest.fail(f"{shown()[line]}: {line}: {error}")


def test_what_it_does_not_take_fails_here() -> None:
    for line in ("linefix locate MAP SCAN --cause", "linefix replay LOG", "linefix find MAP"):
        with pytest.raises((KeyError, typer.exceptions.TyperException)):
            parsed(line)
    with pytest.raises(WrongUseError):
        call(["locate", "MAP", "SCAN", "--cause"])


def options_of(command: Any) -> set[str]:
    """Return the options of a command and of those below it."""
    own = {name for one in command.params for name in (*one.opts, *one.secondary_opts)}
    return own.union(*(options_of(one) for one in getattr(command, "commands", {}).values())) | {"--help"}


@pytest.mark.parametrize(
    "document", ["reference/command-line.md", "reference/ros2.md", "reference/formats.md", "tutorials/map-and-log.md"]
)
def test_every_option_that_is_named_is_there(document: str) -> None:
    text = (ROOT / "docs" / document).read_text()
    ours = re.sub(r"^ros2 .*$", "", text, flags=re.MULTILINE)
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", ours))
    assert named - options_of(get_command(app)) == set()


def every_help(command: Any, path: str = "") -> dict[str, str]:
    """Return the help of each command by its path."""
    found = {path: command.get_help(command.context_class(command, info_name=path))}
    for name, below in getattr(command, "commands", {}).items():
        found |= every_help(below, f"{path} {name}".strip())
    return found


def test_help_has_words_of_documents_in_place_of_types_of_python() -> None:
    found = every_help(get_command(app))
    assert "Usage: locate [OPTIONS] MAP... SCAN\n" in found["locate"]
    assert "Usage: map update [OPTIONS] MAP LOG...\n" in found["map update"]
    for path, text in found.items():
        assert not re.search(r"<(str|int|float|path|Path|list)|[{}]", text), path
