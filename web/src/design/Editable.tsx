import type { ReactNode } from "react";

import { obstacle, useDesign } from "./design";

/** Fields that only show what is there while the open file cannot be edited; why is told where the pointer is. */
export function Editable({ children }: { children: ReactNode }) {
  const why_not = useDesign(obstacle);
  return (
    <fieldset className="editable" disabled={why_not !== null} title={why_not ?? undefined}>
      {children}
    </fieldset>
  );
}
