import { useEffect, useRef } from "react";
import { create } from "zustand";

import { clock_text } from "../draw/format";
import { useCommands } from "../widgets/commands";
import { useStudio } from "../store/store";
import { save_picture, type Picture } from "./export";

interface Pictures {
  /** Pictures that can be saved now, by the panel or chart that draws them. Null: nothing is drawn there yet. */
  makers: ReadonlyMap<string, () => Picture | null>;
  /** The panel whose picture somebody is about to save, and where the choice of files opens. */
  choosing: { panel: string; x: number; y: number } | null;
}
export const usePictures = create<Pictures>()(() => ({ makers: new Map(), choosing: null }));

/** Offers a picture for saving while the calling component is shown. */
export function usePicture(id: string, make: () => Picture | null): void {
  const latest = useRef(make);
  latest.current = make;
  useEffect(() => {
    const maker = () => latest.current();
    usePictures.setState(({ makers }) => ({ makers: new Map(makers).set(id, maker) }));
    return () =>
      usePictures.setState(({ makers }) => {
        const next = new Map(makers);
        if (next.get(id) === maker) next.delete(id);
        return { makers: next };
      });
  }, [id]);
}

export function save_picture_of(id: string, ending: "svg" | "png"): void {
  const picture = usePictures.getState().makers.get(id)?.();
  const { hello, state } = useStudio.getState();
  if (!picture) return;
  // The moment that it shows is part of the name: several of one run lie side by side.
  const time = state ? `${clock_text(state.time, 3).replaceAll(":", "m")}s` : "";
  void save_picture(picture, [hello?.title ?? "sentree", time], ending);
}

/** Opens the choice of files for the picture of the panel that has the focus, else of the map. */
function save_focused(): void {
  const panel = document.activeElement?.closest(".panel")?.id.replace("panel-", "") ?? "map";
  const box = document.querySelector(`[data-view-of="${panel}"][data-saves]`)?.getBoundingClientRect();
  if (box) usePictures.setState({ choosing: { panel, x: box.left, y: box.bottom + 2 } });
}

const kSave = { id: "save", title: "Save the panel's picture as SVG or PNG", group: "Export", keys: ["E"], run: save_focused };
useCommands.setState(({ commands }) => ({ commands: new Map(commands).set(kSave.id, kSave) }));
