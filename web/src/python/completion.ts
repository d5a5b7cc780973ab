/** What fits at the cursor of a Python text: names of steps, their arguments, and the values of these. */

import { type Completion, type CompletionContext, type CompletionResult, startCompletion } from "@codemirror/autocomplete";
import { ensureSyntaxTree, syntaxTree } from "@codemirror/language";
import type { EditorState } from "@codemirror/state";
import type { EditorView } from "@codemirror/view";
import type { Profile } from "../api/types";
import { levelMeaning, plainSeconds } from "../blocks/figures";
import { PYTHON_CALLS, PYTHON_SETTINGS, STEP_KINDS } from "../generated/steps";
import { say, textAt } from "../i18n";

interface Parameter {
  name: string;
  least: number;
  most: number;
  menu?: "speed" | "light" | "radius";
}

/** A function that makes a step. */
interface Call extends Pick<(typeof PYTHON_CALLS)[number], "name" | "kind" | "signature" | "example"> {
  parameters: readonly Parameter[];
}

export const CALLS: readonly Call[] = PYTHON_CALLS;
const stepOf = ({ kind }: Call) => STEP_KINDS.find((each) => each.kind === kind)!;

export const meaningOf = ({ name, kind }: Call): string => textAt(`python.does.${name}`) ?? say(`tooltips.${kind}`);

export const rangeOf = ({ least, most }: Parameter): string => say("python.range", { least, most });

const PARSED_WITHIN_MS = 100;

/** The brackets of a call around the cursor, and what stands in them before it. */
interface Place {
  call: string;
  /** Names of arguments that are given already. */
  given: Set<string>;
  /** The argument whose value the cursor is in. */
  keyword: string | null;
  /** How many commas there are before the cursor. */
  commas: number;
}

/** The calls around a position, the innermost first; null in a comment, a string or an import. */
function placesAt(state: EditorState, at: number): Place[] | null {
  const text = (node: { from: number; to: number }) => state.sliceDoc(node.from, node.to);
  const places: Place[] = [];
  // On a slow computer the text may not be parsed yet up to here.
  const tree = ensureSyntaxTree(state, at, PARSED_WITHIN_MS) ?? syntaxTree(state);
  for (let node = tree.resolveInner(at, -1), inner: typeof node | null = null; ; inner = node, node = node.parent!) {
    if (["Comment", "String", "ImportStatement", "MemberExpression"].includes(node.name)) return null;
    const isClosed = node.lastChild?.name === ")" && at >= node.to;
    if (node.name === "ArgList" && at > node.from && !isClosed) {
      const place: Place = { call: node.prevSibling ? text(node.prevSibling) : "", given: new Set(), keyword: null, commas: 0 };
      for (let child = node.firstChild; child && child.from < at && child !== inner; child = child.nextSibling) {
        if (child.name === "," && child.to <= at) Object.assign(place, { keyword: null, commas: place.commas + 1 });
        if (child.name === "AssignOp" && child.prevSibling) place.given.add((place.keyword = text(child.prevSibling)));
      }
      places.push(place);
    }
    if (!node.parent) return places;
  }
}

/** Put a name at the cursor, which stands `behind` it then, and show what fits there. */
function insert(view: EditorView, from: number, to: number, text: string, behind = text.length): void {
  view.dispatch({ changes: { from, to, insert: text }, selection: { anchor: from + behind }, userEvent: "input.complete" });
  startCompletion(view);
}

/** Put a call at the cursor, which stands between its brackets then. */
function applyCall(view: EditorView, { label }: Completion, from: number, to: number): void {
  const brackets = view.state.sliceDoc(to, to + 1) === "(" ? "" : "()";
  insert(view, from, to, label + brackets, label.length + 1);
}

/** A name of an argument; its values show once it is chosen. */
const nameOption = (name: string, detail: string, boost?: number): Completion => ({
  label: `${name}=`,
  type: "property",
  detail,
  apply: (view, { label }, from, to) => insert(view, from, to, label),
  ...(boost && { boost }),
});

const callOption = (call: Call): Completion => ({
  label: call.name,
  type: "function",
  detail: call.signature.slice(call.name.length),
  info: meaningOf(call),
  apply: applyCall,
});

/** The values of an argument: its levels, with what they mean; for seconds those that a word can hold. */
function valueOptions(call: Call, { name, least, most, menu }: Parameter, profile: Profile): Completion[] {
  const option = (label: string, boost: number, detail?: string): Completion => ({ label, detail, type: "constant", boost });
  if (name === "seconds") return profile.durations_ms.filter(Boolean).map((ms, place) => option(plainSeconds(ms), 50 - place));
  if (!menu) return [];
  const turning = call.name === "left" || call.name === "right";
  const levels = Array.from({ length: most - least + 1 }, (_, k) => least + k);
  return levels.map((level) => option(String(level), 50 - level, levelMeaning(profile, menu, level, turning)));
}

const UNLESS = "unless";
/** What each drive can mind. */
const MINDED = ["person()", "heard()", "obstacle(1)"];

function argumentOptions(call: Call, outer: readonly Place[], { given, keyword, commas }: Place, profile: Profile): Completion[] {
  // A part of a together lasts as long as the others; a step of followers alone has their settings.
  const isPart = outer[0]?.call === "together";
  const settings = outer.some(({ call: name, keyword: word }) => name === "Followers" || word === "followers") && !isPart ? PYTHON_SETTINGS : [];
  if (keyword !== null) {
    if (keyword === UNLESS) return MINDED.map((label) => ({ label, type: "constant" }));
    if (settings.some((each) => each === keyword)) return ["True", "False"].map((label) => ({ label, type: "constant" }));
    const parameter = call.parameters.find(({ name }) => name === keyword);
    return parameter ? valueOptions(call, parameter, profile) : [];
  }
  const open = isPart && stepOf(call).accompanies ? [] : call.parameters.slice(commas - given.size);
  const next = given.size === 0 ? open[0] : undefined;
  const named = open.filter(({ name }) => !given.has(name)).map((each) => nameOption(each.name, rangeOf(each)));
  const minded = stepOf(call).drives && !given.has(UNLESS) ? [nameOption(UNLESS, say("python.minded"), -40)] : [];
  const switches = settings.filter((name) => !given.has(name)).map((name) => nameOption(name, say("python.setting"), -50));
  return [...(next ? valueOptions(call, next, profile) : []), ...named, ...minded, ...switches];
}

/** What fits at a position, for cars of a profile; null where nothing is to be shown. */
export function completeAt(context: CompletionContext, profile: Profile): CompletionResult | null {
  const { state, pos, explicit } = context;
  const word = context.matchBefore(/[\w.]+/);
  const from = word?.from ?? pos;
  const places = placesAt(state, pos);
  if (!places) return null;
  const [place, ...outer] = places;
  const call = CALLS.find(({ name }) => name === place?.call);
  // Without a call around it, a list would be in the way at each new line.
  if (!explicit && !word && !(call && context.matchBefore(/[(,=] */))) return null;
  const options = call && place ? argumentOptions(call, outer, place, profile) : [];
  const inside = CALLS.filter((each) => !(stepOf(each).holds && place?.call === "together"));
  const takesSteps = !call || (stepOf(call).holds && place!.keyword === null && place!.commas >= call.parameters.length);
  if (takesSteps) options.push(...inside.map(callOption));
  return options.length > 0 ? { from, options, validFor: /^\w*$/ } : null;
}
