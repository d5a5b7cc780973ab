import { useEffect, useState } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import * as api from "../api/requests";
import type { MissionEntry } from "../generated/messages";
import { inLanguage } from "../i18n";
import type { Mat } from "../mat/document";
import { attempt } from "../projects/actions";
import { Sheet } from "../ui/controls";
import { openDraft, openMissionFile } from "./draft";
import { Picture } from "./Picture";
import { Stars } from "./Stars";
import { playMission } from "./store";
import buttons from "../ui/buttons.module.css";
import controls from "../ui/controls.module.css";
import css from "./missions.module.css";

const PATHS = ["first-drive", "swarm", "words-and-bits"] as const;

/** The map: three paths with a station for each mission. */
export function MissionMap({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const [missions, setMissions] = useState<MissionEntry[] | null>(null);
  useEffect(() => void attempt(async () => setMissions(await api.missions())), []);
  const earned = missions?.reduce((sum, each) => sum + each.earned.length, 0) ?? 0;
  const most = missions?.reduce((sum, each) => sum + each.stars.length, 0) ?? 0;
  const start = async (open: () => Promise<boolean>) => {
    if (await open()) onClose();
  };
  return (
    <Sheet title={t("missions.title")} onClose={onClose} wide>
      <p className={controls.quiet} role="status">
        {missions && t("missions.earned", { count: earned, most })}
      </p>
      {missions &&
        PATHS.map((path) => (
          <section key={path} className={css.path} data-path={path} aria-label={t(`missions.paths.${path}`)}>
            <h3>{t(`missions.paths.${path}`)}</h3>
            <ol className={css.stations}>
              {missions
                .filter((each) => each.path === path)
                .map((each) => (
                  <li key={each.id}>
                    <Button className={css.station} data-mission={each.id} onPress={() => void start(() => playMission({ id: each.id }))}>
                      <Picture mat={each.mat as Mat} zones={each.zones} />
                      <b>{inLanguage(each.name)}</b>
                      <Stars stars={each.stars} earned={each.earned} />
                    </Button>
                  </li>
                ))}
            </ol>
          </section>
        ))}
      <footer className={controls.sheetFoot}>
        <Button className={buttons.button} onPress={() => void start(openMissionFile)}>
          {t("missions.openFile")}
        </Button>
        <Button
          className={buttons.button}
          onPress={() => {
            openDraft();
            onClose();
          }}
        >
          {t("missions.write")}
        </Button>
      </footer>
    </Sheet>
  );
}
