/** On what the world stops: conditions that the user has chosen by a car, a thing, a zone or a block. */

import * as Blockly from "blockly/core";
import { create } from "zustand";
import { type CompiledWord, EDITORS, type EditorName } from "../api/types";
import { withInner } from "../blocks/asked";
import { findText } from "../blocks/workspaces";
import type { MissionZone, StopCondition } from "../generated/messages";
import { inLanguage, say } from "../i18n";
import type { Point } from "../mat/document";
import { isInside } from "../mat/room";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { endAll } from "../ui/areas";
import { askedKeyOf } from "../words/deciding";

type Kind = StopCondition["kind"];

/** A condition; of a block it has the block, whose words differ from program to program: those that it makes, or that ask it. */
interface ChosenStop {
  condition: StopCondition;
  block?: { editor: EditorName; id: string; text: string };
}

interface Stops {
  stops: readonly ChosenStop[];
  /** The zone that was tapped. */
  zone: MissionZone | null;
}

export const useStops = create<Stops>(() => ({ stops: [], zone: null }));

const MOST_STOPS = 20;
/** The kinds that need nothing but a car. */
export const CAR_KINDS = ["touch", "lost", "stuck"] as const satisfies readonly Kind[];

const keyOf = ({ condition, block }: ChosenStop): string => JSON.stringify(block ? block.id : condition);

/** Stop on one thing more. */
export function addStop(stop: ChosenStop): void {
  const { stops } = useStops.getState();
  if (stops.length >= MOST_STOPS) return;
  if (!stops.some((each) => keyOf(each) === keyOf(stop))) useStops.setState({ stops: [...stops, stop] });
  notify(say("stops.added", { what: nameOf(stop) }));
}

export function removeStop(place: number): void {
  useStops.setState(({ stops }) => ({ stops: stops.toSpliced(place, 1) }));
}

export function zoneStop(zone: MissionZone): ChosenStop {
  const { title, corners_m, centre_m, radius_m } = zone;
  const place = centre_m ? { disc: [...centre_m, radius_m!] } : { corners_m };
  return { condition: { kind: "zone", name: inLanguage(title), ...place } };
}

/** What a condition waits for, in words. */
export function nameOf({ condition, block }: ChosenStop): string {
  const { kind, car, thing, number, name } = condition;
  if (block && kind === "condition") return say("stops.met", { text: block.text });
  const who = car === undefined || car === null ? say("stops.anyCar") : say("mat.car", { number: car });
  if (block) return say("stops.block", { text: block.text });
  if (kind === "zone") return say("stops.zone", { who, zone: name ?? "" });
  if (thing) return say("stops.touches", { who, thing: say(`mat.things.${thing as "wall"}`), number: (number ?? 0) + 1 });
  return say(`stops.${kind as (typeof CAR_KINDS)[number]}`, { who });
}

/** Which words ask a condition that a block is or is made of. */
function asks({ editor, id }: { editor: EditorName; id: string }): (word: CompiledWord) => boolean {
  const asked = withInner(editor, id);
  return (word) => word.part === editor && asked.has(askedKeyOf(word, word.block) ?? "");
}

/** What the world is sent: a block by the words that it makes now. */
function conditions(): StopCondition[] {
  const words = useStudio.getState().compiled?.words ?? [];
  return useStops.getState().stops.map(({ condition, block }) => {
    if (!block) return condition;
    const has = condition.kind === "condition" ? asks(block) : ({ part, block: id }: CompiledWord) => part === block.editor && id === block.id;
    return { ...condition, words: words.flatMap((word, index) => (has(word) ? [index] : [])) };
  });
}

/** Tell each new world on what to stop; returns what ends this. */
export function watchStops(): () => void {
  const send = () => session.send({ do: "stop-when", conditions: conditions() });
  return endAll(
    useStops.subscribe(({ stops }, before) => stops !== before.stops && useMat.getState().hello?.cars && send()),
    useMat.subscribe(({ hello }, before) => hello !== before.hello && hello?.cars && useStops.getState().stops.length && send()),
  );
}

/** Show the choices of the zone that lies under a point, if one does; the topmost. */
export function tapZone(point: Point | null, zones: readonly MissionZone[]): void {
  const [x, y] = point ?? [NaN, NaN];
  const inside = ({ corners_m, centre_m, radius_m }: MissionZone) =>
    centre_m ? Math.hypot(x - centre_m[0]!, y - centre_m[1]!) <= radius_m! : isInside(corners_m as unknown as readonly Point[], [x, y]);
  useStops.setState({ zone: zones.findLast(inside) ?? null });
}

/** Which editor's blocks make words that cars begin; a hat makes none. */
export function canStopAt(block: string): EditorName | null {
  const words = useStudio.getState().compiled?.words ?? [];
  return EDITORS.find((editor) => words.some(({ part, block: id }) => part === editor && id === block)) ?? null;
}

/** Add to the menus of blocks that the world stops when a car begins the block. To be called once. */
export function registerBlockStops(): void {
  Blockly.ContextMenuRegistry.registry.register({
    id: "motorcade-stop",
    weight: 1,
    scopeType: Blockly.ContextMenuRegistry.ScopeType.BLOCK,
    displayText: ({ block }) => say(block?.outputConnection ? "stops.whenMet" : "stops.whenBegun"),
    preconditionFn: ({ block }) => (block && (block.outputConnection ? !block.isInFlyout : canStopAt(block.id)) ? "enabled" : "hidden"),
    callback: ({ block }) => {
      const editor = block && (block.outputConnection ? "leader" : canStopAt(block.id));
      const kind = block?.outputConnection ? "condition" : "block";
      if (editor) addStop({ condition: { kind }, block: { editor, id: block.id, text: findText(editor, block.id) } });
    },
  });
}
