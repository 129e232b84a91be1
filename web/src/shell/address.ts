import { useMode } from "../design/mode";
import { useCharts } from "../panels/charts/charts";
import type { Time } from "../protocol/types";
import { select, useStudio, type Selection } from "../store/store";
import { go_live, seek, wants_live } from "../store/time_travel";
import { read_place, write_place, type Place } from "./place";

/** Browsers refuse an address that changes too often. */
const kPause_ms = 400;

/** What the page looks at, in the words of its address. */
function place_now(): Place {
  const { state, selection, index, hello } = useStudio.getState();
  const { mode, file } = useMode.getState();
  const node = selection.node === null ? undefined : index?.model.tree.nodes[selection.node];
  return {
    at: state && !state.live ? state.time : null,
    node: node?.path ?? null,
    chart: useCharts.getState().follow ? null : selection.chart,
    monitor: selection.monitor,
    message: selection.sequence,
    view: hello?.design && mode === "run" ? "run" : null,
    file: hello?.design ? file : null,
  };
}

function go_to_place(place: Place): void {
  const { index } = useStudio.getState();
  const node = index?.model.tree.nodes.find(({ path }) => path === place.node);
  const wanted: Partial<Selection> = { monitor: place.monitor, sequence: place.message, node: node?.id ?? null };
  // One without a chart follows the leaf at work, whose chart may be chosen already.
  if (place.chart !== null && index?.chart.has(place.chart)) wanted.chart = place.chart;
  select(wanted);
  if (wanted.chart) useCharts.setState({ follow: false });
  if (place.view === "run") useMode.setState({ mode: "run" });
  if (place.file !== null) useMode.setState({ file: place.file });
  if (place.at !== null) seek(place.at);
}

/** Brings the page to what its address names, once there is a run; then the address says where it is. */
export function follow_address(): () => void {
  const wanted = read_place(window.location.hash);
  if (wanted.file !== null) useMode.setState({ file: wanted.file });
  let arrived = false;
  let timer = 0;
  let asked_at: Time | null = wanted.at;
  let known = window.location.hash;
  const write = () => {
    timer = 0;
    // Somebody has just changed it, and is heard of next.
    if (window.location.hash !== known) return;
    // On the way to the moment asked for, the address stays: whoever loads the page anew now gets there too.
    const now = place_now();
    if (asked_at !== null && now.at === null && !wants_live()) return;
    asked_at = null;
    const hash = write_place(window.location.hash, now);
    if (hash !== window.location.hash) window.history.replaceState(null, "", hash === "" ? window.location.pathname : hash);
    known = window.location.hash;
  };
  const changed = () => {
    const { index, state, hello, phase } = useStudio.getState();
    if (!arrived) {
      // A project that is opened shows nothing until its shadow run is there.
      const ready = phase === "open" && index && state && !(hello?.design && state.end === 0);
      if (!ready) return;
      arrived = true;
      go_to_place(wanted);
      return;
    }
    if (timer === 0) timer = window.setTimeout(write, kPause_ms);
  };
  const typed = () => {
    known = window.location.hash;
    const place = read_place(known);
    go_to_place(place);
    if (place.at === null && !useStudio.getState().state?.live) go_live();
  };
  const stops = [useStudio.subscribe(changed), useMode.subscribe(changed)];
  window.addEventListener("hashchange", typed);
  changed();
  return () => {
    stops.forEach((stop) => stop());
    window.removeEventListener("hashchange", typed);
    window.clearTimeout(timer);
  };
}
