// The report on an imported map or log: what was read, merged, omitted and assumed, and the findings of the check.

import { made } from "./dom";
import { onChange, state } from "./state";
import type { Imported, MapDocument, Note, Report } from "./types";
import { list } from "./words";

const box = document.querySelector<HTMLDetailsElement>("#imported")!;
const content = document.querySelector<HTMLElement>("#report")!;
let of: MapDocument | null = null;

function section(title: string, lines: string[]): HTMLElement[] {
  if (!lines.length) return [];
  const shown = made("ul");
  list(shown, lines);
  return [made("h3", { textContent: title }), shown];
}

/** Show the report on a map, open where it has findings, omissions or assumptions. */
export function showImport({ map, report, check }: Imported): void {
  const doubts = check.findings.map((one) => one.message);
  document.querySelector("#about")!.textContent = `${map.segments.length} walls from ${report.files.join(", ")} (${report.format}).`;
  of = map;
  showReport(report, doubts);
}

/** Show the report on the scans of a log. */
export function showScanImport(report: Report): void {
  of = state.map;
  showReport(report, []);
}

function showReport({ read, merged, dropped, assumed }: Report, doubts: string[]): void {
  const lines = (notes: Note[]) => notes.map(({ message, count }) => (count ? `${message}: ${count}` : message));
  const parts: [string, string[]][] = [
    ["Findings", doubts],
    ["Read", lines(read)],
    ["Merged", lines(merged)],
    ["Omitted", lines(dropped)],
    ["Assumed", lines(assumed)],
  ];
  document.querySelector("#imported summary")!.textContent = doubts.length ? `Import report: ${doubts.length} findings` : "Import report";
  content.replaceChildren(...parts.flatMap(([title, lines]) => section(title, lines)));
  box.hidden = false;
  box.open = doubts.length + dropped.length + assumed.length > 0;
}

onChange(() => (box.hidden = of === null || state.map !== of));
