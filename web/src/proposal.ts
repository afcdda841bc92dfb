// A proposal of changes: from a file or from logs, its list, and the map with the changes that are accepted.

import { applyChanges, getMap, importScans, limits, Problem, putMap, updateMap } from "./api";
import { colourOf, confidenceOf, counted, evidenceOf, titleOf } from "./changes";
import { element, made, save } from "./dom";
import { redraw } from "./drawing";
import { key } from "./legend";
import { isLatest, showAll, supersede } from "./scene";
import { asStored, changed, forget, onChange, setMap, state } from "./state";
import type { MapDocument, Proposal, Scan, View } from "./types";
import { messageOf } from "./words";

const box = element<HTMLDetailsElement>("#changes");
const summary = element("#proposed");
const rows = element("#change-list");
const evidence = element("#evidence");
const logs = element<HTMLInputElement>("#visits");
const propose = element<HTMLButtonElement>("#propose");
const store = element<HTMLButtonElement>("#store-changes");
let listed: Proposal | null = null; // whose changes are in the list

export const isProposal = (fields: Record<string, unknown>) => Array.isArray(fields.changes) && "usable_before" in fields && "sharpened" in fields;

/** Show a proposal from a file, on the map that it was made for. */
export async function openProposal(name: string, proposal: Proposal, mine: number): Promise<void> {
  const id = proposal.based_on?.map_id;
  let map: MapDocument | null = state.map;
  if (id !== undefined && !(state.mapId === id && asStored())) {
    map = await getMap(id);
    if (isLatest(mine)) setMap(map, id);
  }
  if (!map) throw new Error(`${name} has changes of a map in a file. Open that map first.`);
  const other = new Error(`The changes in ${name} are of another map, or of an earlier revision. Open the map that they were made for first, or propose them again.`);
  const applied = await applyChanges(map, proposal).catch((error) => {
    throw error instanceof Problem && error.status === 422 ? other : error;
  });
  // The service applied the same changes before: where the maps differ, the old map is another one.
  if (JSON.stringify(applied.map.segments) !== JSON.stringify(proposal.map.segments)) throw other;
  if (isLatest(mine)) show(proposal, id === undefined ? "A map from a file, and proposed changes." : `The stored map ${id}, and proposed changes.`);
}

function show(proposal: Proposal, about: string): void {
  forget();
  Object.assign(state, { proposal, change: -1, scan: null, virtual: false, scans: [], log: [], logAt: 0 });
  box.open = true;
  showAll(about);
}

/** Send the scans of the logs, each of one visit, and show the changes that the service proposes. */
async function proposeFrom(files: File[]): Promise<void> {
  const id = state.mapId;
  if (id === null || !asStored()) throw new Error("The map is not stored as it is shown. Store it under \"Stored maps\", and open it there.");
  if (files.length < 2) throw new Error("A change needs two visits. Choose a log of each visit.");
  const mine = supersede();
  const most = Math.floor((await limits()).max_batch / files.length);
  const visits: { visit: string; scans: Scan[] }[] = [];
  for (const file of files) {
    summary.textContent = `Reading ${file.name} ...`;
    visits.push({ visit: file.name, scans: (await importScans([file], most)).scans.map((one) => ofSensor(file.name, one)) });
  }
  summary.textContent = "Searching the scans, which may take a minute ...";
  const proposal = await updateMap(id, visits);
  if (isLatest(mine) && state.mapId === id) show(proposal, `The stored map ${id}, and proposed changes.`);
}

/** A scan as the sensor took it: the mount makes no difference to the walls. */
function ofSensor(name: string, scan: Scan): Scan {
  const view: Scan | View = scan.views?.[0] ?? scan;
  if ((view as View).flipped) throw new Error(`The laser of ${name} is mounted upside down, which this page does not support. Use linefix map update.`);
  return { laser: view.laser, ...(view.twist ? { twist: view.twist } : {}) };
}

function summaryOf({ changes, scans, usable_before, usable_after, sharpened, refused_visits, kept = [], complete }: Proposal): string {
  const accepted = changes.filter((one) => one.accepted).length;
  return [
    changes.length ? `${accepted} of ${changes.length} changes accepted.` : "No change is proposed.",
    sharpened.segments.length ? `${sharpened.segments.length} walls are at better positions.` : "",
    `Of ${scans} scans, ${usable_before} are usable on the old map, and ${usable_after} with all changes.`,
    ...refused_visits.map((one) => `${one.visit} gives no evidence: ${one.message}`),
    ...kept.map(({ segments, message }) => `Kept: ${counted(segments.length, "wall")}; ${message}.`),
    complete ? "" : "The time limit ended the search; changes that were not verified are not proposed.",
  ].filter(Boolean).join(" ");
}

function list(proposal: Proposal): void {
  listed = proposal;
  rows.replaceChildren(
    ...proposal.changes.map((one, k) => {
      const tick = made("input", { type: "checkbox", checked: one.accepted });
      tick.setAttribute("aria-describedby", "evidence");
      const words = key(colourOf(one.code), `${k}: ${titleOf(one)}`);
      const item = made("li", {}, made("label", { className: "check" }, tick, words, made("small", { textContent: confidenceOf(one) })));
      tick.addEventListener("change", () => {
        one.accepted = tick.checked;
        changed();
      });
      for (const name of ["focusin", "pointerenter"]) item.addEventListener(name, () => lookAt(k));
      item.addEventListener("focusout", () => lookAt(-1));
      item.addEventListener("pointerleave", () => lookAt(focused()));
      return item;
    }),
  );
}

/** Mark a change in the list and on the plan, and show its evidence. */
export function lookAt(k: number): void {
  if (state.change === k) return;
  state.change = k;
  mark();
  redraw();
}

const focused = () => [...rows.children].findIndex((item) => item.contains(document.activeElement));

function mark(): void {
  [...rows.children].forEach((item, k) => item.toggleAttribute("data-looked", k === state.change));
  evidence.textContent = state.proposal?.changes[state.change] ? evidenceOf(state.proposal.changes[state.change]) : "";
}

function acceptAll(accepted: boolean): void {
  for (const one of state.proposal?.changes ?? []) one.accepted = accepted;
  changed();
}

const newMap = async () => (await applyChanges(state.map!, state.proposal!)).map;

async function download(): Promise<void> {
  const id = state.mapId;
  save(JSON.stringify(await newMap()), `${id ?? "map"}-updated.json`);
}

async function storeMap(): Promise<void> {
  const { map_id, revision } = state.proposal!.based_on!;
  const map = await newMap();
  const stored = await putMap(map_id, map, revision);
  setMap(map, map_id);
  showAll(`The stored map ${map_id}.`);
  summary.textContent = `${map_id} is stored with the accepted changes, revision ${stored.revision}.`;
}

/** Do something once at a time, and show its error. */
function doing(button: HTMLButtonElement, action: () => Promise<void>): void {
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      await action();
    } catch (error) {
      summary.textContent = messageOf(error);
    } finally {
      button.disabled = false;
    }
  });
}

doing(propose, () => proposeFrom([...(logs.files ?? [])]));
doing(element("#download-changes"), download);
doing(store, storeMap);
element("#accept-all").addEventListener("click", () => acceptAll(true));
element("#refuse-all").addEventListener("click", () => acceptAll(false));

onChange(() => {
  const { proposal } = state;
  element("#with-proposal").hidden = !proposal;
  if (!proposal) {
    if (listed) summary.textContent = "";
    listed = null;
    return;
  }
  if (listed !== proposal) list(proposal);
  rows.querySelectorAll("input").forEach((tick, k) => (tick.checked = proposal.changes[k].accepted));
  store.hidden = !proposal.based_on;
  store.textContent = proposal.based_on ? `Store as ${proposal.based_on.map_id}` : "";
  summary.textContent = summaryOf(proposal);
  mark();
});
