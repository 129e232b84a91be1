import { useState } from "react";

import type { PanelId } from "../widgets/arrangement";
import { useCommand } from "../widgets/commands";
import { Icon } from "../widgets/Icon";
import { toggle_maximised, useLayout } from "../widgets/layout";
import { Menu, type MenuEntry } from "../widgets/Menu";
import { kZoomStep } from "./picture_view";
import { save_picture_of, usePictures } from "./pictures";

/** Everything about how a panel's picture is seen, in one menu; `more` is the panel's own. `id` null: no picture now. */
export function PictureTools({ panel, id, name, fit, zoom, more }: { panel: PanelId; id: string | null; name: string; fit(): void; zoom(factor: number): void; more: readonly MenuEntry[] }) {
  const maximised = useLayout((layout) => layout.maximised === panel);
  useCommand(
    ...(id === null
      ? []
      : [
          { id: `save.${id}.svg`, title: `Save the ${name} as SVG`, group: "Export", run: () => save_picture_of(id, "svg") },
          { id: `save.${id}.png`, title: `Save the ${name} as PNG`, group: "Export", run: () => save_picture_of(id, "png") },
        ]),
  );
  const choosing = usePictures((pictures) => (pictures.choosing?.panel === panel ? pictures.choosing : null));
  const save: MenuEntry[] =
    id === null
      ? []
      : [
          { label: "Save as SVG", hint: "for documents", run: () => save_picture_of(id, "svg") },
          { label: "Save as PNG", hint: "2× pixels", run: () => save_picture_of(id, "png") },
        ];
  const picture: MenuEntry[] =
    id === null
      ? []
      : [
          { label: "Show all", hint: "0", run: fit },
          { label: "Zoom in", hint: "+", run: () => zoom(kZoomStep) },
          { label: "Zoom out", hint: "−", run: () => zoom(1 / kZoomStep) },
          "line",
          ...save,
        ];
  return (
    <>
      <MenuButton
        label={`View of the ${name}`}
        data_view={panel}
        saves={id !== null}
        entries={[...more, "line", ...picture, { label: maximised ? "Back into its place" : "Fill the page", hint: "X", run: () => toggle_maximised(panel) }]}
      />
      {choosing && save.length > 0 && (
        <Menu x={choosing.x} y={choosing.y} label={`Save the ${name}`} close={() => usePictures.setState({ choosing: null })} entries={save} />
      )}
    </>
  );
}

/** A button that says “View” and opens a menu below it. */
export function MenuButton({ label, entries, data_view, saves = false, text = "View" }: { label: string; entries: readonly MenuEntry[]; data_view: string; saves?: boolean; text?: string }) {
  const [at, set_at] = useState<{ x: number; y: number } | null>(null);
  return (
    <>
      <button
        className="button small"
        aria-label={label}
        aria-haspopup="menu"
        data-view-of={data_view}
        data-saves={saves || undefined}
        onClick={(event) => {
          const box = event.currentTarget.getBoundingClientRect();
          set_at({ x: box.left, y: box.bottom + 2 });
        }}
      >
        {text}
        <Icon name="down" />
      </button>
      {at && <Menu {...at} label={label} close={() => set_at(null)} entries={entries} />}
    </>
  );
}
