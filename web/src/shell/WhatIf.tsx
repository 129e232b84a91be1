import { useEffect, useRef, useState } from "react";
import { create } from "zustand";

import { clock_text, data_text } from "../draw/format";
import type { Data, Observation } from "../protocol/types";
import { request, useStudio } from "../store/store";
import { Dialog } from "../widgets/Dialog";
import { Icon } from "../widgets/Icon";
import { run_again } from "../widgets/run_commands";
import { choices_of, chosen_otherwise, offer_of, type Choice, type Offer, type Possible } from "./choices";

/** `refused`: what was asked for last, where the run does not begin so. */
const useWhatIf = create<{ open: boolean; refused: { choice: string; typed: string; why: string } | null }>()(() => ({ open: false, refused: null }));
export const open_what_if = () => useWhatIf.setState({ open: true, refused: null });
const close = () => useWhatIf.setState({ open: false });

/** Choices that are listed at most, and observations that one request brings. */
const kListedMax = 1000;
const kPage = 500;

interface Found {
  choices: Choice[];
  /** Of each, what it could have been. */
  possible: Possible[];
  /** There are too many to be listed. */
  more: boolean;
}
const kNothing: Found = { choices: [], possible: [], more: false };

const named = ({ model, number }: Choice) => `${model}#${number}`;

/** What models have chosen in this run up to the moment shown, in order. */
async function load(until: number): Promise<Found> {
  const found: Observation[] = [];
  for (let before = until + 1; found.length < kListedMax; ) {
    const { messages, more } = await request("messages", { before, limit: kPage, filter: { name: "*.choice" } });
    found.unshift(...messages);
    const first = messages[0];
    if (!more || !first) {
      const choices = choices_of(found);
      return { choices, possible: await request("alternatives", { choices: choices.map(named) }).catch(() => []), more: false };
    }
    before = first.sequence;
  }
  return { ...kNothing, more: true };
}

/** What models chose, each with its other alternatives: the run begins again, and is the same up to there. */
export function WhatIf() {
  const open = useWhatIf((state) => state.open);
  const boot = useStudio((studio) => studio.hello?.boot);
  useEffect(close, [boot]);
  return open ? <Choices /> : null;
}

function Choices() {
  const [found, set_found] = useState<Found | null>(null);
  const sequence = useStudio((studio) => studio.state?.sequence ?? 0);
  const [until] = useState(sequence);
  useEffect(() => {
    let gone = false;
    load(until).then(
      (loaded) => !gone && set_found(loaded),
      () => !gone && set_found(kNothing),
    );
    return () => {
      gone = true;
    };
  }, [until]);
  const refused = useWhatIf((state) => state.refused);
  const take = (i: number, value: Data) => {
    const { choices } = found!;
    close();
    run_again({ choose: chosen_otherwise(choices, i, value) }, (why) => useWhatIf.setState({ open: true, refused: { choice: named(choices[i]!), typed: data_text(value), why } }));
  };
  return (
    <Dialog label="What if a model had chosen otherwise" className="what-if" close={close}>
      <header className="dialog-bar">
        <h2>What if a model had chosen otherwise?</h2>
        <button className="icon-button" onClick={close} aria-label="Close">
          <Icon name="close" />
        </button>
      </header>
      {found === null && <p className="empty">Looking for what models chose …</p>}
      {found?.more && <p className="empty">Models chose more than {kListedMax} times up to here. Go back in the run, and ask again.</p>}
      {found && !found.more && found.choices.length === 0 && <p className="empty">No model has chosen anything up to the moment shown. A model is a chart in place of a service that leaves open what may happen; <span className="mono">models:</span> in sentree.yaml names those of a project.</p>}
      {found && found.choices.length > 0 && (
        <>
          <p className="what-if-hint muted">The run begins again, chooses the same up to there and the other alternative then; behind it each model takes its first one.</p>
          <ol className="what-if-list scroll" tabIndex={0} aria-label="Choices">
            {found.choices.map((choice, i) => (
              <Row
                key={named(choice)}
                choice={choice}
                offer={offer_of(found.choices, choice, found.possible[i] ?? null)}
                refused={refused?.choice === named(choice) ? refused : null}
                take={(value) => take(i, value)}
              />
            ))}
          </ol>
        </>
      )}
    </Dialog>
  );
}

function Row({ choice, offer, refused, take }: { choice: Choice; offer: Offer; refused: { typed: string; why: string } | null; take(value: Data): void }) {
  const [typed, set_typed] = useState(refused?.typed ?? "");
  const field = useRef<HTMLInputElement>(null);
  const name = named(choice);
  const why = refused ? `${name}-refused` : undefined;
  useEffect(() => {
    if (refused) field.current?.focus();
  }, [refused]);
  return (
    <li data-choice={name} data-value={data_text(choice.value)}>
      <span className="number muted">{clock_text(choice.time)}</span>
      <strong className="mono">{name}</strong>
      <span className="what-if-what">
        {choice.name || choice.function} = <span className="mono">{data_text(choice.value)}</span>
        {choice.place && <span className="muted"> {choice.place}</span>}
      </span>
      <span className="what-if-others">
        {offer.others.length === 0 && !offer.typed && <span className="muted">nothing else</span>}
        {offer.as === "buttons" ? (
          offer.others.map((value) => (
            <button key={data_text(value)} className="button small" onClick={() => take(value)}>
              {data_text(value)} instead
            </button>
          ))
        ) : (
          <select className="field small" aria-label={`Another value of ${name}`} value="" onChange={(event) => take(offer.others[Number(event.target.value)] ?? null)}>
            <option value="" disabled>
              {offer.others.length} others …
            </option>
            {offer.others.map((value, i) => (
              <option key={data_text(value)} value={i}>
                {data_text(value)}
              </option>
            ))}
          </select>
        )}
        {offer.typed && (
          <form
            onSubmit={(event) => {
              event.preventDefault();
              if (typed.trim() !== "") take(typeof choice.value === "number" && Number.isFinite(Number(typed)) ? Number(typed) : typed.trim());
            }}
          >
            <input
              ref={field}
              className="field small"
              aria-label={`Another value of ${name}`}
              aria-invalid={refused !== null}
              aria-describedby={why}
              placeholder={offer.typed.hint}
              title={offer.typed.hint}
              spellCheck={false}
              value={typed}
              onChange={(event) => set_typed(event.target.value)}
            />
          </form>
        )}
      </span>
      {refused && (
        <p className="what-if-refused" id={why} role="alert">
          {refused.why}
        </p>
      )}
    </li>
  );
}
