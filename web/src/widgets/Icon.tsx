/** Drawn for this page on a grid of 16; lines of 1.5. */
const kPaths = {
  pause: "M5 3.5v9M11 3.5v9",
  play: "M5 3l8 5-8 5z",
  step: "M4 3l6 5-6 5zM12.5 3v10",
  stop: "M4 4h8v8H4z",
  live: "M8 8m-2.2 0a2.2 2.2 0 1 0 4.4 0a2.2 2.2 0 1 0-4.4 0M3.6 3.6a6.2 6.2 0 0 0 0 8.8M12.4 3.6a6.2 6.2 0 0 1 0 8.8",
  next: "M3.5 3l5.5 5-5.5 5M12 3v10",
  previous: "M12.5 3L7 8l5.500 5M4 3v10",
  down: "M4 6l4 4 4-4",
  right: "M6 4l4 4-4 4",
  expand: "M3 6V3h3M13 10v3h-3M10 3h3v3M6 13H3v-3",
  shrink: "M6 3v3H3M10 13v-3h3M13 6h-3V3M3 10h3v3",
  close: "M4 4l8 8M12 4l-8 8",
  search: "M7 7m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0M10 10l3.500 3.500",
  filter: "M2.500 3.500h11L9.500 8.500v4l-3 1.500V8.500z",
  sun: "M8 8m-2.500 0a2.500 2.500 0 1 0 5 0a2.500 2.500 0 1 0-5 0M8 1.500v1.500M8 13v1.500M1.500 8H3M13 8h1.500M3.400 3.400l1 1M11.600 11.600l1 1M12.600 3.400l-1 1M4.400 11.600l-1 1",
  moon: "M13 9.500A5.500 5.500 0 0 1 6.500 3a5.500 5.500 0 1 0 6.500 6.500z",
  help: "M6 6a2 2 0 1 1 2.800 1.850c-.6.3-.8.65-.8 1.400M8 12v.2",
  info: "M8 8m-5.500 0a5.500 5.500 0 1 0 11 0a5.500 5.500 0 1 0-11 0M8 7.400v3.600M8 5v.2",
  check: "M3.500 8.500l3 3 6-7",
  cross: "M4.500 4.500l7 7M11.500 4.500l-7 7",
  wait: "M8 8m-5.500 0a5.500 5.500 0 1 0 11 0a5.500 5.500 0 1 0-11 0M8 5v3.200l2 1.300",
  alarm: "M8 2.500l6 10.500H2zM8 6.500v3M8 11.400v.2",
  chart: "M2.500 3h5v3.500h-5zM8.500 9.500h5V13h-5zM5 6.500v4.800h3.500",
  download: "M8 2.500v7.500M5 7.200L8 10.200l3-3M3 13h10",
  follow: "M8 8m-1.500 0a1.500 1.500 0 1 0 3 0a1.500 1.500 0 1 0-3 0M8 1.500v3M8 11.500v3M1.500 8h3M11.500 8h3",
  plus: "M8 3v10M3 8h10",
  minus: "M3 8h10",
  fit: "M2.500 5.500v-3h3M13.500 10.500v3h-3M10.500 2.500h3v3M5.500 13.500h-3v-3M5.500 5.500h5v5h-5z",
  rewind: "M8 3L3 8l5 5zM13 3L8 8l5 5z",
  more: "M3.500 8h.2M8 8h.2M12.500 8h.2",
  warning: "M8 2.500l6 10.500H2zM8 6.500v3M8 11.400v.2",
} as const;
export type IconName = keyof typeof kPaths;

/** Decoration only: the element around it says in words what it does. */
export function Icon({ name }: { name: IconName }) {
  return (
    <svg className="icon" viewBox="0 0 16 16" fill="none" stroke="currentColor" strokeWidth="1.5" strokeLinecap="round" strokeLinejoin="round" aria-hidden="true">
      <path d={kPaths[name]} />
    </svg>
  );
}
