import { useState } from "react";

import { Icon } from "../widgets/Icon";
import { Menu } from "../widgets/Menu";
import { useCommand } from "../widgets/commands";
import { kZoomStep } from "./picture_view";
import { save_picture_of } from "./pictures";

/** Zoom, fit and save: the same for every picture. */
export function PictureTools({ id, name, fit, zoom }: { id: string; name: string; fit?(): void; zoom?(factor: number): void }) {
  useCommand(
    { id: `save.${id}.svg`, title: `Save the ${name} as SVG`, group: "Export", run: () => save_picture_of(id, "svg") },
    { id: `save.${id}.png`, title: `Save the ${name} as PNG`, group: "Export", run: () => save_picture_of(id, "png") },
  );
  return (
    <>
      {zoom && (
        <>
          <button className="icon-button" aria-label={`Zoom out of the ${name}`} title="Zoom out (−)" onClick={() => zoom(1 / kZoomStep)}>
            <Icon name="minus" />
          </button>
          <button className="icon-button" aria-label={`Zoom into the ${name}`} title="Zoom in (+)" onClick={() => zoom(kZoomStep)}>
            <Icon name="plus" />
          </button>
        </>
      )}
      {fit && (
        <button className="icon-button" aria-label={`Show all of the ${name}`} title="Show all (0)" onClick={fit}>
          <Icon name="fit" />
        </button>
      )}
      <SaveButton id={id} name={name} />
    </>
  );
}

/** Opens the choice between the two kinds of file. */
export function SaveButton({ id, name }: { id: string; name: string }) {
  const [at, set_at] = useState<{ x: number; y: number } | null>(null);
  return (
    <>
      <button
        className="icon-button"
        aria-label={`Save the ${name} as a picture`}
        aria-haspopup="menu"
        title="Save as a picture (E with the panel chosen)"
        data-save={id}
        onClick={(event) => {
          const box = event.currentTarget.getBoundingClientRect();
          set_at({ x: box.right - 180, y: box.bottom + 2 });
        }}
      >
        <Icon name="download" />
      </button>
      {at && (
        <Menu
          x={at.x}
          y={at.y}
          label={`Save the ${name}`}
          close={() => set_at(null)}
          entries={[
            { label: "Save as SVG", hint: "for documents", run: () => save_picture_of(id, "svg") },
            { label: "Save as PNG", hint: "2× pixels", run: () => save_picture_of(id, "png") },
          ]}
        />
      )}
    </>
  );
}
