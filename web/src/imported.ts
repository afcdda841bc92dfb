// What was made of the files of another tool: read, merged, left out, assumed, and what is doubtful in it.

import { onChange, state } from "./state";
import type { Imported, MapDocument, Note } from "./types";
import { list } from "./verdict";

const box = document.querySelector<HTMLDetailsElement>("#imported")!;
const told = document.querySelector<HTMLElement>("#report")!;
let of: MapDocument | null = null;

function section(title: string, lines: string[]): HTMLElement[] {
  if (!lines.length) return [];
  const [head, shown] = [document.createElement("h3"), document.createElement("ul")];
  head.textContent = title;
  list(shown, lines);
  return [head, shown];
}

/** Show it beside the map that came of it, opened where somebody should look at it. */
export function tellImport({ map, report, check }: Imported): void {
  const { read, merged, dropped, assumed } = report;
  const lines = (notes: Note[]) => notes.map(({ message, count }) => (count ? `${message}: ${count}` : message));
  const doubts = check.findings.map((one) => one.message);
  const parts: [string, string[]][] = [
    ["Findings", doubts],
    ["Read", lines(read)],
    ["Merged", lines(merged)],
    ["Omitted", lines(dropped)],
    ["Assumed", lines(assumed)],
  ];
  of = map;
  document.querySelector("#about")!.textContent = `${map.segments.length} walls, read of ${report.files.join(", ")} (${report.format}).`;
  document.querySelector("#imported summary")!.textContent = doubts.length ? `Import report: ${doubts.length} findings` : "Import report";
  told.replaceChildren(...parts.flatMap(([title, lines]) => section(title, lines)));
  box.hidden = false;
  box.open = doubts.length + dropped.length + assumed.length > 0;
}

onChange(() => (box.hidden = of === null || state.map !== of));
