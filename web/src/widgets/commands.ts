import { useEffect, useRef } from "react";
import { create } from "zustand";

/** Something a person can do, found by key, in the palette (Ctrl+K) and in the help (?). */
export interface Command {
  id: string;
  title: string;
  /** Heading in the help, e.g. a panel's title. */
  group: string;
  /** As `key_text` writes them: "Space", "Shift+N", "Ctrl+K". */
  keys?: readonly string[];
  /** What it is where its own part of the page has the focus, which takes these keys itself. */
  keys_there?: readonly string[];
  run(): void;
}

export const useCommands = create<{ commands: ReadonlyMap<string, Command>; /** Also where a button has the focus. */ space_pauses: boolean }>()(() => ({ commands: new Map(), space_pauses: true }));

/** Offers `commands` while the calling component is shown; the last one rendered runs. */
export function useCommand(...commands: Command[]): void {
  const latest = useRef(commands);
  latest.current = commands;
  const identity = commands.map((command) => `${command.id}|${command.title}|${command.keys?.join(" ")}|${command.keys_there?.join(" ")}`).join("\n");
  useEffect(() => {
    const offered = latest.current.map((command, index) => ({ ...command, run: () => latest.current[index]?.run() }));
    useCommands.setState(({ commands: old }) => {
      const next = new Map(old);
      for (const command of offered) next.set(command.id, command);
      return { commands: next };
    });
    return () => {
      useCommands.setState(({ commands: old }) => {
        const next = new Map(old);
        for (const command of offered) if (next.get(command.id) === command) next.delete(command.id);
        return { commands: next };
      });
    };
  }, [identity]);
}

type KeyLike = Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "altKey" | "shiftKey">;

/** The name of a key with its modifiers; Shift is named only where it does not already change the sign. */
export function key_text(event: KeyLike): string {
  const letter = event.key === " " ? "Space" : event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const sign = event.key.length === 1 && !/[a-z0-9 ]/i.test(event.key);
  return [
    event.ctrlKey || event.metaKey ? "Ctrl+" : "",
    event.altKey ? "Alt+" : "",
    event.shiftKey && !sign ? "Shift+" : "",
    letter,
  ].join("");
}

/** Keys belong to the field that a person types into, and to widgets that use them themselves. */
export function is_typing(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement) return true;
  return target instanceof HTMLInputElement && !["button", "checkbox", "radio", "range"].includes(target.type);
}

/** Where Space writes a blank. */
function is_text(target: EventTarget | null): boolean {
  return is_typing(target) && !(target instanceof HTMLSelectElement);
}

/** What a field takes back itself: what is typed in it and not told yet (`data-unsent`, where the field knows). */
function takes_back(target: EventTarget | null, keys: string): boolean {
  if (!kTakingBack.includes(keys) || !(target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement) || !is_typing(target)) return false;
  return target.dataset.unsent === undefined ? target.value !== "" : target.dataset.unsent === "true";
}
const kTakingBack: readonly string[] = ["Ctrl+Z", "Ctrl+Shift+Z", "Ctrl+Y"];

/** Enter presses the button that has the focus; Space, which pauses, only what it alone can press. While one designs nothing is to be paused at once. */
function presses(event: KeyboardEvent): boolean {
  if (!(event.target instanceof HTMLElement)) return false;
  const { space_pauses } = useCommands.getState();
  if (event.target.closest("dialog, [role=menu]") || (!space_pauses && event.target.closest("button, summary, select"))) return event.key === " " || event.key === "Enter";
  if (event.key === " ") return event.target instanceof HTMLInputElement && ["checkbox", "radio"].includes(event.target.type);
  return event.key === "Enter" && event.target.closest("button, a, summary, [role=button], [role=option], [role=treeitem], input") !== null;
}

export function handle_key(event: KeyboardEvent): void {
  if (event.defaultPrevented) return;
  const keys = key_text(event);
  if (keys === "Space" ? is_text(event.target) : is_typing(event.target) && !keys.startsWith("Ctrl+")) return;
  if (presses(event) || takes_back(event.target, keys)) return;
  for (const command of useCommands.getState().commands.values()) {
    if (!command.keys?.includes(keys)) continue;
    event.preventDefault();
    command.run();
    return;
  }
}
