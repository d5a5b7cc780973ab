import { type CSSProperties, useEffect, useRef, useState } from "react";
import { Button } from "react-aria-components";
import { request } from "../api/service";
import type { MissionEntry } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { Picture } from "../mat/Picture";
import { attempt } from "../projects/actions";
import { useAnswer } from "../projects/useAnswer";
import { closeDialog, openNotes } from "../state/dialogs";
import { confirm } from "../state/questions";
import { useStudio } from "../state/studio";
import { watchSize } from "../ui/areas";
import { IconButton, Sheet, TextButton } from "../ui/controls";
import { editOwn, openDraft, openMissionFile, playOwn } from "./draft";
import { stationAt, wayAlong } from "./road";
import { Stars } from "./Stars";
import { playMission } from "./store";
import controls from "../ui/controls.module.css";
import css from "./missions.module.css";

/** Open a mission, and close the map once it is open. */
const start = async (open: () => Promise<boolean>) => {
  if (await open()) closeDialog();
};

/** What its user has written and saved; nothing where there is none. */
function OwnMissions() {
  const t = useTexts();
  const [own, load] = useAnswer("missions/own", []);
  if (!own.length) return null;
  const remove = async (name: string) => {
    const question = { title: t("missions.deleteTitle", { name }), text: t("library.deleteText"), yes: t("library.delete") };
    if (!(await confirm(question))) return;
    await attempt(() => request("missions/delete", { name }));
    await load();
  };
  return (
    <section className={css.path} aria-label={t("missions.own")}>
      <h3>{t("missions.own")}</h3>
      <ul className={css.own}>
        {own.map(({ name }) => (
          <li key={name} className="row tight">
            <Button className={css.ownName} aria-label={t("missions.playNamed", { name })} onPress={() => void start(() => playOwn(name))}>
              {name}
            </Button>
            <IconButton icon="pencil" label={t("missions.editNamed", { name })} onPress={() => void start(() => editOwn(name))} />
            <IconButton icon="trash" label={t("library.deleteNamed", { name })} onPress={() => void remove(name)} />
          </li>
        ))}
      </ul>
    </section>
  );
}

/** The paths, each with the colour of its road. */
const PATHS = [["first-drive", "leader"], ["swarm", "followers"], ["words-and-bits", "success"], ["leader-decides", "warning"]] as const;

/** The map: the paths with a station for each mission. */
export function MissionMap() {
  const t = useTexts();
  const [missions] = useAnswer("missions", null);
  const isPupil = useStudio(({ capabilities }) => capabilities?.classroom === "pupil");
  const isStarting = useStudio(({ service }) => service === "starting");
  const earned = missions?.reduce((sum, each) => sum + each.earned.length, 0) ?? 0;
  const most = missions?.reduce((sum, each) => sum + each.stars.length, 0) ?? 0;
  return (
    <Sheet title={t("missions.title")} wide>
      <p className="quiet" role="status">
        {missions ? t("missions.earned", { count: earned, most }) : t(isStarting ? "server.starting" : "app.loading")}
      </p>
      {missions &&
        PATHS.map(([path, colour]) => (
          <section key={path} className={css.path} style={{ "--road": `var(--${colour})` } as CSSProperties} aria-label={t(`missions.paths.${path}`)}>
            <h3>{t(`missions.paths.${path}`)}</h3>
            <Road missions={missions.filter((each) => each.path === path)} />
          </section>
        ))}
      <OwnMissions />
      <footer className={controls.sheetFoot}>
        {!isPupil && (
          <TextButton onPress={() => openNotes(null)}>{t("missions.notes.title")}</TextButton>
        )}
        <TextButton onPress={() => void start(openMissionFile)}>{t("missions.openFile")}</TextButton>
        <TextButton
          onPress={() => {
            openDraft();
            closeDialog();
          }}
        >
          {t("missions.write")}
        </TextButton>
      </footer>
    </Sheet>
  );
}

/** A station is at least so wide, the road beside it included. */
const STATION_PX = 158;

/** The stations of a path along a road that turns back at each end of a row. */
function Road({ missions }: { missions: readonly MissionEntry[] }) {
  const host = useRef<HTMLOListElement>(null);
  const [columns, setColumns] = useState(4);
  useEffect(() => {
    const road = host.current!;
    return watchSize(road, () => setColumns(Math.max(2, Math.min(4, Math.floor(road.clientWidth / STATION_PX)))));
  }, []);
  const rows = Math.ceil(missions.length / columns);
  const next = missions.find(({ earned }) => !earned.length);
  const way = wayAlong(missions.length, columns);
  return (
    <ol className={css.stations} ref={host} style={{ "--columns": columns, "--rows": rows } as CSSProperties}>
      <svg className={css.road} viewBox={`0 0 ${columns} ${rows}`} preserveAspectRatio="none" aria-hidden="true">
        <path d={way} />
        <path d={way} className={css.line} />
      </svg>
      {missions.map((each, k) => {
        const { column, row } = stationAt(k, columns);
        return (
          <li key={each.id} style={{ gridColumn: column + 1, gridRow: row + 1 }}>
            <Button
              className={css.station}
              data-mission={each.id}
              data-next={each === next || undefined}
              data-earned={each.earned.length > 0 || undefined}
              onPress={() => void start(() => playMission({ id: each.id }))}
            >
              <Picture mat={each.mat} zones={each.zones} />
              <b>{inLanguage(each.name)}</b>
              <Stars stars={each.stars} earned={each.earned} />
            </Button>
          </li>
        );
      })}
    </ol>
  );
}
