// The request as it was sent, for a terminal, a program or a report.

import { request } from "./asking";

const text = document.querySelector<HTMLElement>("#copied")!;

function body(): string | null {
  const made = request();
  if (!made) text.textContent = "There is no request yet. Open a map and a scan.";
  return made ? JSON.stringify(made.asked) : null;
}

// Text of an opened file may be part of the request, and the user may paste it into any shell. cmd.exe has no single
// quotes, and PowerShell reads typographic ones as such. So every character with a meaning to a shell is escaped.
const UNSAFE = /[^A-Za-z0-9{}[\]",:.+\-_\\/]/g;
const escaped = (c: string) => `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`;
const plain = (json: string) => json.replace(/\\(["\\])/g, (_, c: string) => escaped(c)).replace(UNSAFE, escaped);

function asCurl(json: string): string {
  return `curl -s ${location.origin}/v1/associate -H "Content-Type: application/json" -d '${plain(json)}'`;
}

function asPowerShell(json: string): string {
  const to = `-Method Post -Uri '${location.origin}/v1/associate' -ContentType 'application/json'`;
  return `Invoke-RestMethod ${to} -Body '${plain(json)}'`;
}

function asPython(json: string): string {
  return [
    "import json",
    "import urllib.request",
    "",
    `asked = json.loads(${JSON.stringify(plain(json))})`,
    `request = urllib.request.Request("${location.origin}/v1/associate", json.dumps(asked).encode(), {"Content-Type": "application/json"})`,
    "answer = json.load(urllib.request.urlopen(request))",
    'print(answer["status"], answer["usable"], answer["pose"])',
    "",
  ].join("\n");
}

function copying(id: string, form: (json: string) => string): void {
  document.querySelector(id)!.addEventListener("click", async () => {
    const json = body();
    if (json === null) return;
    try {
      await navigator.clipboard.writeText(form(json));
      text.textContent = "Copied.";
    } catch {
      text.textContent = "The browser does not let this page copy; download the request instead.";
    }
  });
}

copying("#curl", asCurl);
copying("#powershell", asPowerShell);
copying("#python", asPython);
document.querySelector("#download")!.addEventListener("click", () => {
  const json = body();
  if (json === null) return;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([json], { type: "application/json" }));
  link.download = "linefix-request.json";
  link.click();
  URL.revokeObjectURL(link.href);
  text.textContent = "Downloaded; it can be opened here again.";
});
