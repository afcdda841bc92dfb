// The request as it was sent, for a terminal, a program or a report.

import { request } from "./asking";
import { element, save } from "./dom";
import { open } from "./files";
import { showProblem } from "./verdict";
import { messageOf } from "./words";

const text = element("#copied");

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

const LINK = "#request=";
const LONGEST = 60_000; // characters of a link

/** A link that opens the page with the request; what is behind the # is not sent to any service. */
async function asLink(json: string): Promise<string> {
  const packed = new Uint8Array(await streamed(json, new CompressionStream("deflate-raw")).arrayBuffer());
  const link = location.origin + location.pathname + LINK + btoa(Array.from(packed, (one) => String.fromCharCode(one)).join("")).replace(/\+/g, "-").replace(/\//g, "_");
  if (link.length > LONGEST) throw new Error("The request is too long for a link. Store the map under \"Stored maps\" and open it there, or download the request.");
  return link;
}

const streamed = (content: BlobPart, through: CompressionStream | DecompressionStream) => new Response(new Blob([content]).stream().pipeThrough(through));

/** Open the request of a link that the page was called with; return whether there is one. */
export function openLink(): boolean {
  if (!location.hash.startsWith(LINK)) return false;
  const packed = location.hash.slice(LINK.length).replace(/-/g, "+").replace(/_/g, "/");
  const unpacked = async () => {
    const bytes = Uint8Array.from(atob(packed), (one) => one.charCodeAt(0));
    return new File([await streamed(bytes, new DecompressionStream("deflate-raw")).blob()], "link.json");
  };
  unpacked().then(
    (file) => open([file]),
    () => showProblem("The link is damaged. Copy it again."),
  );
  return true;
}
addEventListener("hashchange", openLink);

function copying(id: string, form: (json: string) => string | Promise<string>): void {
  element(id).addEventListener("click", async () => {
    const json = body();
    if (json === null) return;
    let copied: string;
    try {
      copied = await form(json);
    } catch (error) {
      text.textContent = messageOf(error);
      return;
    }
    try {
      await navigator.clipboard.writeText(copied);
      text.textContent = "Copied.";
    } catch {
      text.textContent = "The browser does not let this page copy; download the request instead.";
    }
  });
}

copying("#link", asLink);
copying("#curl", asCurl);
copying("#powershell", asPowerShell);
copying("#python", asPython);
element("#download").addEventListener("click", () => {
  const json = body();
  if (json === null) return;
  save(json, "linefix-request.json");
  text.textContent = "Downloaded; it can be opened here again.";
});
