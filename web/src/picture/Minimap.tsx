import { useEffect, useMemo, useRef, useState } from "react";

import type { Rect } from "../protocol/types";
import type { PictureView } from "./picture_view";
import { to_picture } from "./viewport";

const kWidthMax_px = 168;
const kHeightMax_px = 112;
const kLeast_px = 44;
/** Of the picture's own room, so that it does not hide what one looks at. */
const kWidthShare = 0.25;
const kHeightShare = 0.35;
/** What is hidden of a picture before it needs a map. */
const kSlack_px = 2;

/** All of a picture of which only a part is shown, in its corner; a click or a drag in it goes there. */
export function Minimap({ view, box, rects }: { view: PictureView; box: Rect; rects: readonly Rect[] }) {
  const frame = useRef<SVGRectElement>(null);
  /** 0: all is in sight. */
  const [scale, set_scale] = useState(0);
  // A picture that is a long stripe is widened, so that one can hit it.
  const [width, height] = [Math.max(box.width * scale, kLeast_px), Math.max(box.height * scale, kLeast_px)];
  const shapes = useMemo(() => rects.map(({ x, y, width, height }) => `M${x} ${y}h${width}v${height}h${-width}z`).join(""), [rects]);
  useEffect(() => {
    const draw = () => {
      const { view: shown, size } = view;
      const [left, top] = to_picture(shown, [0, 0]);
      const [right, bottom] = to_picture(shown, [size.width, size.height]);
      const slack = kSlack_px / shown.scale;
      const needed = size.width > 0 && (left > box.x + slack || top > box.y + slack || right < box.x + box.width - slack || bottom < box.y + box.height - slack);
      const [wide, high] = [Math.min(kWidthMax_px, size.width * kWidthShare), Math.min(kHeightMax_px, size.height * kHeightShare)];
      set_scale(needed ? Math.min(wide / box.width, high / box.height) : 0);
      const clamped = { x: Math.max(left, box.x), y: Math.max(top, box.y) };
      frame.current?.setAttribute("x", String(clamped.x));
      frame.current?.setAttribute("y", String(clamped.y));
      frame.current?.setAttribute("width", String(Math.max(Math.min(right, box.x + box.width) - clamped.x, 0)));
      frame.current?.setAttribute("height", String(Math.max(Math.min(bottom, box.y + box.height) - clamped.y, 0)));
    };
    draw();
    return view.watch(draw);
  }, [view, box, scale]);
  if (scale === 0) return null;
  const go = (event: React.PointerEvent<SVGSVGElement>) => {
    const at = event.currentTarget.getBoundingClientRect();
    view.keep_centred([box.x + ((event.clientX - at.left) / at.width) * box.width, box.y + ((event.clientY - at.top) / at.height) * box.height]);
  };
  return (
    <svg
      className="minimap"
      width={width}
      height={height}
      preserveAspectRatio="none"
      viewBox={`${box.x} ${box.y} ${box.width} ${box.height}`}
      aria-hidden="true"
      data-testid="minimap"
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        go(event);
      }}
      onPointerMove={(event) => event.buttons > 0 && go(event)}
    >
      <path d={shapes} />
      <rect ref={frame} strokeWidth={1.5} vectorEffect="non-scaling-stroke" />
    </svg>
  );
}
