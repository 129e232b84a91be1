/** What a document says to the others of its origin: its name and when it began, or that a name is another's. */
type Said = { ask: string; since: number; from: string } | { taken: string; by: string; to: string };

/** What of BroadcastChannel is needed; tests give others. */
export type Channel = Pick<BroadcastChannel, "postMessage"> & { onmessage: ((event: MessageEvent<Said>) => void) | null };

const kStored = "sentree.page";
const fresh = () => `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}`;

/**
 * What a page calls itself: the same after it is loaded anew, and never that of another that is open. A tab that was
 * duplicated has the name of the other at first; the one that is younger gives it up.
 */
export class PageName {
  private readonly id = fresh();
  private name: string;

  constructor(
    private readonly stored: Pick<Storage, "getItem" | "setItem">,
    private readonly channel: Channel,
    private readonly since: number,
    private readonly renamed: () => void,
  ) {
    this.name = stored.getItem(kStored) ?? fresh();
    stored.setItem(kStored, this.name);
    channel.onmessage = ({ data }) => this.hear(data);
    channel.postMessage({ ask: this.name, since, from: this.id } satisfies Said);
  }

  get current(): string {
    return this.name;
  }

  private hear(said: Said): void {
    if ("taken" in said) {
      if (said.to === this.id && said.taken === this.name) this.give_up();
      return;
    }
    if (said.ask !== this.name) return;
    const is_older = this.since < said.since || (this.since === said.since && this.id < said.from);
    if (is_older) this.channel.postMessage({ taken: this.name, by: this.id, to: said.from } satisfies Said);
    else this.give_up();
  }

  private give_up(): void {
    this.name = fresh();
    this.stored.setItem(kStored, this.name);
    this.renamed();
  }
}
