/** Keys that wait at most. */
const kWaitingMax = 100;

interface Waiting {
  target: HTMLElement | SVGElement;
  init: KeyboardEventInit;
}

let under_way = 0;
let taking = false;
const waiting: Waiting[] = [];
const again = new WeakSet<Event>();
let done: (() => void)[] = [];

/** While `what` is on its way, keys of pictures wait: they are meant of what it leaves. */
export async function under_way_with<T>(what: () => Promise<T>): Promise<T> {
  under_way += 1;
  try {
    return await what();
  } finally {
    under_way -= 1;
    if (under_way === 0) {
      done.forEach((tell) => tell());
      done = [];
    }
  }
}

/** Whether a key may be taken now. Else it comes again, in its order, once the edit before it is done and is to be seen. */
export function in_turn(event: React.KeyboardEvent): boolean {
  const { nativeEvent: native, currentTarget: target } = event;
  if (again.has(native) || (under_way === 0 && waiting.length === 0) || ["Control", "Shift", "Alt", "Meta"].includes(native.key)) return true;
  if (!(target instanceof HTMLElement || target instanceof SVGElement)) return true;
  event.preventDefault();
  event.stopPropagation();
  const { key, code, ctrlKey, shiftKey, altKey, metaKey, repeat } = native;
  // A key that is held goes on as fast as the program does, and ends when it is let go.
  if (waiting.length >= kWaitingMax || (repeat && waiting.at(-1)?.init.key === key)) return false;
  waiting.push({ target, init: { key, code, ctrlKey, shiftKey, altKey, metaKey, bubbles: true, cancelable: true } });
  if (!taking) void take();
  return false;
}

async function take(): Promise<void> {
  taking = true;
  for (let next = waiting[0]; next; next = waiting[0]) {
    while (under_way > 0) await new Promise<void>((tell) => done.push(tell));
    // What the page was told is drawn.
    await new Promise((drawn) => setTimeout(drawn));
    if (under_way > 0) continue;
    waiting.shift();
    send(next);
  }
  taking = false;
}

/** To where the focus is now: what waited may have opened a field, and then the next keys are its. */
function send({ target, init }: Waiting): void {
  const { activeElement } = document;
  const field = activeElement instanceof HTMLInputElement || activeElement instanceof HTMLTextAreaElement ? activeElement : null;
  const event = new KeyboardEvent("keydown", init);
  again.add(event);
  const taken = !(field ?? target).dispatchEvent(event);
  if (field && !taken && !init.ctrlKey && !init.metaKey && !init.altKey && init.key?.length === 1) {
    field.setRangeText(init.key, field.selectionStart ?? 0, field.selectionEnd ?? 0, "end");
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
}
