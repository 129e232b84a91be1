import { createContext, useContext, type ReactNode } from "react";
import { createPortal } from "react-dom";

/** Where the shell wants a panel's tools. */
export const ToolsPlace = createContext<HTMLElement | null>(null);

/** A panel's own buttons and fields, shown in its bar. */
export function PanelTools({ children }: { children: ReactNode }) {
  const place = useContext(ToolsPlace);
  return place ? createPortal(children, place) : null;
}
