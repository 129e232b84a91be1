import { useLayoutEffect, useRef, useState, type RefObject } from "react";

import type { Rect, Size } from "../protocol/types";
import { PictureView, type PictureOptions } from "./picture_view";
import type { Viewport } from "./viewport";

export interface PictureUse extends Omit<PictureOptions, "change"> {
  /** What the picture covers. */
  box: Rect;
  /** The view or the size of the panel has changed, and the group with it. */
  change?(view: Viewport, size: Size, group: SVGGElement | null): void;
}

export interface PictureHandles {
  svg: RefObject<SVGSVGElement | null>;
  /** What is panned and zoomed. */
  group: RefObject<SVGGElement | null>;
  view: PictureView;
  /** Pans and zooms by keys; what is no such key goes on. */
  keys(event: React.KeyboardEvent): void;
}

/** A picture in an <svg> that can be panned and zoomed. `limits`, margins and scales are those of the first call. */
export function usePictureView(use: PictureUse): PictureHandles {
  const svg = useRef<SVGSVGElement>(null);
  const group = useRef<SVGGElement>(null);
  const latest = useRef(use);
  latest.current = use;
  const [view] = useState(() => {
    const { box: _box, change: _change, focus, grab, ...fixed } = use;
    return new PictureView({
      ...fixed,
      ...(focus ? { focus: () => latest.current.focus?.() ?? null } : {}),
      ...(grab ? { grab: (event, at) => latest.current.grab?.(event, at) ?? false } : {}),
      change: (now, size) => {
        group.current?.setAttribute("transform", `translate(${now.x} ${now.y}) scale(${now.scale})`);
        latest.current.change?.(now, size, group.current);
      },
    });
  });
  useLayoutEffect(() => view.set_box(use.box), [view, use.box]);
  useLayoutEffect(() => {
    const drawn = group.current;
    // The panel is measured without what is drawn in it, which then is laid out once, at its scale.
    if (drawn) drawn.style.display = "none";
    if (svg.current) view.attach(svg.current);
    if (drawn) drawn.style.display = "";
    return () => view.detach();
  }, [view]);
  const [keys] = useState(() => (event: React.KeyboardEvent) => {
    if (!view.key(event, true)) return;
    event.preventDefault();
    event.stopPropagation();
  });
  return { svg, group, view, keys };
}
