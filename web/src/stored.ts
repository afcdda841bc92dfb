// Maps that the service stores.

import { checkMap, deleteMap, listMaps, putMap } from "./api";
import type { MapList } from "./contract";
import { element, made } from "./dom";
import { openSeveral } from "./floors";
import { openStored } from "./scene";
import { kept, state } from "./state";
import { list, messageOf } from "./words";

const box = element<HTMLDetailsElement>("#stored");
const maps = element<HTMLUListElement>("#maps");
const more = element<HTMLButtonElement>("#more");
const findings = element("#findings");
const name = element<HTMLInputElement>("#map-id");
const prefix = element<HTMLInputElement>("#prefix");
let cursor = "";

function show(...lines: string[]): void {
  list(findings, lines);
}

/** Do something, and show its error. */
async function trying(action: () => Promise<void>): Promise<void> {
  try {
    await action();
  } catch (error) {
    show(messageOf(error));
  }
}

async function load(from: string): Promise<void> {
  const page = await listMaps(from);
  if (!from) maps.replaceChildren();
  for (const one of page.maps) maps.append(row(one.map_id, one.segment_count));
  if (!maps.children.length) maps.append(made("li", { textContent: "No map is stored yet." }));
  cursor = page.next ?? "";
  more.hidden = !cursor;
}

function row(id: string, segments: number): HTMLLIElement {
  const item = made("li", {}, made("label", { className: "check" }, made("input", { type: "checkbox", value: id }), `${id} (${segments} walls)`));
  const actions: [string, () => Promise<void>][] = [
    ["Open", () => openStored(id)],
    ["Check", () => check(id)],
    ["Delete", () => remove(id)],
  ];
  for (const [word, action] of actions) {
    const button = made("button", { textContent: word, ariaLabel: `${word} ${id}` });
    button.addEventListener("click", () => void trying(action));
    item.append(button);
  }
  return item;
}

async function check(id: string): Promise<void> {
  show(`Checking ${id} ...`);
  const found = await checkMap(id);
  show(...(found.findings.length ? found.findings.map((one) => `${one.message} (${one.count} segments)`) : [`The check has no findings about ${id}.`]));
}

async function remove(id: string): Promise<void> {
  if (!confirm(`Delete the map ${id}? This cannot be undone.`)) return;
  await deleteMap(id);
  if (state.mapId === id) state.mapId = null;
  if (state.floors.includes(id)) state.floors = [];
  await load("");
  show(`${id} is deleted.`);
}

async function upload(): Promise<void> {
  if (!state.map) throw new Error("There is no map yet. Open one, or choose an example.");
  if (!name.value || !name.checkValidity()) throw new Error("The name is not valid. Use 1 to 128 letters, digits, dots, dashes and underscores.");
  const { own, landmark } = kept();
  const stored = await putMap(name.value, { ...state.map, segments: [...own, ...landmark] });
  await load("");
  show(`${stored.map_id} is stored, revision ${stored.revision}.`);
}

/** The ids of the maps that are ticked, or that begin with the prefix. */
async function chosen(): Promise<string[]> {
  const ticked = [...maps.querySelectorAll<HTMLInputElement>("input:checked")].map((one) => one.value);
  if (ticked.length > 1) return ticked;
  if (!prefix.value) throw new Error("Tick two maps at least, or enter how their names begin.");
  const found: string[] = [];
  for (let next: string | null = ""; next !== null; ) {
    const page: MapList = await listMaps(next, 1000);
    found.push(...page.maps.map((one) => one.map_id).filter((id) => id.startsWith(prefix.value)));
    next = page.next;
  }
  if (found.length < 2) throw new Error(`${found.length ? "One stored map begins" : "No stored map begins"} with ${prefix.value}. Expected two at least.`);
  return found;
}

element("#several").addEventListener("click", () => void trying(async () => openSeveral(await chosen())));
box.addEventListener("toggle", () => {
  if (box.open) void trying(() => load(""));
});
more.addEventListener("click", () => void trying(() => load(cursor)));
element("#upload").addEventListener("click", () => void trying(upload));
