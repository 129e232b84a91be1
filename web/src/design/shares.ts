import { create } from "zustand";

const kStored = "sentree.design.shares";

/** What the picture has of the room that it shares with the text below or beside it; null: as it fits. The browser remembers. */
export interface Shares {
  above: number | null;
  beside: number | null;
}

export const kShareMin = 0.15;
export const kShareMax = 0.85;

export function parse_shares(stored: string | null): Shares {
  const share = (value: unknown) => (typeof value === "number" && value >= kShareMin && value <= kShareMax ? value : null);
  try {
    const { above, beside } = JSON.parse(stored ?? "{}") as Partial<Record<keyof Shares, unknown>>;
    return { above: share(above), beside: share(beside) };
  } catch {
    return { above: null, beside: null };
  }
}

export const useShares = create<Shares>()(() => parse_shares(localStorage.getItem(kStored)));
useShares.subscribe((shares) => localStorage.setItem(kStored, JSON.stringify(shares)));

export function set_share(which: keyof Shares, share: number): void {
  useShares.setState({ [which]: Math.min(Math.max(share, kShareMin), kShareMax) });
}
