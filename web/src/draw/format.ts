import type { Data, Time } from "../protocol/types";

export const kSecond_ns = 1e9;

/** `0:20.000`, `1:02:03.4`: run time with as many decimals of a second as asked for. */
export function clock_text(time: Time, decimals = 3): string {
  const negative = time < 0;
  const unit = 10 ** decimals;
  // Rounded once, so that 59.9996 s does not become 0:60.000.
  const units = Math.round((Math.abs(time) / kSecond_ns) * unit);
  const whole = Math.floor(units / unit);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  const seconds = String(whole % 60).padStart(2, "0");
  const fraction = decimals > 0 ? `.${String(units % unit).padStart(decimals, "0")}` : "";
  const head = hours > 0 ? `${hours}:${String(minutes).padStart(2, "0")}` : String(minutes);
  return `${negative ? "−" : ""}${head}:${seconds}${fraction}`;
}

/** `0 s`, `830 ns`, `12 µs`, `3.4 ms`, `1.25 s`, `2 min 5 s`. */
export function duration_text(time: Time): string {
  const size = Math.abs(time);
  const sign = time < 0 ? "−" : "";
  if (time === 0) return "0 s";
  if (size < 1e3) return `${sign}${Math.round(size)} ns`;
  if (size < 1e6) return `${sign}${short(size / 1e3)} µs`;
  if (size < 1e9) return `${sign}${short(size / 1e6)} ms`;
  if (size < 60e9) return `${sign}${short(size / 1e9)} s`;
  const seconds = Math.round(size / 1e9);
  if (seconds < 3600) return `${sign}${Math.floor(seconds / 60)} min ${seconds % 60} s`;
  return `${sign}${Math.floor(seconds / 3600)} h ${Math.floor((seconds % 3600) / 60)} min`;
}

function short(value: number): string {
  return String(Number(value.toPrecision(3)));
}

/** One line: `{level: 10, charging: false}`. Longer than `limit` characters: cut, with `…`. */
export function data_text(data: Data | undefined, limit = 200): string {
  const text = plain(data);
  return text.length > limit ? `${text.slice(0, limit - 1)}…` : text;
}

function plain(data: Data | undefined): string {
  if (data === undefined) return "";
  if (data === null) return "null";
  if (typeof data === "number") return Number.isInteger(data) ? String(data) : String(Number(data.toPrecision(6)));
  if (typeof data !== "object") return typeof data === "string" ? data : String(data);
  if (Array.isArray(data)) return `[${data.map(plain).join(", ")}]`;
  return `{${Object.entries(data).map(([key, value]) => `${key}: ${plain(value)}`).join(", ")}}`;
}
