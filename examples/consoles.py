"""Run the commands of the documents, and compare the output that the documents show.

``python -m examples.consoles [--write] [FILE ...]``, by default README.md, the tutorials and the reference.

``<!-- run -->`` above a block of code runs it, by bash or Python, in a folder with the files of `examples.sample`; a
service answers at ``localhost:8000``. ``<!-- output -->`` above a block compares it with the output of the block that
ran last: white space is ignored, ``...`` stands for anything, a number has the digits that the document gives it, and
times in ms are not compared. ``--write`` corrects the numbers.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .running import running_service
from .sample import write_sample

ROOT = Path(__file__).parent.parent
SERVICE = "localhost:8000"  # in the documents
BLOCK = re.compile(r"<!-- (?P<kind>run|output) -->\n+```(?P<language>\w*)\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE)
NUMBER = r"(?<![\w.-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w|\.\d)"
TIME = re.compile(r" ms\b")
TOKEN = re.compile(
    rf"(?P<number>{NUMBER})|(?P<any>\.\.\.)|(?P<space>\s+)|(?P<sign>[\[\]{{}},:])|(?P<other>.)", re.DOTALL
)


@dataclass(frozen=True, slots=True)
class Shown:
    """A pattern of an output as a document shows it, with its numbers.

    Attributes
    ----------
    pattern : re.Pattern
        With a group for each number.
    numbers : tuple of str
        As the document has them; "" where the number is a time.
    spans : tuple of (int, int)
        Their places in the text.
    """

    pattern: re.Pattern[str]
    numbers: tuple[str, ...]
    spans: tuple[tuple[int, int], ...]


def read(text: str) -> Shown:
    """Return the pattern of an output as a document shows it."""
    parts: list[str] = []
    numbers: list[str] = []
    spans: list[tuple[int, int]] = []
    for token in TOKEN.finditer(text.strip()):
        match token.lastgroup:
            case "number":
                parts.append(f"({NUMBER})")
                is_time = TIME.match(token.string, token.end())
                numbers.append("" if is_time else token[0])
                spans.append(token.span())
            case "any":
                parts.append(".*?")
            case "space":
                parts.append(r"\s*")
            case "sign":
                parts.append(rf"\s*{re.escape(token[0])}\s*")
            case _:
                parts.append(re.escape(token[0]))
    return Shown(re.compile("".join(parts), re.DOTALL), tuple(numbers), tuple(spans))


def as_shown(shown: str, measured: str) -> str:
    """Return a number with the digits that another one is shown with."""
    mantissa, exponent, _ = shown.partition("e")
    digits = len(mantissa.partition(".")[2])
    if not exponent:
        text = f"{float(measured):.{digits}f}"
        return text.removeprefix("-") if float(text) == 0.0 else text
    mantissa, _, power = f"{float(measured):.{digits}e}".partition("e")
    return f"{mantissa}e{int(power)}"


def corrected(text: str, output: str) -> str | None:
    """Return an output as a document should show it; None where more than numbers differs."""
    text, shown = text.strip(), read(text)
    found = shown.pattern.search(output)
    if found is None:
        return None
    for number, span, measured in reversed(list(zip(shown.numbers, shown.spans, found.groups(), strict=True))):
        if number:
            text = text[: span[0]] + as_shown(number, measured) + text[span[1] :]
    return text


def outputs(document: Path, folder: Path, url: str) -> Iterator[tuple[re.Match[str], str]]:
    """Run the blocks of a document in their order; yield each shown output and the real one.

    Raises
    ------
    subprocess.CalledProcessError
        When a block fails.
    """
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "COLUMNS": "120"}
    output = ""
    for block in BLOCK.finditer(document.read_text()):
        if block["kind"] == "output":
            yield block, output
            continue
        code = block["text"].replace(SERVICE, url.removeprefix("http://"))
        command = [sys.executable, "-c", code] if block["language"] == "python" else ["bash", "-ec", code]
        ended = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        if ended.returncode:
            raise subprocess.CalledProcessError(ended.returncode, code, ended.stdout, ended.stderr)
        output = ended.stdout


@contextmanager
def stage() -> Iterator[tuple[Path, str]]:
    """Give a folder with sample files, and the URL of a service."""
    with tempfile.TemporaryDirectory() as name, running_service() as (url, _):
        write_sample(Path(name))
        yield Path(name), url


def faults(document: Path, folder: Path, url: str, *, write: bool = False) -> list[str]:
    """Run the blocks of a document; return what is wrong, and correct the numbers if `write`."""
    text = new = document.read_text()
    wrong: list[str] = []
    try:
        for block, output in outputs(document, folder, url):
            right = corrected(block["text"], output)
            if right is None:
                wrong.append(f"{document.name}: expected\n{block['text']}found\n{output}")
            elif right != block["text"].strip():
                wrong.append(f"{document.name}: the numbers of the block are\n{right}")
                new = new.replace(block["text"], f"{right}\n")
    except subprocess.CalledProcessError as error:
        wrong.append(
            f"{document.name}: failed with status {error.returncode}:\n{error.cmd}{error.stdout}{error.stderr}"
        )
    if write and new != text:
        document.write_text(new)
    return wrong


def documents() -> list[Path]:
    """Return the documents whose blocks run by default."""
    found = [
        ROOT / "README.md",
        *sorted(ROOT.glob("docs/tutorials/*.md")),
        *sorted(ROOT.glob("docs/reference/**/*.md")),
    ]
    return [path for path in found if "<!-- run -->" in path.read_text()]


def main() -> int:
    """Run the blocks of the documents; the status is 1 when an output differs."""
    parser = argparse.ArgumentParser(prog="python -m examples.consoles", description="Run the commands of documents.")
    parser.add_argument("--write", action="store_true", help="correct the numbers that differ")
    parser.add_argument("documents", nargs="*", type=Path, metavar="FILE")
    args = parser.parse_args()
    with stage() as (folder, url):
        wrong = [
            fault
            for document in args.documents or documents()
            for fault in faults(document, folder, url, write=args.write)
        ]
    print("\n".join(wrong) or "the output of all blocks is as shown")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
