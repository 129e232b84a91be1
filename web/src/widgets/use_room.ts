import { useLayoutEffect, useState } from "react";

import type { Size } from "../protocol/types";

/** How large an element is; null before it is shown. `there`: whether it is shown at all. */
export function useRoom(frame: React.RefObject<HTMLElement | null>, there: boolean): Size | null {
  const [room, set_room] = useState<Size | null>(null);
  useLayoutEffect(() => {
    if (!there || !frame.current) return;
    const { width, height } = frame.current.getBoundingClientRect();
    set_room({ width, height });
    const observer = new ResizeObserver(([entry]) => entry && set_room({ width: entry.contentRect.width, height: entry.contentRect.height }));
    observer.observe(frame.current);
    return () => observer.disconnect();
  }, [frame, there]);
  return room;
}
