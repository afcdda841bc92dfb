"""Make clients from the service's own document, and ask the README's question with each: ``make clients``."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

from examples.running import running_service

HERE = Path(__file__).parent
ANSWER = "ok true 0.999"
JSON = {"Content-Type": "application/json"}
QUICKTYPE = (
    "--src-lang schema --lang c++ --namespace linefix --top-level Exchange --no-boost --hide-null-optional "
    "--include-location global-include --code-format with-struct --src schema.json -o linefix.hpp"
)
GXX = "-std=c++17 -Wall -Wextra -Werror"
TSC = "--strict --target es2022 --module nodenext --moduleResolution nodenext --skipLibCheck --types node --outDir out"


def run(*command: str, folder: Path, said: str = "") -> str:
    """Run one step in a folder, `said` on its stdin; return what it says, and end everything where it fails."""
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, input=said)
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


def try_cpp(bin_folder: Path, url: str, folder: Path) -> str:
    """Ask with types that quicktype makes, which g++ compiles without a warning; this program carries the request."""
    for name in ("call.cpp", "package.json"):
        shutil.copy(HERE / "cpp" / name, folder)
    document = json.loads((folder / "openapi.json").read_text().replace("#/components/schemas/", "#/definitions/"))
    parts = {name: {"$ref": f"#/definitions/Associate{name.title()}"} for name in ("request", "answer")}
    schema = {"type": "object", "properties": parts, "definitions": document["components"]["schemas"]}
    (folder / "schema.json").write_text(json.dumps(schema))
    run("npm", "install", "--silent", "--no-audit", "--no-fund", folder=folder)
    run("npx", "quicktype", *QUICKTYPE.split(), folder=folder)
    header = folder / "linefix.hpp"
    text = header.read_text()
    # It asks of what may be any JSON whether it is true, where it is to be left out when it is null.
    for name in {*re.findall(r"nlohmann::json (\w+);", text)}:
        text = text.replace(f"if (x.{name}) {{", f"if (!x.{name}.is_null()) {{")
    header.write_text(text)
    (include,) = bin_folder.parent.glob("lib/python*/site-packages/nlohmann_json/include")
    run("g++", *GXX.split(), "-I", str(include), "call.cpp", "-o", "call", folder=folder)
    asked = urllib.request.Request(f"{url}/v1/associate", run("./call", "request", folder=folder).encode(), JSON)
    with urllib.request.urlopen(asked) as answer:
        return run("./call", "answer", folder=folder, said=answer.read().decode())


def main() -> None:
    """Try each; the first argument is the folder of the generator's programs."""
    bin_folder = Path(sys.argv[1]).absolute()
    with tempfile.TemporaryDirectory() as name, running_service() as (url, _):
        folder = Path(name)
        with urllib.request.urlopen(f"{url}/openapi.json") as document:
            (folder / "openapi.json").write_bytes(document.read())
        answers = {"openapi-python-client": try_python(bin_folder, url, folder)}
        if shutil.which("npm") is None:
            print("TypeScript and C++ are left out: there is no npm")
        else:
            answers["openapi-typescript"] = try_typescript(url, folder)
            if shutil.which("g++") is None:
                print("C++ is left out: there is no g++")
            else:
                apart = folder / "cpp"
                apart.mkdir()
                shutil.copy(folder / "openapi.json", apart)
                answers["quicktype"] = try_cpp(bin_folder, url, apart)
    for generator, answer in answers.items():
        print(f"{generator}: {answer}")
    if set(answers.values()) != {ANSWER}:
        sys.exit(f"expected {ANSWER}")


if __name__ == "__main__":
    main()
