import { useEffect, useMemo, useRef, useState } from "react";

import type { Rect, Size } from "../protocol/types";
import type { PictureView } from "./picture_view";
import { to_picture, type Viewport } from "./viewport";

const kWidthMax_px = 168;
const kHeightMax_px = 112;
const kLeast_px = 44;
/** Of the picture's own room, so that it does not hide what one looks at. */
const kWidthShare = 0.2;
const kHeightShare = 0.28;
/** From the edges of the picture's room, as the style sheet has it. */
const kFromEdge_px = 8;
/** It goes to another corner where it hides less than such a share of what it hides. */
const kBetter = 0.5;

type Corner = "bottom right" | "top right" | "top left" | "bottom left";
/** Those that are the same are taken in this order. */
const kCorners: readonly Corner[] = ["bottom right", "top right", "top left", "bottom left"];

/** The corner in which a map of that size hides least of what is drawn. */
export function corner_for(now: Corner, view: Viewport, room: Size, map: Size, rects: readonly Rect[]): Corner {
  const hidden = (corner: Corner) => {
    const [right, bottom] = [corner.endsWith("right"), corner.startsWith("bottom")];
    const [x0, y0] = to_picture(view, [right ? room.width - kFromEdge_px - map.width : kFromEdge_px, bottom ? room.height - kFromEdge_px - map.height : kFromEdge_px]);
    const [x1, y1] = [x0 + map.width / view.scale, y0 + map.height / view.scale];
    return rects.reduce((sum, { x, y, width, height }) => sum + Math.max(0, Math.min(x1, x + width) - Math.max(x0, x)) * Math.max(0, Math.min(y1, y + height) - Math.max(y0, y)), 0);
  };
  const hides = hidden(now);
  if (hides === 0) return now;
  const all = kCorners.map((corner) => ({ corner, hides: hidden(corner) }));
  const best = all.reduce((a, b) => (b.hides < a.hides ? b : a));
  return best.hides < kBetter * hides ? best.corner : now;
}
/** What is hidden of a picture before it needs a map. */
const kSlack_px = 2;

/** A picture that is a long stripe is widened, so that one can hit it. */
const size_of = (box: Size, scale: number): Size => ({ width: Math.max(box.width * scale, kLeast_px), height: Math.max(box.height * scale, kLeast_px) });

/** All of a picture of which only a part is shown, in a corner; a click or a drag in it goes there. `read`: what it is not to hide, if not all. */
export function Minimap({ view, box, rects, read = rects }: { view: PictureView; box: Rect; rects: readonly Rect[]; read?: readonly Rect[] }) {
  const frame = useRef<SVGRectElement>(null);
  /** 0: all is in sight. */
  const [scale, set_scale] = useState(0);
  const [corner, set_corner] = useState<Corner>("bottom right");
  const held = useRef(false);
  const { width, height } = size_of(box, scale);
  const shapes = useMemo(() => rects.map(({ x, y, width, height }) => `M${x} ${y}h${width}v${height}h${-width}z`).join(""), [rects]);
  useEffect(() => {
    const draw = () => {
      const { view: shown, size } = view;
      const [left, top] = to_picture(shown, [0, 0]);
      const [right, bottom] = to_picture(shown, [size.width, size.height]);
      const slack = kSlack_px / shown.scale;
      const needed = size.width > 0 && (left > box.x + slack || top > box.y + slack || right < box.x + box.width - slack || bottom < box.y + box.height - slack);
      const [wide, high] = [Math.min(kWidthMax_px, size.width * kWidthShare), Math.min(kHeightMax_px, size.height * kHeightShare)];
      const fitting = needed ? Math.min(wide / box.width, high / box.height) : 0;
      set_scale(fitting);
      // Not away from the pointer.
      if (needed && !held.current) set_corner((now) => corner_for(now, shown, size, size_of(box, fitting), read));
      const clamped = { x: Math.max(left, box.x), y: Math.max(top, box.y) };
      frame.current?.setAttribute("x", String(clamped.x));
      frame.current?.setAttribute("y", String(clamped.y));
      frame.current?.setAttribute("width", String(Math.max(Math.min(right, box.x + box.width) - clamped.x, 0)));
      frame.current?.setAttribute("height", String(Math.max(Math.min(bottom, box.y + box.height) - clamped.y, 0)));
    };
    draw();
    return view.watch(draw);
  }, [view, box, scale, read]);
  if (scale === 0) return null;
  const go = (event: React.PointerEvent<SVGSVGElement>) => {
    const at = event.currentTarget.getBoundingClientRect();
    view.keep_centred([box.x + ((event.clientX - at.left) / at.width) * box.width, box.y + ((event.clientY - at.top) / at.height) * box.height]);
  };
  return (
    <svg
      className="minimap"
      data-corner={corner}
      width={width}
      height={height}
      preserveAspectRatio="none"
      viewBox={`${box.x} ${box.y} ${box.width} ${box.height}`}
      aria-hidden="true"
      data-testid="minimap"
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        held.current = true;
        go(event);
      }}
      onLostPointerCapture={() => (held.current = false)}
      onPointerMove={(event) => event.buttons > 0 && go(event)}
    >
      <path d={shapes} />
      <rect ref={frame} strokeWidth={1.5} vectorEffect="non-scaling-stroke" />
    </svg>
  );
}
