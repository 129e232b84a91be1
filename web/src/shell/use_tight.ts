import { useLayoutEffect } from "react";

/** What is left out step by step where a row has no room for all of it: `.room-1` first. */
const kSteps = 3;

/** Writes into `data-tight` of a row how far what is in it must give way to fit: "1", "1 2", … */
export function useTight(row: React.RefObject<HTMLElement | null>): void {
  useLayoutEffect(() => {
    const element = row.current;
    if (!element) return;
    const fit = () => {
      delete element.dataset["tight"];
      const steps: number[] = [];
      while (element.scrollWidth > element.clientWidth && steps.length < kSteps) {
        steps.push(steps.length + 1);
        element.dataset["tight"] = steps.join(" ");
      }
    };
    fit();
    const sized = new ResizeObserver(fit);
    sized.observe(element);
    // The clock runs on; it keeps its width.
    const changed = new MutationObserver((records) => {
      if (records.some(({ target }) => !(target instanceof Element ? target : target.parentElement)?.closest(".clock"))) fit();
    });
    changed.observe(element, { childList: true, characterData: true, subtree: true });
    void document.fonts.ready.then(fit);
    return () => {
      sized.disconnect();
      changed.disconnect();
    };
  }, [row]);
}
