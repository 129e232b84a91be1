import "uplot/dist/uPlot.min.css";
import "../../styles/plot.css";

import { useEffect, useMemo, useRef, useState } from "react";
import uPlot from "uplot";

import { clock_text, kSecond_ns } from "../../draw/format";
import { request, useStudio } from "../../store/store";
import { seek } from "../../store/time_travel";
import { Icon } from "../../widgets/Icon";
import { color, useTheme } from "../../widgets/theme";
import { show_piece, useShownPiece } from "../timeline/shown";
import { add_signal, remove_signal, usePlot } from "./plot";
import { candidates, held_at, together, kSignalsMax, on_one_axis, sides_of, title_of, type Side, type Signal } from "./signals";

type Points = readonly (readonly [number, number])[];

/** Between two requests while the run goes on, or the timeline is zoomed. */
const kRefresh_ms = 250;
const kInks = ["accent", "past", "success", "failure", "quiet", "alarm", "ink", "muted"];

/** Signals over the time that the timeline shows. */
export default function Plot() {
  const signals = usePlot((plot) => plot.signals);
  return (
    <div className="plot">
      <Curves signals={signals} />
    </div>
  );
}

function Chooser({ full }: { full: boolean }) {
  const [text, set_text] = useState("");
  const [offered, set_offered] = useState<Signal[]>([]);
  const look = () => {
    const now = candidates(useStudio.getState().state);
    set_offered(now);
    request("signals", {}).then(({ paths }) => set_offered(together(now, paths)), () => undefined);
  };
  const take = (wanted: string) => {
    const known = offered.find((signal) => title_of(signal) === wanted);
    const typed = wanted.split("/");
    if (!known && typed.length < 2) return;
    add_signal(known ?? typed);
    set_text("");
  };
  return (
    <form
      className="plot-chooser"
      onSubmit={(event) => {
        event.preventDefault();
        take(text.trim());
      }}
    >
      <input
        className="field"
        list="plot-signals"
        aria-label="Signal to plot"
        placeholder="Plot a signal: robots/…, charts/…, messages/…"
        value={text}
        spellCheck={false}
        onFocus={look}
        onChange={(event) => {
          set_text(event.target.value);
          // A choice from the list comes as one change.
          if (offered.some((signal) => title_of(signal) === event.target.value)) take(event.target.value);
        }}
      />
      <datalist id="plot-signals">
        {offered.map((signal) => (
          <option key={title_of(signal)} value={title_of(signal)} />
        ))}
      </datalist>
      {full && <span className="muted">the oldest makes room</span>}
    </form>
  );
}

/** The values of the signals in a piece of time, asked for anew when that or the run moves on. */
function usePoints(signals: readonly Signal[], width: number): { points: readonly Points[]; why_not: readonly string[] } {
  const piece = useShownPiece();
  const index = useStudio((studio) => studio.index);
  const end = useStudio((studio) => (studio.state ? Math.floor(studio.state.end / 1e8) : 0));
  const [known, set_known] = useState<{ points: readonly Points[]; why_not: readonly string[] }>({ points: [], why_not: [] });
  const busy = useRef(false);
  const again = useRef(false);
  const [round, set_round] = useState(0);
  useEffect(() => {
    // Before it is measured nobody knows how many values there are to be.
    if (width === 0) return;
    if (busy.current) {
      again.current = true;
      return;
    }
    busy.current = true;
    const { from, to } = useShownPiece.getState();
    const asked = signals.map((path) =>
      request("signal", { path: [...path], from: Math.max(0, Math.round(from)), to: Math.round(to), width: Math.max(16, Math.min(4000, width)) }).then(
        (answer) => ({ points: answer.points, why_not: "" }),
        (error: unknown) => ({ points: [] as Points, why_not: error instanceof Error ? error.message : String(error) }),
      ),
    );
    void Promise.all(asked).then((answers) => {
      set_known({ points: answers.map(({ points }) => points), why_not: answers.map(({ why_not }) => why_not) });
      window.setTimeout(() => {
        busy.current = false;
        if (again.current) set_round((count) => count + 1);
        again.current = false;
      }, kRefresh_ms);
    });
  }, [signals, piece, index, end, width, round]);
  return known;
}

function Curves({ signals }: { signals: readonly Signal[] }) {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const [size, set_size] = useState({ width: 0, height: 0 });
  const theme = useTheme((state) => state.theme);
  const time = useStudio((studio) => studio.state?.time ?? 0);
  const piece = useShownPiece();
  const { points, why_not } = usePoints(signals, size.width);
  const [cursor, set_cursor] = useState<number | null>(null);
  // eslint-disable-next-line react-hooks/exhaustive-deps -- colours are others in another theme
  const inks = useMemo(() => signals.map((_, i) => color(kInks[i % kInks.length]!)), [signals, theme]);

  useEffect(() => {
    const element = place.current;
    if (!element) return;
    const observer = new ResizeObserver(() => set_size({ width: element.clientWidth, height: element.clientHeight }));
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  const side_by = useRef<Side[]>([]);
  const sides = useMemo(() => (side_by.current = sides_of(signals.map((_, i) => points[i] ?? []), side_by.current)), [signals, points]);
  const on = sides.join();
  const split = sides.includes("right");

  const ready = size.width > 0 && size.height > 0;
  useEffect(() => {
    const element = place.current;
    if (!element || !ready) return;
    const axis = { stroke: color("muted"), grid: { stroke: color("line"), width: 1 }, ticks: { stroke: color("line"), width: 1 }, font: "11px Inter Variable, sans-serif" };
    const made = new uPlot(
      {
        width: element.clientWidth,
        height: element.clientHeight,
        legend: { show: false },
        cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 5 } },
        scales: {
          x: { time: false, auto: false, range: () => [useShownPiece.getState().from / kSecond_ns, useShownPiece.getState().to / kSecond_ns] },
        },
        axes: [
          { ...axis, size: 26, values: (_, splits) => splits.map((split) => clock_text(split * kSecond_ns, split % 1 === 0 ? 0 : 1)) },
          { ...axis, size: 52 },
          ...(on.includes("right") ? [{ ...axis, scale: "right", side: 1 as const, size: 52, grid: { show: false } }] : []),
        ],
        series: [{}, ...inks.map((stroke, i) => ({ stroke, scale: on.split(",")[i] === "right" ? "right" : "y", width: 1.5, spanGaps: true, paths: uPlot.paths.stepped!({ align: 1 }), points: { show: false } }))],
        hooks: {
          setCursor: [(at) => set_cursor(at.cursor.left !== undefined && at.cursor.left >= 0 ? at.posToVal(at.cursor.left, "x") * kSecond_ns : null)],
          setSelect: [
            (at) => {
              if (at.select.width < 4) return;
              show_piece({ from: at.posToVal(at.select.left, "x") * kSecond_ns, to: at.posToVal(at.select.left + at.select.width, "x") * kSecond_ns });
              at.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            },
          ],
          draw: [
            (at) => {
              const now = useStudio.getState().state?.time ?? 0;
              const x = Math.round(at.valToPos(now / kSecond_ns, "x", true)) + 0.5;
              if (x < at.bbox.left || x > at.bbox.left + at.bbox.width) return;
              at.ctx.save();
              at.ctx.strokeStyle = color("ink");
              at.ctx.beginPath();
              at.ctx.moveTo(x, at.bbox.top);
              at.ctx.lineTo(x, at.bbox.top + at.bbox.height);
              at.ctx.stroke();
              at.ctx.restore();
            },
          ],
        },
      },
      [[], ...inks.map(() => [])],
      element,
    );
    made.over.title = "Click: this moment. Drag: this piece of time. Double click: all of it";
    made.over.addEventListener("dblclick", () => {
      const { state } = useStudio.getState();
      if (state) show_piece({ from: state.begin, to: Math.max(state.end, state.begin + kSecond_ns) });
    });
    made.over.addEventListener("click", () => {
      const { left } = made.cursor;
      if (left !== undefined && left >= 0) seek(Math.round(made.posToVal(left, "x") * kSecond_ns));
    });
    plot.current = made;
    return () => {
      made.destroy();
      plot.current = null;
    };
  }, [inks, on, ready]);

  useEffect(() => plot.current?.setSize(size), [size]);
  useEffect(() => {
    const shown = signals.map((_, i) => points[i] ?? []);
    const [times, ...values] = on_one_axis(shown);
    plot.current?.setData([times.map((at) => at / kSecond_ns), ...values] as uPlot.AlignedData);
  }, [points, signals, inks, on, ready]);
  useEffect(() => plot.current?.redraw(false, true), [piece, time]);

  const at = cursor ?? time;
  return (
    <>
      <div className="plot-head">
        <ul className="plot-legend" aria-label={`Values at ${clock_text(at)}`}>
          {signals.length > 0 && (
            <li className="mono muted" data-testid="plot-time">
              {clock_text(at)}
            </li>
          )}
          {signals.map((signal, i) => (
            <li key={title_of(signal)} data-signal={title_of(signal)}>
              <span className="plot-ink" style={{ background: inks[i] }} aria-hidden="true" />
              <span className="ellipsis" title={why_not[i] || title_of(signal)}>
                <bdi dir="ltr">{title_of(signal)}</bdi>
              </span>
              <strong className="number" data-testid="plot-value">
                {why_not[i] ? "?" : points[i]?.length === 0 ? "no number here" : value_text(points[i] ?? [], at)}
              </strong>
              {split && (
                <span className="muted plot-side" title={`Its values stand at the ${sides[i]} axis`}>
                  {sides[i] === "right" ? "right axis" : "left axis"}
                </span>
              )}
              <button className="icon-button small" aria-label={`Take ${title_of(signal)} away`} onClick={() => remove_signal(signal)}>
                <Icon name="close" />
              </button>
            </li>
          ))}
        </ul>
        <Chooser full={signals.length >= kSignalsMax} />
      </div>
      {signals.length === 0 && <p className="empty">Choose a number of a message, a chart, a robot or the blackboard.</p>}
      <div ref={place} className="plot-place" hidden={signals.length === 0} data-testid="plot" data-points={points.map((one) => one.length).join(" ")} />
    </>
  );
}

function value_text(points: Points, time: number): string {
  const value = held_at(points, time);
  return value === null ? "–" : String(Number(value.toPrecision(6)));
}
