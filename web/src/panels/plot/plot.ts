import { create } from "zustand";

import { parse_signals, with_signal, type Signal } from "./signals";

const kStored = "sentree.plot";

/** What is plotted; the browser remembers it. */
export const usePlot = create<{ signals: readonly Signal[] }>()(() => ({ signals: parse_signals(localStorage.getItem(kStored)) }));
usePlot.subscribe(({ signals }) => localStorage.setItem(kStored, JSON.stringify(signals)));

export function add_signal(signal: Signal): void {
  usePlot.setState(({ signals }) => ({ signals: with_signal(signals, signal) }));
}

export function remove_signal(signal: Signal): void {
  usePlot.setState(({ signals }) => ({ signals: signals.filter((known) => known !== signal) }));
}
