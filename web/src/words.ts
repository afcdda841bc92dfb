// The page's own sentences for codes of the contract, whose messages name fields of requests and answers.

import type { Problem, ReasonAnswer } from "./contract";
import { made } from "./dom";

const REASONS: Record<ReasonAnswer["code"], string> = {
  prior_contradicted: "The pose that the scan supports contradicts the prior. Check the initial pose, or search without the prior.",
  search_incomplete: "The search is incomplete: the time ran out, or too many walls of the map lie in one place. A better pose may have been missed.",
  unobservable_direction: "The observed walls do not fix the position along one direction. Move until other walls are in view, and scan again.",
  not_on_map:
    "The scan fits the map no better than an unrelated scan would. The robot may be in a place that the map does not contain. " +
    "If it is on the map, run `linefix map check MAP --log LOG`: scale, mirror, unit or mount may be wrong.",
  similar_place: "Other places are similar to this one. Step through the alternatives. Search with a prior, or move and scan again.",
  single_wall: "The pose depends on a single wall. Move and scan again.",
  map_mismatch: "The scan and the map differ: much of the scan is not on the map, or mapped walls are not in the scan. Check that the map is up to date.",
  insufficient_evidence: "The scan has too few walls to distinguish this place from others. Move and scan again.",
};

const PROBLEMS: Partial<Record<Problem["code"], string>> = {
  unauthorized: "The service requires a key. Enter it under \"Key\" below.",
  overloaded: "The service is busy. Try again in some seconds.",
  rate_limited: "This key has sent too many requests. Try again in some seconds.",
  deadline_exceeded: "The time ran out: the service is busy, or the file is large. Try again.",
  unknown_map: "There is no such stored map. It may have been deleted, or renamed.",
  revision_conflict: "The stored map has another revision by now. Open it again.",
};

/** The page's sentence for a reason, a warning or a problem; where it has none, the message of the service. */
export function sentenceOf(code: string, message: string): string {
  return { ...REASONS, ...PROBLEMS }[code as keyof typeof REASONS] ?? message;
}

/** Show a text; what is in backticks is a command or a field of a file. */
export function write(element: HTMLElement, text: string): void {
  element.replaceChildren(...text.split("`").map((part, k) => (k % 2 ? made("code", { textContent: part }) : part)));
}

/** Show lines as a list, each once. */
export function list(into: HTMLElement, lines: string[]): void {
  into.replaceChildren(
    ...[...new Set(lines)].map((line) => {
      const item = made("li");
      write(item, line);
      return item;
    }),
  );
}

export const messageOf = (error: unknown) => (error instanceof Error ? error.message : String(error));
