import { useState } from "react";
import { Button, Menu, MenuItem, MenuTrigger, Popover, Slider, SliderThumb, SliderTrack } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Icon } from "../ui/icons";
import type { Session } from "../mat/session";
import { useStudio } from "../state/studio";
import { chosenCar, useMat } from "../mat/store";
import { Choice, ToolButton } from "../mat/fields";
import { type CarEvent, clock, type Jump, jumpTo } from "./events";
import fields from "../mat/fields.module.css";
import panel from "../mat/mat.module.css";
import css from "./timeline.module.css";
import { classes } from "../ui/classes";

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
    <div className={css.tools}>
      <Scrubber session={session} />
      <div className={panel.row}>
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
      <p className={css.event} aria-live="polite">
        {event && past ? <EventText event={event} /> : t("timeline.howTo")}
      </p>
    </div>
  );
}

/** An event as a sentence, for those who can't read the lanes. */
function EventText({ event: { tMs, car, kind, why, word, other } }: { event: CarEvent }) {
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
    <div className={panel.row}>
      <Slider
        className={fields.slider}
        aria-label={t("timeline.scrub")}
        minValue={Math.min(state?.earliest_ms ?? 0, most - 1)}
        maxValue={most}
        step={100}
        value={Math.min(tMs, most)}
        onChange={(to) => session.seek(to)}
      >
        <SliderTrack className={fields.track}>
          <SliderThumb className={fields.thumb} aria-label={`${t("timeline.scrub")} ${clock(tMs)}`} />
        </SliderTrack>
      </Slider>
      <ToolButton icon="present" label={t("timeline.present")} wide isDisabled={!past} onPress={() => session.seek(null)} />
    </div>
  );
}

function Downloads({ session }: { session: Session }) {
  const { t } = useTranslation();
  const isEmpty = useMat(({ state }) => !state?.t_ms);
  const hasFilms = useStudio(({ capabilities }) => capabilities?.films ?? false);
  const films = [
    { file: `run.gif?seconds=${FILM_S}`, name: t("timeline.gif", { count: FILM_S }) },
    { file: `run.mp4?seconds=${FILM_S}`, name: t("timeline.mp4", { count: FILM_S }) },
  ];
  const files = [{ file: "timeline.csv", name: t("timeline.csv") }, ...(hasFilms ? films : [])];
  return (
    <MenuTrigger>
      <Button className={classes(fields.button, fields.wide)} isDisabled={isEmpty}>
        <Icon name="download" />
        <span>{t("timeline.download")}</span>
      </Button>
      <Popover className={fields.popover}>
        <Menu aria-label={t("timeline.download")}>
          {files.map(({ file, name }) => (
            <MenuItem key={file} className={fields.option} href={`/api/world/${session.name}/${file}`} download={file.split("?")[0]}>
              {name}
            </MenuItem>
          ))}
        </Menu>
      </Popover>
    </MenuTrigger>
  );
}
