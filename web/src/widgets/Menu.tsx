import { useEffect, useLayoutEffect, useRef, type ReactNode } from "react";
import { createPortal } from "react-dom";

export interface MenuItem {
  label: string;
  /** Shown at the right, e.g. a key. */
  hint?: string;
  /** Why it cannot be done now; the item is then disabled and says so. */
  why_not?: string | null;
  checked?: boolean;
  run(): void;
}
export type MenuEntry = MenuItem | "line" | { heading: string };

/** Labels that may be cut are told in full, too. */
const kLong = 32;

/**
 * A menu at a point of the window. Arrows, Home, End and first letters choose, Enter or Space runs, Escape closes; the
 * focus returns to where it was.
 */
export function Menu({ x, y, entries, close, label, head }: { x: number; y: number; entries: readonly MenuEntry[]; close(): void; label: string; head?: ReactNode }) {
  const place = useRef<HTMLDivElement>(null);
  const before = useRef<Element | null>(null);
  const latest_close = useRef(close);
  latest_close.current = close;

  useLayoutEffect(() => {
    const element = place.current;
    if (!element) return;
    const { width, height } = element.getBoundingClientRect();
    element.style.left = `${Math.max(4, Math.min(x, window.innerWidth - width - 4))}px`;
    element.style.top = `${Math.max(4, y + height > window.innerHeight - 4 ? Math.min(y - height, window.innerHeight - height - 4) : y)}px`;
  }, [x, y, entries]);

  useEffect(() => {
    before.current = document.activeElement;
    const element = place.current;
    (element?.querySelector<HTMLElement>("[role^=menuitem]:not([aria-disabled=true])") ?? element)?.focus();
    const close_it = () => latest_close.current();
    const outside = (event: PointerEvent) => {
      if (event.target instanceof Node && !element?.contains(event.target)) close_it();
    };
    window.addEventListener("pointerdown", outside, true);
    window.addEventListener("blur", close_it);
    return () => {
      window.removeEventListener("pointerdown", outside, true);
      window.removeEventListener("blur", close_it);
      if (before.current instanceof HTMLElement || before.current instanceof SVGElement) before.current.focus({ preventScroll: true });
    };
  }, []);

  const move = (event: React.KeyboardEvent) => {
    event.stopPropagation();
    const items = [...(place.current?.querySelectorAll<HTMLElement>("[role^=menuitem]") ?? [])];
    const at = items.indexOf(document.activeElement as HTMLElement);
    const to = (index: number) => {
      event.preventDefault();
      items.at(index % items.length)?.focus();
    };
    if (event.key === "Escape" || event.key === "Tab") {
      event.preventDefault();
      close();
    } else if (event.key === "ArrowDown") to(at + 1);
    else if (event.key === "ArrowUp") to(at <= 0 ? items.length - 1 : at - 1);
    else if (event.key === "Home") to(0);
    else if (event.key === "End") to(items.length - 1);
    else if (event.key.length === 1 && event.key !== " ") {
      const letter = event.key.toLowerCase();
      const found = [...items.slice(at + 1), ...items.slice(0, at + 1)].find((item) => item.textContent?.toLowerCase().startsWith(letter));
      if (found) to(items.indexOf(found));
    }
  };

  return createPortal(
    <div className="menu" role="menu" aria-label={label} ref={place} tabIndex={-1} onKeyDown={move} onContextMenu={(event) => event.preventDefault()}>
      {head && <div className="menu-head">{head}</div>}
      {entries.map((entry, index) => {
        if (entry === "line") return <div key={index} className="menu-line" role="separator" />;
        if ("heading" in entry) return <div key={index} className="menu-heading">{entry.heading}</div>;
        const disabled = Boolean(entry.why_not);
        return (
          <button
            key={index}
            type="button"
            className="menu-item"
            role={entry.checked === undefined ? "menuitem" : "menuitemcheckbox"}
            aria-checked={entry.checked}
            aria-disabled={disabled}
            title={entry.why_not ?? (entry.label.length > kLong ? entry.label : undefined)}
            onClick={() => {
              if (disabled) return;
              close();
              entry.run();
            }}
          >
            <span className="menu-check" aria-hidden="true">{entry.checked ? "✓" : ""}</span>
            <span className="menu-label">{entry.label}</span>
            {entry.hint && <span className="menu-hint">{entry.hint}</span>}
          </button>
        );
      })}
    </div>,
    document.body,
  );
}
