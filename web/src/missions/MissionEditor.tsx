import type { ReactNode } from "react";
import { Input, Label, TextField } from "react-aria-components";
import { GOAL_KINDS, GROUPS, TIMES } from "../generated/goals";
import type { MissionZone } from "../generated/messages";
import { useTexts } from "../i18n";
import { Choice, Quantity, ToolButton } from "../ui/fields";
import { useStudio } from "../state/studio";
import { classes } from "../ui/classes";
import { IconButton, TextButton } from "../ui/controls";
import {
  boxAt,
  boxOf,
  leaveDraft,
  discAt,
  type Draft,
  type DraftGoal,
  editDraft,
  type GoalKind,
  middleOf,
  newGoal,
  reshapedZone,
  saveDraft,
  saveToLibrary,
  touchesMat,
  tryDraft,
} from "./draft";
import css from "./missions.module.css";

const KINDS = Object.keys(GOAL_KINDS) as GoalKind[];
const LEDS = ["0", "1", "2", "3", "off"] as const;

/** Write a mission: its texts, its zones, which the stage shows, and its goals. */
export function MissionEditor({ draft }: { draft: Draft }) {
  const t = useTexts();
  return (
    <section className={classes(css.strip, css.editor)} aria-label={t("missions.editor")}>
      <header className={classes("wrap", css.head)}>
        <h2>{t("missions.editor")}</h2>
        <TextButton small onPress={() => void saveToLibrary(draft)}>{t("missions.save")}</TextButton>
        <TextButton small onPress={() => void saveDraft(draft)}>{t("missions.saveFile")}</TextButton>
        <TextButton small primary onPress={() => void tryDraft(draft)}>{t("missions.try")}</TextButton>
        <IconButton icon="close" label={t("missions.closeEditor")} onPress={leaveDraft} />
      </header>
      <div className={css.row}>
        <TextField value={draft.name} onChange={(name) => editDraft({ name }, "name")}>
          <Label>{t("missions.name")}</Label>
          <Input maxLength={80} />
        </TextField>
        <TextField className={css.wide} value={draft.story} onChange={(story) => editDraft({ story }, "story")}>
          <Label>{t("missions.story")}</Label>
          <Input maxLength={400} />
        </TextField>
        <Quantity
          label={t("missions.seconds")}
          value={draft.seconds}
          least={1}
          most={600}
          step={0.5}
          onChange={(seconds) => editDraft({ seconds }, "seconds")}
        />
      </div>
      <Zones draft={draft} />
      <Goals draft={draft} />
    </section>
  );
}

function Zones({ draft }: { draft: Draft }) {
  const t = useTexts();
  const mat = useStudio((studio) => studio.mat);
  const add = (make: (name: string, x: number, y: number) => MissionZone) => {
    let number = draft.zones.length + 1;
    while (draft.zones.some(({ name }) => name === `zone-${number}`)) number += 1;
    editDraft({ zones: [...draft.zones, make(`zone-${number}`, ...middleOf(mat))] });
  };
  return (
    <Part title={t("missions.zones")}>
      {draft.zones.map((zone, k) => (
        <ZoneLine key={k} draft={draft} place={k} zone={zone} />
      ))}
      <div className={css.row}>
        <ToolButton icon="polygon" wide label={t("missions.addBox")} onPress={() => add(boxAt)} />
        <ToolButton icon="disc" wide label={t("missions.addDisc")} onPress={() => add(discAt)} />
      </div>
    </Part>
  );
}

function Part({ title, children }: { title: string; children: ReactNode }) {
  return (
    <section aria-label={title}>
      <h3>{title}</h3>
      {children}
    </section>
  );
}

function ZoneLine({ draft, place, zone }: { draft: Draft; place: number; zone: MissionZone }) {
  const t = useTexts();
  const [left, bottom, width, height] = boxOf(zone);
  const change = (changed: MissionZone) => editDraft({ zones: draft.zones.with(place, changed) }, `zone ${place}`);
  const rename = (name: string) => {
    const goals = draft.goals.map((goal) => (goal.zone === zone.name ? { ...goal, zone: name } : goal));
    editDraft({ zones: draft.zones.with(place, { ...zone, name, title: { en: name, zh: name } }), goals }, `zone name ${place}`);
  };
  const isBeside = useStudio(({ mat }) => !touchesMat(mat, zone));
  const reshape = (changes: Parameters<typeof reshapedZone>[1]) => change(reshapedZone(zone, changes));
  return (
    <div className={css.row} role="group" aria-label={zone.name}>
      <TextField value={zone.name} onChange={rename}>
        <Label>{t("missions.zoneName")}</Label>
        <Input maxLength={40} />
      </TextField>
      <Quantity label={t("missions.left")} value={left} onChange={(value) => reshape({ left: value })} />
      <Quantity label={t("missions.bottom")} value={bottom} onChange={(value) => reshape({ bottom: value })} />
      <Quantity label={t("missions.width")} value={width} least={0.05} onChange={(value) => reshape({ width: value })} />
      {!zone.centre_m && <Quantity label={t("missions.height")} value={height} least={0.05} onChange={(value) => reshape({ height: value })} />}
      <ToolButton icon="trash" label={t("missions.removeZone", { name: zone.name })} onPress={() => editDraft({ zones: draft.zones.toSpliced(place, 1) })} />
      {isBeside && (
        <p role="status" className={css.warning}>
          {t("missions.zoneBeside")}
        </p>
      )}
    </div>
  );
}

function Goals({ draft }: { draft: Draft }) {
  const t = useTexts();
  return (
    <Part title={t("missions.goals")}>
      {draft.goals.map((goal, k) => (
        <GoalEditor key={k} draft={draft} place={k} goal={goal} />
      ))}
      <ToolButton icon="plus" wide label={t("missions.addGoal")} onPress={() => editDraft({ goals: [...draft.goals, newGoal("no-touch")] })} />
    </Part>
  );
}

function GoalEditor({ draft, place, goal }: { draft: Draft; place: number; goal: DraftGoal }) {
  const t = useTexts();
  const set = (changes: Partial<DraftGoal>) =>
    editDraft({ goals: draft.goals.with(place, { ...goal, ...changes }) }, `goal ${place}`);
  return (
    <div className={css.row} role="group" aria-label={t("missions.goalNumber", { number: place + 1 })}>
      <b>{place + 1}</b>
      <Choice
        label={t("missions.kind")}
        value={goal.kind}
        all={KINDS}
        name={(each) => t(`missions.kinds.${each}`)}
        onChange={(chosen) => editDraft({ goals: draft.goals.with(place, { ...newGoal(chosen, draft.zones[0]?.name), star: goal.star }) })}
      />
      {GOAL_KINDS[goal.kind].map((field) => (
        <GoalField key={field.name} draft={draft} goal={goal} field={field} set={set} />
      ))}
      <Choice
        label={t("missions.star")}
        value={String(goal.star)}
        all={["1", "2", "3"]}
        name={(each) => "★".repeat(Number(each))}
        onChange={(star) => set({ star: Number(star) })}
      />
      <ToolButton
        icon="trash"
        label={t("missions.removeGoal", { number: place + 1 })}
        isDisabled={draft.goals.length === 1}
        onPress={() => editDraft({ goals: draft.goals.toSpliced(place, 1) })}
      />
    </div>
  );
}

interface GoalFieldProps {
  draft: Draft;
  goal: DraftGoal;
  field: (typeof GOAL_KINDS)[GoalKind][number];
  set: (changes: Partial<DraftGoal>) => void;
}

function GoalField({ draft, goal, field, set }: GoalFieldProps) {
  const t = useTexts();
  const label = t(`missions.fields.${field.name}`);
  const value = goal[field.name];
  switch (field.input) {
    case "who":
      // A list of car numbers, which a file may have, stays as it is until a group is chosen.
      return (
        <Choice
          label={label}
          value={String(value)}
          all={[...GROUPS, ...(Array.isArray(value) ? [String(value)] : [])]}
          name={(each) => (GROUPS.includes(each as "all") ? t(`missions.who.${each as "all"}`) : each)}
          onChange={(who) => set({ who })}
        />
      );
    case "zone":
      return <Choice label={label} value={String(value)} all={draft.zones.map(({ name }) => name)} name={(each) => each} onChange={(zone) => set({ zone })} />;
    case "at":
      return <Choice label={label} value={value as "end"} all={TIMES} name={(each) => t(`missions.at.${each}`)} onChange={(at) => set({ at })} />;
    case "led":
      return (
        <Choice
          label={label}
          value={String(value) as "0"}
          all={LEDS.filter((each) => each !== "off" || goal.kind === "lit")}
          name={(each) => (each === "off" ? t("missions.ledOff") : t(`levels.light.${each}`))}
          onChange={(led) => set({ led: led === "off" ? led : Number(led) })}
        />
      );
    case "number":
      // What may be left out begins empty in a file; the editor offers the rest.
      if (value === undefined) return null;
      return (
        <Quantity
          label={label}
          value={Number(value)}
          least={field.least}
          most={field.most}
          step={field.whole ? 1 : 0.01}
          onChange={(typed) => set({ [field.name]: typed })}
        />
      );
  }
}
