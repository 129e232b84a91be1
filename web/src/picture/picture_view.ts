import type { Point, Rect, Size } from "../protocol/types";
import { centre_on, fit, pan, pinch, reveal, wheel_factor, within, zoom_at, type Limits, type Viewport } from "./viewport";

/** A pointer that moves less than this between down and up has clicked. */
export const kClick_px = 4;
export const kZoomStep = 1.25;
export const kPanStep_px = 60;
const kFocusMargin_px = 40;
const kRevealMargin_px = 24;

export interface PictureOptions {
  limits: Limits;
  /** Around the picture when all of it is shown. */
  margin: number;
  /** A small picture is not enlarged beyond this when all of it is shown. */
  fit_max: number;
  /** A picture that would be shown at less than `from` is shown in part, at `scale`, until somebody asks for all. */
  readable?: { from: number; scale: number };
  /** The part of the picture that is shown then; null: all of it after all. */
  focus?(): Rect | null;
  /** The view or the size of the panel has changed: draw. */
  change(view: Viewport, size: Size): void;
  /** True: this press of the pointer is the caller's own (a tool, a thing that is dragged), and does not pan. */
  grab?(event: PointerEvent, at: Point): boolean;
}

/**
 * A picture in an element that a person can pan and zoom with mouse, wheel, trackpad and fingers. Until somebody does,
 * all of it is shown, or as much as can be read, whatever size the panel has.
 */
export class PictureView {
  view: Viewport = { scale: 1, x: 0, y: 0 };
  size: Size = { width: 0, height: 0 };
  private box: Rect = { x: 0, y: 0, width: 1, height: 1 };
  private element: (HTMLElement | SVGSVGElement) | null = null;
  private held: "all" | "readable" | "by hand" = "readable";
  private readonly fingers = new Map<number, Point>();
  private pressed_at: Point | null = null;
  private panned = false;
  private frame = 0;
  /** Both ends of a glide that goes on. */
  private glide: { from: Viewport; to: Viewport } | null = null;
  private readonly watchers = new Set<() => void>();
  private readonly observer = new ResizeObserver(() => this.measure());

  constructor(private readonly options: PictureOptions) {}

  attach(element: HTMLElement | SVGSVGElement): void {
    this.element = element;
    element.addEventListener("wheel", this.on_wheel as EventListener, { passive: false });
    element.addEventListener("pointerdown", this.on_down as EventListener);
    element.addEventListener("pointermove", this.on_move as EventListener);
    element.addEventListener("pointerup", this.on_up as EventListener);
    element.addEventListener("pointercancel", this.on_up as EventListener);
    element.addEventListener("click", this.on_click as EventListener, { capture: true });
    this.observer.observe(element);
    this.measure();
  }

  detach(): void {
    const { element } = this;
    if (!element) return;
    element.removeEventListener("wheel", this.on_wheel as EventListener);
    element.removeEventListener("pointerdown", this.on_down as EventListener);
    element.removeEventListener("pointermove", this.on_move as EventListener);
    element.removeEventListener("pointerup", this.on_up as EventListener);
    element.removeEventListener("pointercancel", this.on_up as EventListener);
    element.removeEventListener("click", this.on_click as EventListener, { capture: true });
    this.observer.disconnect();
    this.end_glide();
    this.element = null;
  }

  /** Calls after each change of the view, or of the panel's size, until the answer is called. */
  watch(changed: () => void): () => void {
    this.watchers.add(changed);
    return () => this.watchers.delete(changed);
  }

  /** What the picture covers. While all of it is shown, it stays so. */
  set_box(box: Rect): void {
    this.box = box;
    this.hold();
  }

  /** Shows all of it, from now on whatever size the panel gets. */
  fit(): void {
    this.held = "all";
    this.hold();
  }

  /** Shows all of it if it can be read so; else it stays as it is. */
  fit_readable(): void {
    if (this.size.width > 0 && !this.cut()) this.fit();
  }

  /** Shows what is in focus where not all of it can be read; after somebody moved the picture, nothing. */
  refocus(): void {
    if (this.held !== "readable" || this.size.width === 0 || !this.cut()) return;
    const part = this.options.focus?.();
    if (!part || this.view.scale < (this.options.readable?.scale ?? 0)) this.hold();
    else this.glide_to(reveal(this.view, part, this.size, kFocusMargin_px));
  }

  /** Shows what has been chosen, so that it can be read: also after somebody moved the picture. */
  show_chosen(part: Rect): void {
    if (this.held !== "by hand") this.refocus();
    else if (this.view.scale < (this.options.readable?.from ?? 0)) this.centre([part.x + part.width / 2, part.y + part.height / 2], this.options.readable?.scale);
    else this.reveal(part);
  }

  private whole(): Viewport {
    return fit(this.box, this.size, this.options.margin, this.options.fit_max, this.options.limits);
  }

  private cut(): boolean {
    return this.whole().scale < (this.options.readable?.from ?? 0);
  }

  private hold(): void {
    if (this.held === "by hand" || this.size.width === 0) return;
    // What a glide was to show, it was to show in a panel or of a picture of another size.
    this.end_glide();
    const part = this.options.focus?.();
    if (this.held === "all" || !this.cut() || part === null) {
      this.show(this.whole());
      return;
    }
    const scale = this.options.readable?.scale ?? 1;
    const top: Viewport = { scale, x: this.size.width / 2 - scale * (this.box.x + this.box.width / 2), y: this.options.margin - scale * this.box.y };
    const middle: Point = part ? [part.x + part.width / 2, part.y + part.height / 2] : [0, 0];
    this.show(part ? within(centre_on(top, middle, this.size), this.box, this.size, this.options.margin) : top);
  }

  zoom(factor: number): void {
    this.move_to(zoom_at(this.view, [this.size.width / 2, this.size.height / 2], factor, this.options.limits));
  }

  pan(dx: number, dy: number): void {
    this.move_to(pan(this.view, dx, dy));
  }

  /** Moves as little as needed to show a part of the picture; not at all if it is shown already, as all is that fits. */
  reveal(part: Rect): void {
    const next = reveal(this.view, part, this.size, Math.min(kRevealMargin_px, this.options.margin));
    if (next.x === this.view.x && next.y === this.view.y) return;
    this.held = "by hand";
    this.glide_to(next);
  }

  /** Shows `point` in the middle, at least as large as `scale_min`. */
  centre(point: Point, scale_min = 0): void {
    const scale = Math.max(this.view.scale, scale_min);
    this.held = "by hand";
    this.glide_to(centre_on({ ...this.view, scale }, point, this.size));
  }

  /** As `centre`, without a glide: for following what moves; at least `scale_min` pixels a unit. */
  keep_centred(point: Point, scale_min = 0): void {
    const scale = Math.max(this.view.scale, scale_min);
    this.held = "by hand";
    this.end_glide();
    this.show(centre_on({ ...this.view, scale }, point, this.size));
  }

  /** Keys of a picture that has the focus: + − 0, and with `arrows` also the arrows. True if the key was one. */
  key(event: { key: string; ctrlKey: boolean; metaKey: boolean; altKey: boolean }, arrows: boolean): boolean {
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    switch (event.key) {
      case "+":
      case "=": this.zoom(kZoomStep); return true;
      case "-":
      case "_": this.zoom(1 / kZoomStep); return true;
      case "0": this.fit(); return true;
      case "ArrowLeft": if (arrows) this.pan(kPanStep_px, 0); return arrows;
      case "ArrowRight": if (arrows) this.pan(-kPanStep_px, 0); return arrows;
      case "ArrowUp": if (arrows) this.pan(0, kPanStep_px); return arrows;
      case "ArrowDown": if (arrows) this.pan(0, -kPanStep_px); return arrows;
      default: return false;
    }
  }

  private move_to(view: Viewport): void {
    this.held = "by hand";
    this.end_glide();
    this.show(view);
  }

  private end_glide(): void {
    cancelAnimationFrame(this.frame);
    this.glide = null;
  }

  private glide_to(view: Viewport): void {
    this.end_glide();
    if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this.show(view);
      return;
    }
    this.glide = { from: this.view, to: view };
    const start = performance.now();
    const kGlide_ms = 180;
    const step = (now: number) => {
      if (!this.glide) return;
      const { from, to } = this.glide;
      const part = Math.min(Math.max((now - start) / kGlide_ms, 0), 1);
      const eased = 1 - (1 - part) ** 3;
      const mix = (a: number, b: number) => a + eased * (b - a);
      if (part < 1) this.frame = requestAnimationFrame(step);
      else this.glide = null;
      this.show({ scale: mix(from.scale, to.scale), x: mix(from.x, to.x), y: mix(from.y, to.y) });
    };
    this.frame = requestAnimationFrame(step);
  }

  private show(view: Viewport): void {
    this.view = view;
    this.options.change(view, this.size);
    this.watchers.forEach((changed) => changed());
  }

  private measure(): void {
    if (!this.element) return;
    const { width, height } = this.element.getBoundingClientRect();
    const grown: Point = [(width - this.size.width) / 2, (height - this.size.height) / 2];
    this.size = { width, height };
    if (this.held !== "by hand") this.hold();
    else {
      // The middle stays in the middle, also of where a glide leads.
      const moved = (view: Viewport) => pan(view, grown[0], grown[1]);
      if (this.glide) this.glide = { from: moved(this.glide.from), to: moved(this.glide.to) };
      this.show(moved(this.view));
    }
  }

  private at(event: { clientX: number; clientY: number }): Point {
    const box = this.element?.getBoundingClientRect();
    return [event.clientX - (box?.left ?? 0), event.clientY - (box?.top ?? 0)];
  }

  private readonly on_wheel = (event: WheelEvent): void => {
    event.preventDefault();
    const factor = wheel_factor(event.deltaY, event.deltaMode, event.ctrlKey);
    this.move_to(zoom_at(this.view, this.at(event), factor, this.options.limits));
  };

  private readonly on_down = (event: PointerEvent): void => {
    if (event.pointerType === "mouse" && event.button !== 0 && event.button !== 1) return;
    const at = this.at(event);
    this.panned = false;
    if (this.fingers.size === 0 && event.button === 0 && this.options.grab?.(event, at)) return;
    this.fingers.set(event.pointerId, at);
    this.pressed_at = at;
  };

  private readonly on_move = (event: PointerEvent): void => {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const now = this.at(event);
    if (this.fingers.size === 2) {
      const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) this.move_to(pinch(this.view, [before, other], [now, other], this.options.limits));
      this.panned = true;
    } else if (this.pressed_at) {
      const moved = Math.hypot(now[0] - this.pressed_at[0], now[1] - this.pressed_at[1]);
      if (!this.panned && moved < kClick_px) return;
      // Captured only now: a press that does not move is a click on whatever lies there.
      if (!this.panned) this.element?.setPointerCapture(event.pointerId);
      this.panned = true;
      this.move_to(pan(this.view, now[0] - before[0], now[1] - before[1]));
    }
    this.fingers.set(event.pointerId, now);
  };

  private readonly on_up = (event: PointerEvent): void => {
    this.fingers.delete(event.pointerId);
    this.pressed_at = null;
  };

  // The end of a drag is no click.
  private readonly on_click = (event: MouseEvent): void => {
    if (!this.panned) return;
    event.stopPropagation();
    event.preventDefault();
    this.panned = false;
  };
}
