import { kSecond_ns } from "../../draw/format";
import type { Lane, Mark, Time } from "../../protocol/types";
import { request, select, useStudio, type Index } from "../../store/store";
import { seek, stop_replay } from "../../store/time_travel";
import { at_work, kLowRows, kRows, kWork, lane_at, lane_title, mark_at, merge_close, place, span_at, value_at, value_text, type Placed } from "./lanes";
import { told_by, usePastMarks, useShownPiece, type PastMark } from "./shown";
import { kLowRuler_px, kRuler_px, paint_lanes, paint_ruler, type Picture } from "./paint";
import { around, clamp, covers, fit, kBeyond, keep_in_view, kSpanMin_ns, newest, pan, span_of, time_at, x_of, zoom, type View } from "./view";

/** What the view follows: everything, the newest, or nothing. */
export type Following = "all" | "newest" | "none";

/** What the newest shows until the person zooms: the whole run, within these. */
export const kWindowFirst_ns = 30e9;
export const kWindowLast_ns = 180e9;
/** Between two requests for lanes while the run goes on. */
export const kRefresh_ms = 250;
/** After a request that failed. */
const kRetry_ms = 1000;
const kClick_px = 4;
/** Spans that differ by less are the same. */
const kAlike = 1 - 1e-6;
/** Gaps narrower than this between equal spans are not drawn. */
const kMergedGap_px = 8;

/** Below this height the timeline has less room between its lanes. */
const kLow_px = 140;

export interface TimelineParts {
  all: HTMLElement;
  ruler: HTMLCanvasElement;
  lanes: HTMLCanvasElement;
  scroll: HTMLElement;
  tip: HTMLElement;
}
export interface Shown {
  placed: readonly Placed[];
  height: number;
  following: Following;
  low: boolean;
}

/** Draws lanes and ruler outside of React: they change with every frame. */
export class Timeline {
  private view: View = { from: 0, to: kWindowFirst_ns };
  /** What is to be shown; of a run that is too short for it there is less. */
  private meant: View = this.view;
  /** The moment that was on show when that was decided: it need not be brought into view. */
  private meant_at: Time = 0;
  /** Chosen by zooming; null: by the run's length. */
  private span: Time | null = null;
  private following: Following = "newest";
  private lanes: readonly Lane[] = [];
  private marks: readonly Mark[] = [];
  private placed: readonly Placed[] = [];
  private asked: View | null = null;
  private busy = false;
  private last_asked_ms = -Infinity;
  private boot: string | undefined;
  /** Of the run that is shown: another one also when a scenario has run again. */
  private index: Index | null = null;
  private hover: Time | null = null;
  private hide_idle = false;
  private low = false;
  private dirty = true;
  private frame = 0;
  private timer = 0;
  private width = 0;
  private height = 0;
  private readonly abort = new AbortController();
  private readonly unsubscribe: () => void;
  private readonly unsubscribe_past: () => void;
  private readonly observer: ResizeObserver;

  constructor(
    private readonly parts: TimelineParts,
    private readonly show: (shown: Shown) => void,
  ) {
    const { signal } = this.abort;
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(parts.all);
    this.observer.observe(parts.scroll);
    this.observer.observe(parts.ruler);
    this.unsubscribe = useStudio.subscribe((studio, before) => {
      if (studio.violations !== before.violations) this.arrange();
      if (studio.state !== before.state || studio.violations !== before.violations) this.update();
    });
    this.unsubscribe_past = usePastMarks.subscribe(() => this.redraw());
    parts.scroll.addEventListener("scroll", () => this.redraw(), { signal });
    for (const [canvas, scrubs] of [[parts.ruler, true], [parts.lanes, false]] as const) {
      canvas.addEventListener("pointerdown", (event) => this.pointer_down(event, canvas, scrubs), { signal });
      canvas.addEventListener("pointermove", (event) => this.pointer_over(event, canvas === parts.ruler), { signal });
      canvas.addEventListener("pointerleave", () => this.leave(), { signal });
      canvas.addEventListener("wheel", (event) => this.wheel(event, scrubs), { signal, passive: false });
    }
    told_by((view) => {
      this.free();
      this.span = span_of(view);
      this.look(view);
    });
    this.resize();
    this.update();
  }

  destroy(): void {
    told_by(null);
    this.abort.abort();
    this.unsubscribe();
    this.unsubscribe_past();
    this.observer.disconnect();
    cancelAnimationFrame(this.frame);
    window.clearTimeout(this.timer);
  }

  redraw(): void {
    this.dirty = true;
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.draw());
  }

  set_hide_idle(hide: boolean): void {
    this.hide_idle = hide;
    this.arrange();
  }

  set_following(following: Following): void {
    this.following = following;
    this.arrange();
    this.update();
  }

  zoom_by(factor: number, at?: Time): void {
    const state = useStudio.getState().state;
    if (!state) return;
    this.span = Math.max(span_of(this.view) * factor, kSpanMin_ns);
    if (this.following === "newest" && state.live && at === undefined) {
      this.update();
      return;
    }
    if (this.following === "all" || at !== undefined) this.free();
    this.look(zoom(this.view, factor, at ?? state.time));
  }

  /** Keys of the widget; true if the key was one. */
  key(event: { key: string; shiftKey: boolean }): boolean {
    const state = useStudio.getState().state;
    if (!state) return false;
    const step = span_of(this.view) / (event.shiftKey ? 10 : 100);
    const sideways: Record<string, number> = { ArrowLeft: -step, ArrowRight: step };
    const by = sideways[event.key];
    if (by !== undefined) {
      stop_replay();
      seek((useStudio.getState().wanted ?? state.time) + by);
    } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      this.parts.scroll.scrollTop += event.key === "ArrowDown" ? 44 : -44;
    } else if (event.key === "+" || event.key === "=") this.zoom_by(0.7);
    else if (event.key === "-") this.zoom_by(1 / 0.7);
    else if (event.key === "0") this.set_following("all");
    else if (event.key === "End") seek(state.end);
    else return false;
    return true;
  }

  // ---- what is shown ----

  private free(): void {
    if (this.following === "none") return;
    this.following = "none";
    this.arrange();
  }

  private look(view: View, meant = view): void {
    const state = useStudio.getState().state;
    if (state && meant !== this.meant) this.meant_at = state.time;
    this.meant = meant;
    this.view = state ? clamp(view, state.begin, state.end) : view;
    const { from, to } = useShownPiece.getState();
    if (from !== this.view.from || to !== this.view.to) useShownPiece.setState(this.view);
    this.parts.all.dataset["view"] = `${this.view.from / kSecond_ns} ${this.view.to / kSecond_ns}`;
    this.ask();
    this.redraw();
  }

  /** After the moment or what is known has changed. */
  private update(): void {
    const { state, hello, index } = useStudio.getState();
    if (!state) return;
    // The lanes of the run before are shown until those of this one are there.
    const is_another = index !== this.index;
    if (is_another) this.asked = null;
    this.index = index;
    const is_other_length = state.begin !== this.known.from || state.end !== this.known.to;
    this.known = { from: state.begin, to: state.end };
    if (hello?.boot !== this.boot) {
      this.boot = hello?.boot;
      this.lanes = [];
      this.following = hello?.mode === "recording" ? "all" : "newest";
      this.span = null;
      this.arrange();
    }
    const length = state.end - state.begin;
    const is_whole = this.span === null && state.run.state === "ended" && first_span(length) >= length;
    const follows = state.live || hello?.mode === "recording" || is_whole;
    if (this.following === "all") this.look(fit(state.begin, state.end));
    else if (this.following === "newest" && follows) this.look(newest(this.span ?? first_span(length), state.begin, state.end));
    else {
      // Of another run as much of what is meant as there is: a longer one has it again.
      const view = is_another || is_other_length ? clamp(this.meant, state.begin, state.end) : this.view;
      const shown = useStudio.getState().replay > 0 || useStudio.getState().wanted === null ? this.reveal(view, state.time) : view;
      const has_all = span_of(view) >= span_of(this.meant) * kAlike && Math.abs(view.from - this.meant.from) <= span_of(view) * (1 - kAlike);
      this.look(shown, shown !== view && has_all ? shown : this.meant);
    }
  }

  private shown_time: Time = 0;
  /** Of the run, at the last update. */
  private known: View = { from: 0, to: 0 };

  /** The moment shown stays in view when it moves, but not when the person looks elsewhere meanwhile, nor when it is back where it was then. */
  private reveal(view: View, time: Time): View {
    if (time === this.shown_time) return view;
    this.shown_time = time;
    return time === this.meant_at ? view : keep_in_view(view, time);
  }

  private all_marks(): readonly (Mark | PastMark)[] {
    return [...this.marks, ...usePastMarks.getState().marks];
  }

  private arrange(): void {
    const violated = new Set(useStudio.getState().violations.map(({ monitor }) => monitor));
    const { placed, height } = place(this.lanes, this.hide_idle, this.low ? kLowRows : kRows, violated);
    this.placed = placed;
    this.show({ placed, height, following: this.following, low: this.low });
    this.redraw();
  }

  private resize(): void {
    this.width = this.parts.ruler.clientWidth;
    this.height = this.parts.scroll.clientHeight;
    this.parts.lanes.style.height = `${this.height}px`;
    const low = this.parts.all.clientHeight < kLow_px;
    if (low !== this.low) {
      this.low = low;
      this.arrange();
    }
    this.redraw();
  }

  // ---- data ----

  /** One request at a time, for what is wanted then; again when the view or the run has gone on meanwhile. */
  private ask(): void {
    const { state, phase } = useStudio.getState();
    if (this.busy || !state || phase !== "open" || this.width < 1) return;
    const { view } = this;
    const covered = this.asked !== null && covers(this.asked, view, state.begin, state.end);
    const grown = this.grown_until < state.end && view.to > this.grown_until;
    if (covered && !grown) return;
    const wait = covered ? kRefresh_ms - (performance.now() - this.last_asked_ms) : 0;
    if (wait > 0) {
      this.ask_later(wait);
      return;
    }
    const wanted = around(view, state.begin);
    const until = state.end;
    const { index } = this;
    this.busy = true;
    this.last_asked_ms = performance.now();
    const width = Math.min(4000, Math.max(16, Math.round(this.width * (1 + 2 * kBeyond))));
    request("lanes", { from: wanted.from, to: wanted.to, width })
      .then((answer) => {
        this.busy = false;
        if (index !== this.index) return this.ask();
        this.asked = wanted;
        this.grown_until = until;
        const gap = (kMergedGap_px / this.width) * span_of(this.view);
        const lanes = answer.lanes.map((lane) => merge_close(lane, gap));
        const work = at_work(lanes);
        this.lanes = work ? [work, ...lanes] : lanes;
        this.marks = answer.marks;
        this.arrange();
        this.ask();
      })
      .catch(() => {
        // Without a connection the lanes stay as they are. Asking again at once would be refused at once.
        this.busy = false;
        this.ask_later(kRetry_ms);
      });
  }
  private grown_until: Time = -1;

  private ask_later(wait_ms: number): void {
    if (this.timer !== 0) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.ask();
    }, wait_ms);
  }

  // ---- drawing ----

  /** Leaves that are conditions, as lanes call them. */
  private conditions: ReadonlySet<string> = new Set();
  private conditions_of: Index | null = null;

  private draw(): void {
    this.frame = 0;
    const { state, violations, index } = useStudio.getState();
    if (!state || !this.dirty || this.width < 1) return;
    this.dirty = false;
    if (index !== this.conditions_of) {
      this.conditions_of = index;
      this.conditions = new Set(index?.model.tree.nodes.flatMap(({ kind, message_name }) => (kind === "condition" && message_name !== null ? [message_name] : [])));
    }
    const violated = new Map<string, Time>();
    for (const { monitor, time } of violations) if (!violated.has(monitor)) violated.set(monitor, time);
    const picture: Picture = { view: this.view, time: state.time, end: state.end, live: state.live, marks: this.all_marks(), violated, conditions: this.conditions, hover: this.hover };
    paint_ruler(this.parts.ruler, this.width, this.low ? kLowRuler_px : kRuler_px, picture);
    const size = { width: this.width, height: this.height };
    paint_lanes(this.parts.lanes, size, this.placed, this.lanes, this.parts.scroll.scrollTop, picture);
  }

  // ---- pointer ----

  private local(event: PointerEvent | WheelEvent): { x: number; time: Time } {
    const x = event.clientX - this.parts.ruler.getBoundingClientRect().left;
    return { x, time: time_at(this.view, x, this.width) };
  }

  private pointer_down(event: PointerEvent, canvas: HTMLCanvasElement, scrubs: boolean): void {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    const start = { x: event.clientX, y: event.clientY, view: this.view, scroll: this.parts.scroll.scrollTop };
    let moved = false;
    stop_replay();
    const done = new AbortController();
    const scrub = (at: PointerEvent) => seek(this.local(at).time);
    canvas.addEventListener(
      "pointermove",
      (move) => {
        if (!moved && Math.hypot(move.clientX - start.x, move.clientY - start.y) < kClick_px) return;
        if (!moved && !scrubs) this.free();
        moved = true;
        if (scrubs) scrub(move);
        else {
          this.look(pan(start.view, (-(move.clientX - start.x) / this.width) * span_of(start.view)));
          this.parts.scroll.scrollTop = start.scroll - (move.clientY - start.y);
        }
      },
      { signal: done.signal },
    );
    const finish = (up: PointerEvent) => {
      done.abort();
      if (!moved && up.type === "pointerup") this.click(up, canvas === this.parts.ruler);
    };
    canvas.addEventListener("pointerup", finish, { signal: done.signal });
    canvas.addEventListener("pointercancel", finish, { signal: done.signal });
  }

  private click(event: PointerEvent, on_ruler: boolean): void {
    const { x, time } = this.local(event);
    const mark = on_ruler ? mark_at(this.all_marks(), this.view, x, this.width) : undefined;
    if (mark) {
      if (mark.kind !== "past") select({ sequence: mark.sequence });
      seek(mark.time);
      return;
    }
    const placed = on_ruler ? undefined : this.at(event);
    if (placed) select_lane(placed.lane, time);
    seek(time);
  }

  private at(event: PointerEvent): Placed | undefined {
    const y = event.clientY - this.parts.lanes.getBoundingClientRect().top + this.parts.scroll.scrollTop;
    return lane_at(this.placed, y);
  }

  private pointer_over(event: PointerEvent, on_ruler: boolean): void {
    const { x, time } = this.local(event);
    this.hover = time;
    const { tip } = this.parts;
    const text = this.tip_text(event, x, time, on_ruler);
    tip.textContent = text;
    tip.hidden = false;
    const area = this.parts.ruler.getBoundingClientRect();
    const left = Math.min(x + 12, this.width - tip.offsetWidth - 4);
    const y = event.clientY - area.top;
    tip.style.transform = `translate(${Math.round(Math.max(left, 0) + this.parts.ruler.offsetLeft)}px, ${Math.round(y > tip.offsetHeight + 16 ? y - tip.offsetHeight - 10 : y + 18)}px)`;
    this.redraw();
  }

  private tip_text(event: PointerEvent, x: number, time: Time, on_ruler: boolean): string {
    const mark = on_ruler ? mark_at(this.all_marks(), this.view, x, this.width) : undefined;
    if (mark) return `${mark.kind === "past" ? "" : `${mark.kind}: `}${mark.text}\n${this.clock(mark.time)}`;
    const placed = on_ruler ? undefined : this.at(event);
    if (!placed) return this.clock(time);
    const { lane } = placed;
    if (lane.kind === "value") {
      const value = value_at(lane, time);
      return `${lane_title(lane)}: ${value === undefined ? "–" : value_text(lane, value)}\n${this.clock(time)}`;
    }
    const span = span_at(lane, time);
    if (!span) return `${lane.name}\n${this.clock(time)}`;
    return `${lane.name}: ${span[2]}\n${this.clock(span[0])} – ${this.clock(span[1])}`;
  }

  private clock(time: Time): string {
    const total_ms = Math.round(Math.max(0, time) / 1e6);
    return `${Math.floor(total_ms / 60000)}:${((total_ms % 60000) / 1000).toFixed(3).padStart(6, "0")}`;
  }

  private leave(): void {
    this.hover = null;
    this.parts.tip.hidden = true;
    this.redraw();
  }

  private wheel(event: WheelEvent, on_ruler: boolean): void {
    const { time } = this.local(event);
    if (event.ctrlKey || event.metaKey || on_ruler) {
      event.preventDefault();
      this.zoom_by(Math.exp(event.deltaY * 0.002), time);
    } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      event.preventDefault();
      this.free();
      this.look(pan(this.view, ((event.deltaX || event.deltaY) / this.width) * span_of(this.view)));
    }
  }

  /** Where `time` is drawn, from the left border of the lanes. For tests of the whole page. */
  x_of(time: Time): number {
    return x_of(this.view, time, this.width);
  }
}

/** Grows in steps, so that the picture does not shrink with every frame. */
function first_span(known: Time): Time {
  let span = kWindowFirst_ns;
  while (span < kWindowLast_ns && span < known * 1.05) span *= 1.5;
  return Math.min(span, kWindowLast_ns);
}

/** The lane's subject, of that time where it is another one each time, becomes what all panels look at. */
export function select_lane(lane: Lane, time: Time): void {
  const index = useStudio.getState().index;
  if (!index) return;
  if (lane.kind === "leaf" || lane.id === kWork) {
    const node = index.node_of_leaf.get(lane.id === kWork ? (span_at(lane, time)?.[2] ?? "") : lane.name);
    if (node) select({ node: node.id, ...(node.leaf === null ? {} : { chart: node.leaf }) });
  } else if (lane.kind === "skill" || lane.kind === "monitor") {
    const chart = index.chart.get(lane.id) ?? index.model.charts.find((candidate) => candidate.kind === lane.kind && candidate.name === lane.name);
    if (chart) select({ chart: chart.id, ...(lane.kind === "monitor" ? { monitor: lane.name } : {}) });
  }
}

export { kRuler_px };
