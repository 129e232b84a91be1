import { create } from "zustand";

/** What the page of a project that is edited shows: its files, or how it goes. */
export const useMode = create<{ mode: "design" | "run" }>()(() => ({ mode: "design" }));
