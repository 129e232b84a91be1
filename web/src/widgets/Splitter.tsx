import { useRef, useState } from "react";

/**
 * Between neighbours, at `share` (0 to 1) of what both have; `move` gets how far in pixels. Arrow keys move by 16, with
 * Shift by 64; a double click, or Home, lets them have what fits, where there is such.
 */
export function Splitter({ direction, label, share, move, reset }: { direction: "vertical" | "horizontal"; label: string; share: number; move(pixels: number): void; reset?(): void }) {
  const last = useRef(0);
  const [dragging, set_dragging] = useState(false);
  const along = (event: { clientX: number; clientY: number }) => (direction === "vertical" ? event.clientX : event.clientY);
  return (
    <div
      className={`splitter ${direction}${dragging ? " dragging" : ""}`}
      role="separator"
      aria-orientation={direction}
      aria-label={label}
      aria-valuenow={Math.round(share * 100)}
      tabIndex={0}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        last.current = along(event);
        set_dragging(true);
      }}
      onPointerMove={(event) => {
        if (!dragging) return;
        move(along(event) - last.current);
        last.current = along(event);
      }}
      onDoubleClick={reset}
      onPointerUp={() => set_dragging(false)}
      onPointerCancel={() => set_dragging(false)}
      onKeyDown={(event) => {
        if (event.key === "Home" && reset) {
          event.preventDefault();
          reset();
        }
        const [less, more] = direction === "vertical" ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
        if (event.key !== less && event.key !== more) return;
        event.preventDefault();
        move((event.key === more ? 1 : -1) * (event.shiftKey ? 64 : 16));
      }}
    />
  );
}
