import type { Observation } from "../../protocol/types";

export const kPage = 300;
/** Observations kept while looking at the past or scrolled back; those farthest from where one looks go. */
export const kWindowMax = 6000;

/** A gapless piece of the stream. */
export interface Window {
  observations: readonly Observation[];
  /** There may be older ones than the first. */
  older: boolean;
  /** There may be newer ones than the last. */
  newer: boolean;
}
export const kEmptyWindow: Window = { observations: [], older: false, newer: false };

export function covers(window: Window, sequence: number): boolean {
  const first = window.observations[0];
  const last = window.observations.at(-1);
  if (!first || !last) return false;
  return (sequence >= first.sequence || !window.older) && (sequence <= last.sequence || !window.newer);
}

export function prepend(window: Window, page: readonly Observation[], more: boolean): Window {
  const first = window.observations[0]?.sequence ?? Infinity;
  const observations = [...page.filter((observation) => observation.sequence < first), ...window.observations];
  const cut = observations.slice(0, kWindowMax);
  return { observations: cut, older: more, newer: window.newer || cut.length < observations.length };
}

export function extend(window: Window, page: readonly Observation[], more: boolean): Window {
  const last = window.observations.at(-1)?.sequence ?? -1;
  const observations = [...window.observations, ...page.filter((observation) => observation.sequence > last)];
  const cut = observations.slice(-kWindowMax);
  return { observations: cut, older: window.older || cut.length < observations.length, newer: more };
}
