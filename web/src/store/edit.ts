import { create } from "zustand";

import { useStudio } from "./store";

/** A part of the project that is to be edited: a state or all of a file, or a node of the mission. */
export type EditPlace = { file: string; state: string } | { node: { id: string; name: string } };

/** What is to be edited next, in a page that edits its project; null: nothing. */
export const useEdit = create<{ wanted: EditPlace | null }>()(() => ({ wanted: null }));

/** Goes there; null: this page edits nothing. */
export function useEditing(): ((place: EditPlace) => void) | null {
  return useStudio((studio) => studio.hello?.design ?? false) ? edit : null;
}
const edit = (wanted: EditPlace) => useEdit.setState({ wanted });
