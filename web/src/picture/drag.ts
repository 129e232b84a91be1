/** Where a pointer is in the window. */
export interface Where {
  clientX: number;
  clientY: number;
}

export interface DragOptions {
  /** How far the pointer moves before this is a drag and no click; 0: it is one at once. */
  from_px: number;
  move(event: PointerEvent): void;
  /** It was let go where it is; not after Escape, and not if it never moved so far. */
  drop(event: PointerEvent): void;
  /** It was let go without having moved so far. */
  click?(): void;
  /** It is over, whichever way. After `drop`. */
  end?(): void;
}

/** Follows the pointer from where it was pressed until it is let go, taken away, or Escape is pressed. */
export function follow_pointer(pressed: Where, { from_px, move, drop, click, end }: DragOptions): void {
  let moving = from_px === 0;
  const moved = (event: PointerEvent) => {
    if (!moving && Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) < from_px) return;
    moving = true;
    move(event);
  };
  const stop = () => {
    window.removeEventListener("pointermove", moved);
    window.removeEventListener("pointerup", released);
    window.removeEventListener("pointercancel", stop);
    window.removeEventListener("keydown", key, true);
    end?.();
  };
  const released = (event: PointerEvent) => {
    if (moving) drop(event);
    else click?.();
    stop();
  };
  const key = (event: KeyboardEvent) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    stop();
  };
  window.addEventListener("pointermove", moved);
  window.addEventListener("pointerup", released);
  window.addEventListener("pointercancel", stop);
  window.addEventListener("keydown", key, true);
}
