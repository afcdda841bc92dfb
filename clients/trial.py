"""Make clients from the service's own document, and ask the README's question with each: ``make clients``."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

from examples.running import running_service

HERE = Path(__file__).parent
ANSWER = "ok true 0.998"
TSC = "--strict --target es2022 --module nodenext --moduleResolution nodenext --skipLibCheck --types node --outDir out"


def run(*command: str, folder: Path) -> str:
    """Run one step in a folder; return what it says, and end everything where it fails."""
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{ended.stdout}{ended.stderr}")
    return ended.stdout.strip()


def try_python(bin_folder: Path, url: str, folder: Path) -> str:
    """Ask with what openapi-python-client makes."""
    generate = f"{bin_folder / 'openapi-python-client'} generate --path openapi.json --meta none"
    run(*generate.split(), "--output-path", "linefix_generated", folder=folder)
    shutil.copy(HERE / "generated_python" / "call.py", folder)
    return run(str(bin_folder / "python"), "-W", "error", "call.py", url, folder=folder)


def try_typescript(url: str, folder: Path) -> str:
    """Ask with types that openapi-typescript makes, as tsc and node take them."""
    for name in ("call.ts", "package.json"):
        shutil.copy(HERE / "typescript" / name, folder)
    run("npm", "install", "--silent", "--no-audit", "--no-fund", folder=folder)
    run(
        "npx",
        "openapi-typescript",
        "openapi.json",
        "-o",
        "schema.d.ts",
        "--default-non-nullable",
        "false",
        folder=folder,
    )
    run("npx", "tsc", *TSC.split(), "call.ts", folder=folder)
    return run("node", "out/call.js", url, folder=folder)


def main() -> None:
    """Try each; the first argument is the folder of the generator's programs."""
    bin_folder = Path(sys.argv[1]).absolute()
    with tempfile.TemporaryDirectory() as name, running_service() as (url, _):
        folder = Path(name)
        with urllib.request.urlopen(f"{url}/openapi.json") as document:
            (folder / "openapi.json").write_bytes(document.read())
        answers = {"openapi-python-client": try_python(bin_folder, url, folder)}
        if shutil.which("npm") is None:
            print("TypeScript is left out: there is no npm")
        else:
            answers["openapi-typescript"] = try_typescript(url, folder)
    for generator, answer in answers.items():
        print(f"{generator}: {answer}")
    if set(answers.values()) != {ANSWER}:
        sys.exit(f"expected {ANSWER}")


if __name__ == "__main__":
    main()
