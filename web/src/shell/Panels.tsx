import { useState } from "react";

import { panels } from "../panels/registry";
import { MenuButton } from "../picture/PictureTools";
import { kPlaces, kSides, type Place, type SideId } from "../widgets/arrangement";
import { Dialog } from "../widgets/Dialog";
import { forget_arrangement, place_panel, reset_layout, save_arrangement, useArrangements, useLayout } from "../widgets/layout";
import type { MenuEntry } from "../widgets/Menu";
import { by_name } from "../widgets/natural";

const kSaid: Record<Place, string> = { side: "in the column", below: "beside the timeline", closed: "closed" };

const title_of = (id: SideId) => panels.find((panel) => panel.id === id)!.title;

/** Where panels stand, and arrangements by name. */
export function Panels() {
  const places = useLayout((layout) => layout.places);
  const saved = useArrangements((state) => state.saved);
  const names = Object.keys(saved).sort(by_name);
  const entries: MenuEntry[] = [
    ...kSides.flatMap((id): MenuEntry[] => [
      { heading: title_of(id) },
      ...kPlaces.map((place) => ({ label: kSaid[place], checked: places[id] === place, run: () => place_panel(id, place) })),
    ]),
    { heading: "Arrangements" },
    ...names.map((name) => ({ label: name, run: () => useLayout.setState(saved[name]!) })),
    { label: "Save this one as …", run: () => useArrangements.setState({ asking: true }) },
    ...names.map((name) => ({ label: `Forget ${name}`, run: () => forget_arrangement(name) })),
    { label: "As it was at first", run: reset_layout },
  ];
  return <MenuButton label="Panels and arrangements" text="Panels" data_view="panels" entries={entries} />;
}

/** Asks for the name of the present arrangement. */
export function ArrangementName() {
  const asking = useArrangements((state) => state.asking);
  return asking ? <Asking /> : null;
}

function Asking() {
  const [name, set_name] = useState("");
  const close = () => useArrangements.setState({ asking: false });
  return (
    <Dialog label="Name of the arrangement" className="confirm" close={close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          if (name.trim() !== "") save_arrangement(name.trim());
        }}
      >
        <label>
          Name of the arrangement <input className="field" autoFocus maxLength={40} value={name} onChange={(event) => set_name(event.target.value)} />
        </label>
        <div className="row end">
          <button type="button" className="button" onClick={close}>
            Cancel
          </button>
          <button className="button primary" disabled={name.trim() === ""}>
            Save
          </button>
        </div>
      </form>
    </Dialog>
  );
}
