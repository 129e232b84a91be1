import { create } from "zustand";

export type Theme = "light" | "dark";
/** "system" follows the person's operating system. */
export type ThemeChoice = Theme | "system";

const kStored = "sentree.theme";
const system_is_dark = () => window.matchMedia("(prefers-color-scheme: dark)").matches;
const resolve = (choice: ThemeChoice): Theme => (choice === "system" ? (system_is_dark() ? "dark" : "light") : choice);

/** Canvases redraw when `theme` changes; their colours come from `color`. */
export const useTheme = create<{ choice: ThemeChoice; theme: Theme }>()(() => ({ choice: "system", theme: "light" }));

function apply(choice: ThemeChoice): void {
  const theme = resolve(choice);
  document.documentElement.dataset["theme"] = theme;
  colors.clear();
  useTheme.setState({ choice, theme });
}

export function start_theme(): void {
  const stored = localStorage.getItem(kStored);
  apply(stored === "light" || stored === "dark" ? stored : "system");
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => apply(useTheme.getState().choice));
}

export function choose_theme(choice: ThemeChoice): void {
  localStorage.setItem(kStored, choice);
  apply(choice);
}

/** Who chooses what the system has follows it again. */
export function toggle_theme(): void {
  const wanted = useTheme.getState().theme === "dark" ? "light" : "dark";
  choose_theme(wanted === resolve("system") ? "system" : wanted);
}

const colors = new Map<string, string>();

/** The present value of a colour of styles/tokens.css, e.g. `color("running")`, for canvases and exported pictures. */
export function color(name: string): string {
  let value = colors.get(name);
  if (value === undefined) {
    value = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    colors.set(name, value);
  }
  return value;
}
