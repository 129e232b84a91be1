import { useEffect, useRef, type RefObject } from "react";

import type { Doc } from "./design";

/** What is written between two bytes; its first line is indented as the others are. */
export function written_at(doc: Doc, { from: first, to: end }: { from: number; to: number }): string {
  const { shown } = doc.places;
  const from = doc.places.at(first);
  return /[ \t]*$/.exec(shown.slice(0, from))![0] + shown.slice(from, doc.places.at(end));
}

/** For other files, and other editors. Not everywhere there is a clipboard, nor is it allowed to write to it. */
export function to_clipboard(text: string): void {
  void navigator.clipboard?.writeText(text).catch(() => undefined);
}

/** Empty where it cannot be read. */
export const clipboard_text = () => Promise.resolve(navigator.clipboard?.readText?.()).then((text) => text ?? "", () => "");

/** What is pasted: of the clipboard, or of what this page has kept, where that is the same or the clipboard cannot be read. */
export function pasted<Kept extends { text: string }>(text: string, kept: Kept | null): { lines: string; kept: Kept | null } {
  const lines = text.replace(/\r\n?/g, "\n");
  return { lines, kept: kept !== null && (lines.trim() === "" || lines.trim() === kept.text.trim()) ? kept : null };
}

const kShort = 40;
const short = (text: string) => (text.length > kShort || text.includes("\n") ? `${text.split("\n")[0]!.slice(0, kShort)} …` : text);
export const is_xml = (text: string) => /^\s*</.test(text);

/** Why nothing can be pasted. `what`: "node". */
export const nothing_pasted = (lines: string, what: string) => (lines.trim() === "" || is_xml(lines) ? `nothing is copied yet: Ctrl+C copies the chosen ${what}` : `what is in the clipboard is no ${what}: “${short(lines.trim())}”`);

/** What is pasted while the picture has the keys. */
export function usePaste(svg: RefObject<SVGSVGElement | null>, paste: (text: string) => void): void {
  const latest = useRef(paste);
  latest.current = paste;
  useEffect(() => {
    const take = (event: ClipboardEvent) => {
      if (document.activeElement !== svg.current) return;
      event.preventDefault();
      latest.current(event.clipboardData?.getData("text/plain") ?? "");
    };
    document.addEventListener("paste", take);
    return () => document.removeEventListener("paste", take);
  }, [svg]);
}
