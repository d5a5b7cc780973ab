import { useState } from "react";
import { Button, Label, ListBox, ListBoxItem, Menu, MenuItem, MenuTrigger, Popover, Select, SelectValue, Slider, SliderThumb, SliderTrack } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { MatIcon } from "../mat/icons";
import type { Session } from "../mat/session";
import { chosenCar, useMat } from "../mat/store";
import { ToolButton } from "../mat/ToolButton";
import type { CarEvent } from "./events";
import { clock, type Jump, jumpTo } from "./lanes";

const SPANS_S = [5, 10, 20, 60, 300];
const JUMPS: readonly Jump[] = ["word", "heard", "lost"];
const FILM_S = 10;

interface ToolsProps {
  session: Session;
  spanMs: number;
  onSpan: (spanMs: number) => void;
}

export function TimelineTools({ session, spanMs, onSpan }: ToolsProps) {
  const { t } = useTranslation();
  const [kind, setKind] = useState<Jump>("word");
  const [event, setEvent] = useState<CarEvent | null>(null);
  const past = useMat((now) => now.past);
  const jump = (forward: boolean) => {
    const to = jumpTo(session.events.of(chosenCar() ?? 0), kind, useMat.getState().tMs, forward);
    setEvent(to);
    if (to) session.seek(to.tMs);
  };
  return (
    <div className="timeline-tools">
      <Scrubber session={session} />
      <div className="mat-row">
        <ToolButton icon="left" label={t("timeline.previous")} onPress={() => jump(false)} />
        <Choice label={t("timeline.jump")} value={kind} all={JUMPS} name={(each) => t(`timeline.kinds.${each}`)} onChange={setKind} />
        <ToolButton icon="right" label={t("timeline.next")} onPress={() => jump(true)} />
        <Choice
          label={t("timeline.span")}
          value={String(spanMs / 1000)}
          all={SPANS_S.map(String)}
          name={(each) => t("timeline.seconds", { count: Number(each) })}
          onChange={(each) => onSpan(Number(each) * 1000)}
        />
        <Downloads session={session} />
      </div>
      <p className="timeline-event" aria-live="polite">
        {event && past ? <Told event={event} /> : t("timeline.howTo")}
      </p>
    </div>
  );
}

/** An event in words, for those who can't tell it from the lanes. */
function Told({ event: { tMs, car, kind, why, word, other } }: { event: CarEvent }) {
  const { t } = useTranslation();
  const hex = word.toString(16).padStart(8, "0").toUpperCase();
  const what = kind === "lost" && why ? t(`mat.lost.${why}`) : t(`timeline.events.${kind}`, { word: hex, car: other });
  return `${clock(tMs)} · ${t("mat.car", { number: car })} · ${what}`;
}

function Scrubber({ session }: { session: Session }) {
  const { t } = useTranslation();
  const { tMs, past, state } = useMat();
  const most = Math.max(state?.t_ms ?? 0, past ? 0 : tMs, 1);
  return (
    <div className="mat-row">
      <Slider
        className="mat-slider"
        aria-label={t("timeline.scrub")}
        minValue={Math.min(state?.earliest_ms ?? 0, most - 1)}
        maxValue={most}
        step={100}
        value={Math.min(tMs, most)}
        onChange={(to) => session.seek(to)}
      >
        <SliderTrack className="mat-track">
          <SliderThumb className="mat-thumb" aria-label={`${t("timeline.scrub")} ${clock(tMs)}`} />
        </SliderTrack>
      </Slider>
      <ToolButton icon="present" label={t("timeline.present")} wide isDisabled={!past} onPress={() => session.seek(null)} />
    </div>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  value: T;
  all: readonly T[];
  name: (each: T) => string;
  onChange: (chosen: T) => void;
}

function Choice<T extends string>({ label, value, all, name, onChange }: ChoiceProps<T>) {
  return (
    <Select className="mat-select" value={value} onChange={(key) => onChange(key as T)}>
      <Label className="visually-hidden">{label}</Label>
      <Button className="mat-button wide">
        <SelectValue />
        <MatIcon name="right" />
      </Button>
      <Popover className="mat-popover">
        <ListBox>
          {all.map((each) => (
            <ListBoxItem key={each} id={each} className="mat-option">
              {name(each)}
            </ListBoxItem>
          ))}
        </ListBox>
      </Popover>
    </Select>
  );
}

function Downloads({ session }: { session: Session }) {
  const { t } = useTranslation();
  const isEmpty = useMat(({ state }) => !state?.t_ms);
  const files = ["timeline.csv", `run.gif?seconds=${FILM_S}`, `run.mp4?seconds=${FILM_S}`];
  const names = [t("timeline.csv"), t("timeline.gif", { count: FILM_S }), t("timeline.mp4", { count: FILM_S })];
  return (
    <MenuTrigger>
      <Button className="mat-button wide" isDisabled={isEmpty}>
        <MatIcon name="download" />
        <span>{t("timeline.download")}</span>
      </Button>
      <Popover className="mat-popover">
        <Menu aria-label={t("timeline.download")}>
          {files.map((file, place) => (
            <MenuItem key={file} className="mat-option" href={`/api/world/${session.name}/${file}`} download={file.split("?")[0]}>
              {names[place]}
            </MenuItem>
          ))}
        </Menu>
      </Popover>
    </MenuTrigger>
  );
}
